//! A diagnosis as a Rerun recording: measured run, old model, new model and what each leaves, side by side.

use anhyst_diagnosis::{Diagnosed, RunSeries};
use anhyst_recorder::{Album, AlbumPage};
use anhyst_report::chart::{Chart, Curve, Role, TIME};

/// One page a run, and one of what was found.
pub fn album(found: &Diagnosed) -> Album {
    let own = &found.diagnosis;
    let unit = if own.unit.is_empty() { "m/m" } else { own.unit.as_str() };
    let pages = found.runs.iter().map(|run| page(run, unit, &own.sentence));
    Album {
        name: own.model.clone(),
        pages: pages.collect(),
    }
}

fn page(run: &RunSeries, unit: &str, sentence: &str) -> AlbumPage {
    let tick_s = run.tick_s.unwrap_or(1.0);
    let along: Vec<f64> = (0..run.measured.len()).map(|row| row as f64 * tick_s).collect();
    let abscissa = if run.tick_s.is_some() { TIME } else { "row" };
    let left = |model: &[f64]| run.measured.iter().zip(model).map(|(y, m)| y - m).collect::<Vec<f64>>();
    let (before, after) = (left(&run.before), left(&run.after));
    let output = format!("output, {unit}");
    let models = |title: &str, abscissa: &str, x: &[f64]| {
        Chart::new(title, abscissa, output.as_str())
            .curve(Curve::over(x, &run.measured, Role::Measured).named("measured"))
            .curve(Curve::over(x, &run.before, Role::Nominal).named("old model"))
            .curve(Curve::over(x, &run.after, Role::Amended).named("new model"))
    };
    let what_is_left = |title: &str, abscissa: &str, x: &[f64]| {
        Chart::new(title, abscissa, output.as_str())
            .curve(Curve::over(x, &before, Role::Nominal).named("old model"))
            .curve(Curve::over(x, &after, Role::Amended).named("new model"))
    };
    AlbumPage {
        title: run.source.clone(),
        notes: format!("{sentence}\n\n{}", run.source),
        charts: vec![
            models("measured and modelled", abscissa, &along),
            what_is_left("what is left (measured − model)", abscissa, &along),
            models("loops", "field, A/m", &run.field_a_per_m),
            what_is_left("what is left over the field", "field, A/m", &run.field_a_per_m),
        ],
    }
}
