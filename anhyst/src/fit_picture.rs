//! A fit as a picture (SVG text): magnetization and strain over field, measured and modelled, and what is left.
//!
//! Residuals have their own charts, because an error of one per cent cannot be seen on the loops themselves.

use anhyst_identify::{Fit, FittedLoop};
use anhyst_report::ReportError;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};

/// Field, measured and modelled values of one loop.
struct Curves<'a> {
    field_a_per_m: &'a [f64],
    measured: &'a [f64],
    model: &'a [f64],
}

/// M over H with its residual, and strain over H with its residual where strain was measured.
pub fn picture(fit: &Fit) -> Result<String, ReportError> {
    let report = &fit.report;
    let title = format!(
        "magnetization, {:?}: {:.3} % of range rms",
        report.anhysteretic,
        100.0 * report.magnetization_nrmse
    );
    let mut charts = pair(
        &title,
        ("M", "A/m"),
        fit.loops.iter().map(magnetization_curves).collect(),
    );
    if let Some(nrmse) = report.strain_nrmse {
        let title = format!("strain from field: {:.3} % of range rms", 100.0 * nrmse);
        let strains = fit.loops.iter().filter_map(strain_curves).collect();
        charts.extend(pair(&title, ("strain", "m/m"), strains));
    }
    Figure::new("", charts).svg()
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

/// A chart of curves and one of their differences.
fn pair(title: &str, (name, unit): (&str, &str), loops: Vec<Curves>) -> Vec<Chart> {
    let field = || Axis::new("field H", "A/m");
    let mut curves = Chart::new(title, field(), Axis::new(name, unit));
    let mut left = Chart::new("what is left", field(), Axis::new("model − measured", unit));
    for (index, of) in loops.iter().enumerate() {
        // One entry in the legend speaks for all loops.
        let named = |line: Curve, name: &str| if index == 0 { line.named(name) } else { line };
        let measured = Curve::over(of.field_a_per_m, of.measured, Role::Measured);
        let model = Curve::over(of.field_a_per_m, of.model, Role::Nominal);
        curves
            .curves
            .extend([named(measured, "measured"), named(model, "model")]);
        let differences: Vec<f64> = of
            .model
            .iter()
            .zip(of.measured)
            .map(|(made, seen)| made - seen)
            .collect();
        left.curves
            .push(Curve::over(of.field_a_per_m, &differences, Role::Remainder));
    }
    vec![curves, left]
}

#[cfg(test)]
mod tests {
    use anhyst_identify::{FitOptions, fit};
    use anhyst_measured::{MeasuredRun, Quantity};
    use anhyst_model::{Hysteresis, MagneticState};

    /// Guards the picture's charts: magnetization and strain, each with what is left.
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
        let strain = magnetization.iter().map(|m| 2e-15 * m * m).collect();
        let series = vec![
            (Quantity::Field, field_a_per_m),
            (Quantity::Magnetization, magnetization),
            (Quantity::Strain, strain),
        ];
        let measured = MeasuredRun::in_memory("made", None, series).unwrap();
        let options = FitOptions {
            candidates: 10,
            starts: 1,
            ..FitOptions::default()
        };
        let fit = fit(&[measured], &options, &mut |_| ()).unwrap();
        let svg = super::picture(&fit).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("strain from field"));
    }
}
