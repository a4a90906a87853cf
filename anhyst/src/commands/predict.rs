//! `anhyst predict`: a free run of any model along any measured file, and how far it is from what was measured.

use super::unread::unread;
use super::{Ending, json, save, stem};
use crate::arguments::{JsonArgument, MeasuredFile, OutArgument, TableArguments};
use crate::law_picture;
use anhyst_identify::laws::{Distance, LawData, LawError, LawFile, Prediction, predict};
use anhyst_identify::prepared::{PrepareOptions, PreparedRun, simulated};
use anhyst_launch::error::RunError;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::ActuatorOutputs;
use anhyst_report::table::Table;
use anhyst_scenario::{load_model, load_with};
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// `predict`
#[derive(Debug, Args)]
pub struct PredictArguments {
    /// What runs (RON): a law as `fit --law` writes it, an actuator, a material, or a hysteresis alone.
    #[arg(long, value_name = "FILE")]
    pub model: PathBuf,
    /// Along what: a run over time, a sweep, or several loops.
    #[command(flatten)]
    pub data: MeasuredFile,
    /// What of it is read.
    #[command(flatten)]
    pub table: TableArguments,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// How predict.json is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// `predict.json`
#[derive(Debug, Serialize)]
struct PredictReport {
    model: String,
    data: String,
    /// What was compared.
    output: &'static str,
    /// Of rms, rms_after_mean, max and range.
    unit: &'static str,
    #[serde(flatten)]
    error: Distance,
    /// rms over range.
    nrmse: f64,
    records: Vec<RecordReport>,
}

#[derive(Debug, Serialize)]
struct RecordReport {
    record: String,
    #[serde(flatten)]
    error: Distance,
}

/// Runs the command.
///
/// # Errors
/// Bad data, a bad model, a model that has not the file's input or output, or a result that cannot be written.
pub fn run(arguments: &PredictArguments) -> miette::Result<Ending> {
    let law: Option<LawFile> = load_with(&arguments.model, "input_extent")?;
    let reading = arguments.table.reading();
    let runs = MeasuredRun::read_records(arguments.data.file(), &reading).map_err(unread(
        "predict",
        arguments.data.file(),
        &reading,
    ))?;
    let (data, prediction) = match &law {
        Some(law) => of_law(law, &runs)?,
        None => of_actuator(&arguments.model, &runs)?,
    };
    let results = arguments
        .out
        .claim(&format!("predict-{}", stem(arguments.data.file())))?;
    let report = PredictReport {
        model: arguments.model.display().to_string(),
        data: arguments.data.file().display().to_string(),
        output: data.output.key(),
        unit: data.output.unit(),
        error: prediction.error,
        nrmse: prediction.error.rms / prediction.error.range,
        records: (data.records.iter().zip(&prediction.records))
            .map(|(record, error)| RecordReport {
                record: record.id.clone(),
                error: *error,
            })
            .collect(),
    };
    write(&report, &data, &prediction, &results.path)?;
    if arguments.json.json {
        crate::say!("{}", json(&report)?);
    } else {
        print(&report);
        crate::say!("\nresults: {}", results.path.display());
    }
    Ok(Ending::Held)
}

fn of_law(law: &LawFile, runs: &[MeasuredRun]) -> miette::Result<(LawData, Prediction)> {
    law.validate().map_err(|error| miette::miette!("{error}"))?;
    let refused = |error: LawError| miette::miette!("{error}");
    let data = LawData::of(runs, Some(law.input), Some(law.output)).map_err(refused)?;
    let prediction = predict(law, &data);
    Ok((data, prediction))
}

/// Every record from its own start, as `fit` and `estimate` begin theirs.
fn of_actuator(file: &Path, runs: &[MeasuredRun]) -> miette::Result<(LawData, Prediction)> {
    let model = load_model(file)?;
    let mut modelled = Vec::new();
    let mut output = Quantity::Magnetization;
    for run in runs {
        let prepared = PreparedRun::of(run, &PrepareOptions::default()).map_err(|error| miette::miette!("{error}"))?;
        let channel = prepared.output(&model).map_err(|error| miette::miette!("{error}"))?;
        let mut outputs = ActuatorOutputs::default();
        prepared
            .simulate(&model, &mut outputs)
            .map_err(|error| miette::miette!("{error}"))?;
        output = channel.quantity;
        modelled.push(
            simulated(&model, &outputs, output)
                .map(<[f64]>::to_vec)
                .unwrap_or_default(),
        );
    }
    let data = LawData::of(runs, None, Some(output)).map_err(|error| miette::miette!("{error}"))?;
    let prediction = Prediction::new(modelled, &data);
    Ok((data, prediction))
}

fn write(report: &PredictReport, data: &LawData, prediction: &Prediction, out: &Path) -> Result<(), RunError> {
    let title = format!(
        "free run: {:.3e} {} rms, {:.3} % of the range",
        report.error.rms,
        report.unit,
        100.0 * report.nrmse
    );
    let drawing =
        law_picture::picture(&title, data, &prediction.modelled).map_err(|error| RunError::Setup(error.to_string()))?;
    let mut table = format!(
        "loop_id,time_s,{},measured_{},modelled_{}\n",
        data.input.header(),
        data.output.header(),
        data.output.header()
    );
    for (record, modelled) in data.records.iter().zip(&prediction.modelled) {
        for (sample, made) in modelled.iter().enumerate() {
            let time_s = record
                .time_s
                .as_ref()
                .map_or_else(String::new, |time_s| time_s[sample].to_string());
            let (input, output) = (record.input[sample], record.output[sample]);
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{},{time_s},{input},{output},{made}", record.id);
        }
    }
    save(out, "predict.json", &(json(report)? + "\n"))?;
    save(out, "predict.csv", &table)?;
    save(out, "predict.svg", &drawing)
}

fn print(report: &PredictReport) {
    let mut table = Table::new(["record", "rms", "rms after mean", "largest", "range", "unit"]);
    let mut row = |name: &str, error: &Distance| {
        let number = |value: f64| format!("{value:.4e}");
        table.push([
            name.to_owned(),
            number(error.rms),
            number(error.rms_after_mean),
            number(error.max),
            number(error.range),
            report.unit.to_owned(),
        ]);
    };
    for record in report.records.iter().filter(|_| report.records.len() > 1) {
        row(&record.record, &record.error);
    }
    row("all", &report.error);
    crate::say!("{}", table.terminal());
    crate::say!("\n{}: {:.3} % of the range rms", report.output, 100.0 * report.nrmse);
}
