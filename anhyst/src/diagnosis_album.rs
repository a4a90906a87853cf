//! A diagnosis as a Rerun recording: measured run, old model, new model and what each leaves, side by side.

use anhyst_diagnosis::{Diagnosed, RunSeries};
use anhyst_recorder::{Album, AlbumPage};
use anhyst_report::album::album_page;
use anhyst_report::figure::{Panel, TIME, curve, panel};

/// Abscissa of a run without time.
const ROW: &str = "row";
const MILLION: f64 = 1e6;

/// One page a run, and one of what was found.
pub fn album(found: &Diagnosed) -> Album {
    let own = &found.diagnosis;
    // Metres and strains alike are read best in millionths.
    let unit = if own.unit.is_empty() { "ppm" } else { "µm" };
    let pages = found.runs.iter().map(|run| page(run, unit, &own.sentence));
    Album {
        name: own.model.clone(),
        pages: pages.collect(),
    }
}

fn page(run: &RunSeries, unit: &str, sentence: &str) -> AlbumPage {
    let over = |values: Vec<f64>| -> Vec<[f64; 2]> {
        let tick_s = run.tick_s.unwrap_or(1.0);
        let along = values.into_iter().enumerate();
        along
            .map(|(row, value)| [row as f64 * tick_s, MILLION * value])
            .collect()
    };
    let left = |model: &[f64]| run.measured.iter().zip(model).map(|(y, m)| y - m).collect::<Vec<f64>>();
    let against_field = |values: &[f64]| -> Vec<[f64; 2]> {
        let pairs = run.field_a_per_m.iter().zip(values);
        pairs.map(|(field, value)| [*field, MILLION * value]).collect()
    };
    let abscissa = if run.tick_s.is_some() { TIME } else { ROW };
    let output = format!("output, {unit}");
    let panels: [Panel; 4] = [
        panel(
            "measured and modelled",
            abscissa,
            &output,
            vec![
                curve("measured", over(run.measured.clone())),
                curve("old model", over(run.before.clone())),
                curve("new model", over(run.after.clone())),
            ],
        ),
        panel(
            "what is left (measured - model)",
            abscissa,
            &output,
            vec![
                curve("old model", over(left(&run.before))),
                curve("new model", over(left(&run.after))),
            ],
        ),
        panel(
            "loops",
            "field, A/m",
            &output,
            vec![
                curve("measured", against_field(&run.measured)),
                curve("old model", against_field(&run.before)),
                curve("new model", against_field(&run.after)),
            ],
        ),
        panel(
            "what is left over the field",
            "field, A/m",
            &output,
            vec![
                curve("old model", against_field(&left(&run.before))),
                curve("new model", against_field(&left(&run.after))),
            ],
        ),
    ];
    album_page(&run.source, &format!("{sentence}\n\n{}", run.source), &panels)
}
