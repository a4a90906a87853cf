//! `anhyst diagnose`: where model and measurement disagree, named, added to the model, and shown.

use super::unread::unread;
use super::{Ending, json, save, stem};
use crate::arguments::{JsonArgument, MeasuredFiles, OutArgument, SettleArgument, TableArguments, ThreadsArgument};
use crate::control::{Control, Models, control, section, ticks};
use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, Diagnosis, DiagnosisError, amended_text, diagnose, page, table};
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, Magnetostriction};
use anhyst_scenario::{Scenario, load, load_model};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// `diagnose`
#[derive(Debug, Args)]
pub struct DiagnoseArguments {
    /// Model of the actuator (RON), as scenarios/models/nominal.ron, or a material alone for sweeps of magnetization or
    /// strain, or a hysteresis alone, as `fit` writes it without strain, for sweeps of magnetization.
    #[arg(long, value_name = "FILE")]
    pub model: PathBuf,
    /// Measured runs.
    #[command(flatten)]
    pub data: MeasuredFiles,
    /// What of them is read.
    #[command(flatten)]
    pub table: TableArguments,
    /// How they begin.
    #[command(flatten)]
    pub settle: SettleArgument,
    /// The model's numbers were fitted to measurements: zeros are free, and parameters may have to be calibrated.
    #[arg(long)]
    pub fitted_model: bool,
    /// Make the cut of this scenario on a plant that has what was found: with the old model, the amended one, and the runner-up.
    #[arg(long, value_name = "SCENARIO.ron")]
    pub control: Option<PathBuf>,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the search.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How the diagnosis is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// A model of another hysteresis law may be driven by a voltage or a current.
fn driven(run: MeasuredRun, model: &ActuatorModel) -> MeasuredRun {
    match model.material.units()[0] {
        "V" => run.driven_by(Quantity::Voltage),
        "A" => run.driven_by(Quantity::Current),
        _ => run,
    }
}

/// Runs the command.
///
/// # Errors
/// Bad data, a bad model, or a result that cannot be written.
pub fn run(arguments: &DiagnoseArguments) -> miette::Result<Ending> {
    let model = load_model(&arguments.model)?;
    // Before the minutes that the search takes: a scenario with a mistake in it is told now.
    let cut = arguments.control.as_ref().map(|file| load(file, &[])).transpose()?;
    let reading = arguments.table.reading();
    let files = arguments.data.files();
    let runs = files
        .iter()
        .map(|file| MeasuredRun::read_each(file, &reading).map_err(unread("diagnose", file, &reading)))
        .collect::<Result<Vec<_>, _>>()
        .map(|runs| runs.concat())?;
    let runs: Vec<MeasuredRun> = runs.into_iter().map(|run| driven(run, &model)).collect();
    refuse_motion(&model, &runs, arguments.control.is_some())?;
    let options = DiagnoseOptions {
        threads: arguments.threads.count(),
        fitted_model: arguments.fitted_model,
        settle_s: arguments.settle.settle_s,
        shape_drift_a_per_m: None,
    };
    // Before the work, so that a typing error costs nothing.
    let first = files.first().map_or_else(String::new, |file| stem(file));
    let name = format!("diagnose-{first}");
    let results = arguments.out.claim_beside(&name, "amended.ron", &arguments.model)?;
    let out = &results.path;
    let bar = super::share_bar("diagnose");
    let found = diagnose(&model, &runs, &options, &mut |stage, share| {
        bar.set_prefix(stage.to_owned());
        bar.set_position((100.0 * share) as u64);
    })
    .map_err(|error: DiagnosisError| miette::miette!("{error}"))?;
    bar.finish_and_clear();
    let compared = match &cut {
        Some(scenario) => in_the_loop(
            scenario,
            &model,
            &found,
            &out.join("control"),
            arguments.threads.count(),
        )?,
        None => None,
    };
    let written = Written {
        diagnosis: &found.diagnosis,
        control: compared.as_ref(),
    };
    let text = json(&written)?;
    write(&found, &text, compared.as_ref(), &command(arguments, out), out)?;
    if arguments.json.json {
        crate::say!("{text}");
        return Ok(Ending::Held);
    }
    print(&found);
    if let Some(compared) = &compared {
        crate::say!("\n{}", compared.table().terminal());
        compared
            .sentences()
            .iter()
            .for_each(|sentence| crate::say!("{sentence}"));
    } else if arguments.control.is_some() {
        crate::say!("\nNothing was named, so there is no other model to make the cut with.");
    }
    crate::say!("\nresults: {}", out.display());
    Ok(Ending::Held)
}

/// A model without a strain law says nothing of what moves, and makes no cut.
fn refuse_motion(model: &ActuatorModel, runs: &[MeasuredRun], cut: bool) -> miette::Result<()> {
    let name = &model.name;
    let is_still = model.rod.is_none() && model.material.law.is_none();
    let moves =
        |run: &&MeasuredRun| run.series(Quantity::Displacement).is_some() && run.series(Quantity::Strain).is_none();
    if let Some(run) = runs.iter().find(moves).filter(|_| is_still) {
        return Err(miette::miette!(
            "{} holds a displacement, and {name} has no rod that could move. Give the model one, as scenarios/models/nominal.ron has, or leave the \
             column out with --column displacement=-",
            run.source
        ));
    }
    if model.material.magnetostriction != Magnetostriction::Unmeasured {
        return Ok(());
    }
    if cut {
        return Err(miette::miette!(
            "--control: {name} has no strain law, so a loop with it moves nothing"
        ));
    }
    for quantity in [Quantity::Strain, Quantity::Displacement] {
        if let Some(run) = runs.iter().find(|run| run.series(quantity).is_some()) {
            return Err(miette::miette!(
                "{} holds a {}, and {name} has no strain law to compare it with. Give the model one, or leave the column out with \
                 --column {}=-, so that the magnetization is compared",
                run.source,
                quantity.name(),
                quantity.key()
            ));
        }
    }
    Ok(())
}

/// `diagnosis.json`.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    control: Option<&'a Control>,
}

