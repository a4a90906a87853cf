//! `anhyst fit`: a material from measured loops, with standard deviations, warnings and a picture.

use super::fit_arguments::{Curve, FitArguments};
use super::unread::unread;
use super::{Ending, json, save, stem};
use crate::fit_picture::picture;
use anhyst_identify::{Curves, Fit, FitOptions, FitReport, IdentifyError, Progress, fit, material_text};
use anhyst_launch::error::RunError;
use anhyst_measured::MeasuredRun;
use anhyst_model::Anhysteretic;
use anhyst_report::table::Table;
use anhyst_scenario::to_ron;
use std::path::Path;

/// Runs the command.
///
/// # Errors
/// Bad data, or a result that cannot be written.
pub fn run(arguments: &FitArguments) -> miette::Result<Ending> {
    let data = arguments.data.file();
    if let Some(law) = &arguments.law {
        return super::fit_law::run(arguments, data, law);
    }
    let name = arguments.name.clone().unwrap_or_else(|| stem(data));
    if name.trim().is_empty() || name.contains(['/', '\n', '"', '\\']) || name.starts_with('.') {
        return Err(miette::miette!(
            "--name {name:?} names a folder and a material: it must not be empty, begin with '.', or hold / \\ \" or a line break"
        ));
    }
    let reading = arguments.table.reading();
    let measured = MeasuredRun::read_loops(data, &reading).map_err(unread("fit", data, &reading))?;
    let options = FitOptions {
        curves: match arguments.curve {
            Curve::Both => Curves::Both,
            Curve::Langevin => Curves::Only(Anhysteretic::Langevin),
            Curve::Ising => Curves::Only(Anhysteretic::Ising),
        },
        fixed: arguments.fix.clone(),
        candidates: arguments.candidates,
        starts: arguments.starts,
        strain_weight: arguments.strain_weight,
        ..FitOptions::default()
    };
    let bar = super::long_bar(1, "fit", "parameter sets");
    let found = fit(&measured, &options, &mut |progress| show(&bar, progress))
        .map_err(|error: IdentifyError| miette::miette!("{error}"))?;
    bar.finish_and_clear();
    let results = arguments.out.claim(&format!("fit-{name}"))?;
    let out = &results.path;
    write(&found, &name, out)?;
    if arguments.json.json {
        crate::say!("{}", json(&found.report)?);
    } else {
        print_report(&found.report);
        crate::say!("\nresults: {}", out.display());
    }
    Ok(Ending::Held)
}

fn show(bar: &indicatif::ProgressBar, progress: Progress) {
    bar.set_length(progress.total as u64);
    bar.set_position(progress.done as u64);
    bar.set_prefix(format!("{}, best {:.3} %", progress.stage, 100.0 * progress.best_nrmse));
}

fn write(found: &Fit, name: &str, out: &Path) -> Result<(), RunError> {
    let setup = |error: String| RunError::Setup(error);
    // Loops without strain give no material that could move anything: their hysteresis is written alone.
    let (file, text) = if found.magnetostriction.is_some() {
        (
            "material.ron",
            material_text(found, name).map_err(|error| setup(error.to_string()))?,
        )
    } else {
        (
            "hysteresis.ron",
            to_ron(&found.hysteresis).map_err(|error| setup(error.to_string()))? + "\n",
        )
    };
    let report = json(&found.report)? + "\n";
    let drawing = picture(found).map_err(|error| setup(error.to_string()))?;
    save(out, file, &text)?;
    save(out, "fit.json", &report)?;
    save(out, "fit.svg", &drawing)
}

fn print_report(report: &FitReport) {
    let mut table = Table::new(["parameter", "value", "standard deviation", "unit"]);
    for fitted in &report.parameters {
        let deviation = fitted
            .standard_deviation
            .map_or_else(|| "held".into(), |deviation| format!("{deviation:.3e}"));
        table.push([
            fitted.symbol.clone(),
            format!("{:.6e}", fitted.value),
            deviation,
            fitted.unit.clone(),
        ]);
    }
    let effective = report.effective_shape_a_per_m;
    let (value, deviation) = (
        format!("{:.6e}", effective.value),
        format!("{:.3e}", effective.standard_deviation),
    );
    let combination = match report.anhysteretic {
        Anhysteretic::Langevin => "a - alpha Ms/3",
        Anhysteretic::Ising => "a - alpha Ms",
    };
    table.push([combination.to_owned(), value, deviation, "A/m".to_owned()]);
    crate::say!("{}", table.terminal());
    crate::say!(
        "\n{:?} curve; magnetization {:.3} % of its range rms over all loops",
        report.anhysteretic,
        100.0 * report.magnetization_nrmse
    );
    if let Some(strain) = report.strain_nrmse {
        crate::say!("strain {:.3} % of its range rms", 100.0 * strain);
    }
    for measured in &report.loops {
        crate::say!(
            "  loop {}: {:.3} % up to {} A/m",
            measured.id,
            100.0 * measured.magnetization_nrmse,
            measured.largest_field_a_per_m
        );
    }
    for assumption in &report.assumptions {
        crate::say!("assumed: {assumption}");
    }
    for warning in &report.warnings {
        crate::say!("WARNING: {warning}");
    }
}
