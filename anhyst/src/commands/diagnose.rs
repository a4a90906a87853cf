//! `anhyst diagnose`: where model and measurement disagree, named, added to the model, and shown.

use super::Ending;
use crate::control::{Control, Models, control, section, ticks};
use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, Diagnosis, DiagnosisError, amended_text, diagnose, page};
use anhyst_launch::error::RunError;
use anhyst_launch::table::plain_table;
use anhyst_measured::{ColumnMapping, MeasuredError, MeasuredRun, RowRange, RunReadOptions};
use anhyst_model::ActuatorModel;
use anhyst_scenario::{Scenario, load};
use clap::Args;
use ron::extensions::Extensions;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// `diagnose`
#[derive(Debug, Args)]
pub struct DiagnoseArguments {
    /// Actuator model (RON), as scenarios/models/nominal.ron.
    #[arg(long)]
    pub model: PathBuf,
    /// Measured run (CSV or Parquet); several are explained together.
    #[arg(long, required = true)]
    pub data: Vec<PathBuf>,
    /// Folder of the results: diagnosis.json, amended.ron, report.html, diagnosis.rrd.
    #[arg(long)]
    pub out: PathBuf,
    /// Name a column: `--column displacement=disp_um*1e-6`
    #[arg(long = "column", value_name = "QUANTITY=HEADER[*SCALE]")]
    pub columns: Vec<ColumnMapping>,
    /// Only these rows, counted from 0 after the header: `--rows 200..1139`
    #[arg(long, value_name = "FROM..TO")]
    pub rows: Option<RowRange>,
    /// The model's numbers were fitted to measurements: zeros are free, and parameters may have to be calibrated.
    #[arg(long)]
    pub fitted_model: bool,
    /// Simulate the first seconds and do not compare them: a start from an unknown state.
    #[arg(long, default_value_t = 0.0, value_name = "SECONDS")]
    pub settle: f64,
    /// Make the cut of this scenario on a plant that has what was found: with the old model, the amended one, and the runner-up.
    #[arg(long, value_name = "SCENARIO.ron")]
    pub control: Option<PathBuf>,
    /// Threads (default: one a core).
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Print the diagnosis as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad data, a bad model, or a result that cannot be written.
pub fn run(arguments: &DiagnoseArguments) -> miette::Result<Ending> {
    let model = load_model(&arguments.model)?;
    // Before the minutes that the search takes: a scenario with a mistake in it is told now.
    let cut = arguments.control.as_ref().map(|file| load(file, &[])).transpose()?;
    let reading = RunReadOptions {
        mappings: arguments.columns.clone(),
        rows: arguments.rows,
        drop_rows: Vec::new(),
    };
    let runs = arguments
        .data
        .iter()
        .map(|file| MeasuredRun::read(file, &reading))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|error: MeasuredError| miette::miette!("{error}"))?;
    let options = DiagnoseOptions {
        threads: arguments.threads,
        fitted_model: arguments.fitted_model,
        settle_s: arguments.settle,
    };
    let bar = super::progress_bar(100, "diagnose");
    let found = diagnose(&model, &runs, &options, &mut |stage, share| {
        bar.set_prefix(stage);
        bar.set_position((100.0 * share) as u64);
    })
    .map_err(|error: DiagnosisError| miette::miette!("{error}"))?;
    bar.finish_and_clear();
    let compared = match &cut {
        Some(scenario) => in_the_loop(scenario, &model, &found, arguments)?,
        None => None,
    };
    let written = Written {
        diagnosis: &found.diagnosis,
        control: compared.as_ref(),
    };
    let json = serde_json::to_string_pretty(&written).map_err(|error| RunError::Setup(error.to_string()))?;
    write(&found, &json, compared.as_ref(), arguments)?;
    if arguments.json {
        crate::say!("{json}");
        return Ok(Ending::Held);
    }
    print(&found.diagnosis);
    if let Some(compared) = &compared {
        crate::say!("\n{}", compared.table());
        compared
            .sentences()
            .iter()
            .for_each(|sentence| crate::say!("{sentence}"));
    } else if arguments.control.is_some() {
        crate::say!("\nNothing was named, so there is no other model to make the cut with.");
    }
    crate::say!("\nresults: {}", arguments.out.display());
    Ok(Ending::Held)
}

/// `diagnosis.json`.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    #[serde(skip_serializing_if = "Option::is_none")]
    control: Option<&'a Control>,
}

/// The cut with every model; nothing where nothing was named.
fn in_the_loop(
    scenario: &Scenario,
    old: &ActuatorModel,
    found: &Diagnosed,
    arguments: &DiagnoseArguments,
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
    let compared = control(scenario, models, &arguments.out.join("control"), &|done| bar.inc(done));
    bar.finish_and_clear();
    Ok(Some(compared?))
}

/// Reads and checks a model file.
pub fn load_model(file: &Path) -> miette::Result<ActuatorModel> {
    let text =
        std::fs::read_to_string(file).map_err(|cause| miette::miette!("{} cannot be read: {cause}", file.display()))?;
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let model: ActuatorModel = options
        .from_str(&text)
        .map_err(|error| miette::miette!("{}: {error}", file.display()))?;
    model
        .validate()
        .map_err(|error| miette::miette!("{}: {error}", file.display()))?;
    Ok(model)
}

fn write(
    found: &Diagnosed,
    json: &str,
    compared: Option<&Control>,
    arguments: &DiagnoseArguments,
) -> miette::Result<()> {
    let setup = |error: DiagnosisError| RunError::Setup(error.to_string());
    let out = &arguments.out;
    let data: Vec<String> = arguments
        .data
        .iter()
        .map(|file| format!("--data {}", file.display()))
        .collect();
    let mut command = format!(
        "anhyst diagnose --model {} {} --out {}",
        arguments.model.display(),
        data.join(" "),
        out.display()
    );
    if let Some(scenario) = &arguments.control {
        command += &format!(" --control {}", scenario.display());
    }
    let mut page = page(found, &command).map_err(setup)?;
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
        let path = out.join(file);
        std::fs::create_dir_all(out)
            .and_then(|()| std::fs::write(&path, text))
            .map_err(|cause| RunError::Write { path, cause })?;
    }
    if let Some(experiment) = &found.diagnosis.experiment
        && experiment.drive.is_some()
    {
        let path = out.join("experiment.ron");
        std::fs::write(&path, &experiment.scenario).map_err(|cause| RunError::Write { path, cause })?;
    }
    #[cfg(feature = "recorder")]
    crate::diagnosis_album::album(found)
        .save(&out.join("diagnosis.rrd"))
        .map_err(RunError::from)?;
    Ok(())
}

fn print(found: &Diagnosis) {
    crate::say!("{}: {}", found.verdict.name(), found.sentence);
    if !found.effects.is_empty() {
        let mut table = plain_table();
        table.set_header(["effect", "number", "value", "standard deviation", "unit"]);
        for effect in found.effects.iter().chain(&found.calibrated) {
            for value in &effect.values {
                let deviation = value
                    .standard_deviation
                    .map_or_else(|| "not fixed".to_owned(), |deviation| format!("{deviation:.2e}"));
                let own = format!("{:.6e}", value.value);
                table.add_row([
                    effect.name.clone(),
                    value.name.clone(),
                    own,
                    deviation,
                    value.unit.clone(),
                ]);
            }
        }
        crate::say!("\n{table}");
    }
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