/// The cut with every model; nothing where nothing was named.
fn in_the_loop(
    scenario: &Scenario,
    old: &ActuatorModel,
    found: &Diagnosed,
    out: &Path,
    threads: usize,
) -> miette::Result<Option<Control>> {
    if found.amended == *old {
        return Ok(None);
    }
    anhyst_launch::signals::install();
    let names = found.diagnosis.runner_up.as_ref().map(|rival| rival.name.as_str());
    let runner_up = names.zip(found.runner_up.as_ref());
    let bar = super::progress_bar(ticks(scenario, runner_up.is_some()), "control");
    let models = Models {
        old,
        amended: &found.amended,
        runner_up,
    };
    let compared = control(scenario, models, out, threads, &|done| bar.inc(done));
    bar.finish_and_clear();
    Ok(Some(compared?))
}

/// The line that makes the diagnosis again; whatever was said of the data is in it.
fn command(arguments: &DiagnoseArguments, out: &Path) -> String {
    let DiagnoseArguments {
        model,
        data,
        table,
        settle,
        fitted_model,
        control,
        ..
    } = arguments;
    let mut words = vec![format!("anhyst diagnose --model {}", quoted(model))];
    words.extend(data.files().iter().map(|file| format!("--data {}", quoted(file))));
    let option = |name: &str, value: &dyn std::fmt::Display| format!("{name} {}", quoted(value.to_string().as_ref()));
    words.extend(table.columns.iter().map(|column| option("--column", column)));
    words.extend(table.rows.iter().map(|rows| option("--rows", rows)));
    words.extend(table.drop_rows.iter().map(|rows| option("--drop-rows", rows)));
    if settle.settle_s > 0.0 {
        words.push(option("--settle-s", &settle.settle_s));
    }
    if *fitted_model {
        words.push("--fitted-model".into());
    }
    words.extend(control.iter().map(|scenario| format!("--control {}", quoted(scenario))));
    words.push(format!("--out {}", quoted(out)));
    words.join(" ")
}

fn write(found: &Diagnosed, json: &str, compared: Option<&Control>, command: &str, out: &Path) -> miette::Result<()> {
    let setup = |error: DiagnosisError| RunError::Setup(error.to_string());
    let mut page = page(found, command);
    if let Some(compared) = compared {
        // Behind the answer.
        page.sections.insert(1, section(compared));
    }
    let amended = amended_text(&found.diagnosis, &found.amended).map_err(setup)?;
    let texts = [
        ("diagnosis.json", format!("{json}\n")),
        ("amended.ron", amended),
        ("report.html", page.html()),
    ];
    for (file, text) in texts {
        save(out, file, &text)?;
    }
    let experiment = found.diagnosis.experiment.as_ref();
    match experiment.filter(|experiment| experiment.drive.is_some()) {
        Some(experiment) => save(out, "experiment.ron", &experiment.scenario)?,
        // That of an earlier diagnosis is not this one's advice.
        None => {
            let path = out.join("experiment.ron");
            match std::fs::remove_file(&path) {
                Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(RunError::Write { path, cause })?,
                _ => {}
            }
        }
    }
    #[cfg(feature = "recorder")]
    crate::diagnosis_album::album(found)
        .save(&out.join("diagnosis.rrd"))
        .map_err(RunError::from)?;
    Ok(())
}

fn print(diagnosed: &Diagnosed) {
    let found = &diagnosed.diagnosis;
    crate::say!("{}: {}", found.verdict.name(), found.sentence);
    crate::say!("\n{}", table(diagnosed).terminal());
    for sentence in &found.place {
        crate::say!("where: {sentence}");
    }
    if let Some(rival) = &found.runner_up {
        crate::say!("runner-up: {}, {:.0} higher in BIC", rival.name, rival.delta_bic);
    }
    if let Some(experiment) = &found.experiment {
        crate::say!("{}", experiment.advice);
    }
}
