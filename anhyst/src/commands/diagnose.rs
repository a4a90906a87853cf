//! `anhyst diagnose`: where model and measurement disagree, named, added to the model, and shown.

use super::Ending;
use super::summary::plain_table;
use crate::error::RunError;
use anhyst_diagnosis::diagnose::{DiagnoseOptions, Diagnosed, Diagnosis, amended_text, diagnose, report};
use anhyst_diagnosis::{ColumnMapping, DiagnosisError, MeasuredRun, RowRange, RunReadOptions};
use anhyst_model::ActuatorModel;
use clap::Args;
use ron::extensions::Extensions;
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
    let refused = |error: DiagnosisError| miette::miette!("{error}");
    let model = load_model(&arguments.model)?;
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
        .map_err(refused)?;
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
    .map_err(refused)?;
    bar.finish_and_clear();
    let json = serde_json::to_string_pretty(&found.diagnosis).map_err(|error| RunError::Setup(error.to_string()))?;
    write(&found, &json, arguments)?;
    if arguments.json {
        crate::say!("{json}");
    } else {
        print(&found.diagnosis);
        crate::say!("\nresults: {}", arguments.out.display());
    }
    Ok(Ending::Held)
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

fn write(found: &Diagnosed, json: &str, arguments: &DiagnoseArguments) -> miette::Result<()> {
    let setup = |error: DiagnosisError| RunError::Setup(error.to_string());
    let out = &arguments.out;
    let data: Vec<String> = arguments
        .data
        .iter()
        .map(|file| format!("--data {}", file.display()))
        .collect();
    let command = format!(
        "anhyst diagnose --model {} {} --out {}",
        arguments.model.display(),
        data.join(" "),
        out.display()
    );
    let page = report(found, &command).map_err(setup)?;
    let amended = amended_text(&found.diagnosis, &found.amended).map_err(setup)?;
    let texts = [
        ("diagnosis.json", format!("{json}\n")),
        ("amended.ron", amended),
        ("report.html", page),
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
