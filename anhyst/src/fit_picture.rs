//! A fit as a picture (SVG text): magnetization and strain over field, measured and modelled, and what is left.
//!
//! Residuals have their own panels, because an error of one per cent cannot be seen on the loops themselves.

use anhyst_identify::{Fit, FittedLoop};
use anhyst_report::ReportError;
use anhyst_report::plot::{Axis, Figure, Line, Panel, Role};

/// Size of one panel, pixels.
const PANEL: (u32, u32) = (640, 420);

/// Field, measured and modelled values of one loop.
struct Curves<'a> {
    field_a_per_m: &'a [f64],
    measured: &'a [f64],
    model: &'a [f64],
}

/// M over H with its residual, and strain over H with its residual where strain was measured.
pub fn picture(fit: &Fit) -> Result<String, ReportError> {
    let figure = figure(fit);
    let rows = figure.panels.len().div_ceil(2) as u32;
    figure.svg(2 * PANEL.0, rows * PANEL.1)
}

fn figure(fit: &Fit) -> Figure {
    let report = &fit.report;
    let title = format!(
        "magnetization, {:?}: {:.3} % of range rms",
        report.anhysteretic,
        100.0 * report.magnetization_nrmse
    );
    let mut figure = Figure::new("").columns(2);
    figure.panels = pair(
        &title,
        ("M", "A/m"),
        fit.loops.iter().map(magnetization_curves).collect(),
    );
    if let Some(nrmse) = report.strain_nrmse {
        let title = format!("strain from field: {:.3} % of range rms", 100.0 * nrmse);
        let strains = fit.loops.iter().filter_map(strain_curves).collect();
        figure.panels.extend(pair(&title, ("strain", "m/m"), strains));
    }
    figure
}

fn magnetization_curves(of: &FittedLoop) -> Curves<'_> {
    Curves {
        field_a_per_m: &of.field_a_per_m,
        measured: &of.measured_magnetization_a_per_m,
        model: &of.model_magnetization_a_per_m,
    }
}

fn strain_curves(of: &FittedLoop) -> Option<Curves<'_>> {
    let strain = of.strain.as_ref()?;
    Some(Curves {
        field_a_per_m: &of.field_a_per_m,
        measured: &strain.measured,
        model: &strain.model,
    })
}

/// A panel of curves and one of their differences.
fn pair(title: &str, (name, unit): (&str, &str), loops: Vec<Curves>) -> Vec<Panel> {
    let field = || Axis::new("field H", "A/m");
    let mut curves = Panel::new(title, field(), Axis::new(name, unit));
    let mut left = Panel::new("what is left", field(), Axis::new("model − measured", unit));
    for (index, of) in loops.iter().enumerate() {
        // One entry in the legend speaks for all loops.
        let named = |line: Line, name: &str| if index == 0 { line.named(name) } else { line };
        let measured = Line::over(of.field_a_per_m, of.measured, Role::Measured);
        let model = Line::over(of.field_a_per_m, of.model, Role::Model);
        curves
            .lines
            .extend([named(measured, "measured"), named(model, "model")]);
        let differences: Vec<f64> = of
            .model
            .iter()
            .zip(of.measured)
            .map(|(made, seen)| made - seen)
            .collect();
        left.lines
            .push(Line::over(of.field_a_per_m, &differences, Role::Residual));
    }
    vec![curves, left]
}

#[cfg(test)]
mod tests {
    use anhyst_identify::{FitOptions, fit};
    use anhyst_measured::{MeasuredLoop, MeasuredLoops};
    use anhyst_model::{Hysteresis, MagneticState};

    /// Guards the picture's panels: magnetization and strain, each with what is left.
    #[test]
    fn a_fit_with_strain_is_drawn_with_its_strain() {
        let material = Hysteresis::terfenol_d();
        let field_a_per_m: Vec<f64> = (0..=200).map(|i| 30e3 * (0.0314 * f64::from(i)).sin()).collect();
        let mut state = MagneticState::default();
        let magnetization: Vec<f64> = field_a_per_m
            .iter()
            .map(|&to| {
                state = material.advance(state, to);
                state.magnetization_a_per_m
            })
            .collect();
        let measured = MeasuredLoops {
            source: "made".to_owned(),
            data_hash: String::new(),
            dropped_rows: 0,
            loops: vec![MeasuredLoop {
                id: "0".to_owned(),
                rows: (0..201).collect(),
                time_s: None,
                strain: Some(magnetization.iter().map(|m| 2e-15 * m * m).collect()),
                magnetization_a_per_m: Some(magnetization),
                field_a_per_m,
            }],
        };
        let options = FitOptions {
            candidates: 10,
            starts: 1,
            ..FitOptions::default()
        };
        let fit = fit(&measured, &options, &mut |_| ()).unwrap();
        let svg = super::picture(&fit).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("strain from field"));
    }
}
