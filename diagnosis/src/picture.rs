//! A fit as a picture (SVG text): magnetization and strain over field, measured and modelled, and what is left.
//!
//! Colours tell measured (dark) from modelled (orange), and residuals have their own panels, because an error of one
//! per cent cannot be seen on the loops themselves.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::error::DiagnosisError;
use crate::fit::{Fit, FittedLoop};
use crate::sweep::extremes;

const PANEL: (u32, u32) = (640, 420);
const MEASURED: RGBColor = RGBColor(40, 60, 90);
const MODELLED: RGBColor = RGBColor(225, 110, 20);
/// Empty room around the curves, as a share of their range.
const MARGIN: f64 = 0.05;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Series = Vec<(f64, f64)>;

/// One coordinate system: title, unit of the ordinate, and lines.
struct Panel {
    title: String,
    ordinate: &'static str,
    lines: Vec<(Series, RGBColor, Option<&'static str>)>,
}

/// M over H with its residual, and strain over H with its residual where strain was measured. The field is in kA/m
/// when it exceeds 1 kA/m.
pub fn picture(fit: &Fit) -> Result<String, DiagnosisError> {
    let panels = panels(fit);
    let rows = panels.len().div_ceil(2) as u32;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (2 * PANEL.0, rows * PANEL.1)).into_drawing_area();
        root.fill(&WHITE).map_err(refuse)?;
        let largest = fit
            .report
            .loops
            .iter()
            .fold(0.0_f64, |most, of| most.max(of.largest_field_a_per_m));
        let (scale, abscissa) = if largest > 1e3 {
            (1e-3, "field H, kA/m")
        } else {
            (1.0, "field H, A/m")
        };
        for (area, panel) in root.split_evenly((rows as usize, 2)).iter().zip(&panels) {
            draw(area, panel, scale, abscissa)?;
        }
        root.present().map_err(refuse)?;
    }
    Ok(text)
}

fn panels(fit: &Fit) -> Vec<Panel> {
    let report = &fit.report;
    let over = |field: &[f64], values: Vec<f64>| field.iter().copied().zip(values).collect::<Series>();
    let scaled = |values: &[f64], scale: f64| values.iter().map(|value| value * scale).collect::<Vec<f64>>();
    let magnetization = |of: &FittedLoop| {
        let measured = over(&of.field_a_per_m, scaled(&of.measured_magnetization_a_per_m, 1e-3));
        (
            measured,
            over(&of.field_a_per_m, scaled(&of.model_magnetization_a_per_m, 1e-3)),
        )
    };
    let strain = |of: &FittedLoop| {
        let strain = of.strain.as_ref()?;
        let measured = over(&of.field_a_per_m, scaled(&strain.measured, 1e6));
        Some((measured, over(&of.field_a_per_m, scaled(&strain.model, 1e6))))
    };
    let curve = report.anhysteretic;
    let mut panels = pair(
        format!(
            "magnetization, {curve:?}: {:.3} % of range rms",
            100.0 * report.magnetization_nrmse
        ),
        ["M, kA/m", "model - measured, kA/m"],
        fit.loops.iter().map(magnetization).collect(),
    );
    let strains: Vec<_> = fit.loops.iter().filter_map(strain).collect();
    if let Some(nrmse) = report.strain_nrmse {
        let title = format!("strain from field: {:.3} % of range rms", 100.0 * nrmse);
        panels.extend(pair(title, ["strain, ppm", "model - measured, ppm"], strains));
    }
    panels
}

/// A panel of curves and one of their differences.
fn pair(title: String, ordinates: [&'static str; 2], loops: Vec<(Series, Series)>) -> Vec<Panel> {
    let difference = |(measured, model): &(Series, Series)| {
        measured
            .iter()
            .zip(model)
            .map(|(seen, made)| (seen.0, made.1 - seen.1))
            .collect::<Series>()
    };
    let residuals = loops.iter().map(|of| (difference(of), MODELLED, None)).collect();
    let mut lines = Vec::new();
    for (index, (measured, model)) in loops.into_iter().enumerate() {
        // One entry in the legend speaks for all loops.
        let named = |name| (index == 0).then_some(name);
        lines.push((measured, MEASURED, named("measured")));
        lines.push((model, MODELLED, named("model")));
    }
    let [curves, differences] = ordinates;
    vec![
        Panel {
            title,
            ordinate: curves,
            lines,
        },
        Panel {
            title: "what is left".to_owned(),
            ordinate: differences,
            lines: residuals,
        },
    ]
}

fn draw(area: &Area<'_>, panel: &Panel, field_scale: f64, abscissa: &str) -> Result<(), DiagnosisError> {
    let points = || panel.lines.iter().flat_map(|(series, ..)| series);
    let fields: Vec<f64> = points().map(|(field, _)| field * field_scale).collect();
    let values: Vec<f64> = points().map(|(_, value)| *value).collect();
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(roomy(&fields), roomy(&values))
        .map_err(refuse)?;
    chart
        .configure_mesh()
        .x_desc(abscissa)
        .y_desc(panel.ordinate)
        .axis_desc_style(("sans-serif", 14))
        .label_style(("sans-serif", 12))
        .light_line_style(WHITE)
        .draw()
        .map_err(refuse)?;
    for (series, colour, name) in &panel.lines {
        let scaled = series.iter().map(|(field, value)| (field * field_scale, *value));
        let drawn = chart.draw_series(LineSeries::new(scaled, colour)).map_err(refuse)?;
        if let Some(name) = name {
            let colour = *colour;
            drawn
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour));
        }
    }
    if panel.lines.iter().any(|(.., name)| name.is_some()) {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerRight)
            .label_font(("sans-serif", 13))
            .border_style(RGBColor(200, 200, 200))
            .background_style(WHITE)
            .draw()
            .map_err(refuse)?;
    }
    Ok(())
}

fn roomy(values: &[f64]) -> std::ops::Range<f64> {
    let (low, high) = extremes(values);
    let room = MARGIN * (high - low).max(f64::MIN_POSITIVE);
    low - room..high + room
}

fn refuse(error: impl std::fmt::Display) -> DiagnosisError {
    DiagnosisError::Picture(error.to_string())
}
