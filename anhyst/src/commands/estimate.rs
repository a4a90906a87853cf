//! `anhyst estimate`: parameters of a model from a measured run, by the laws of the loop, off line.

use super::unread::unread;
use super::{Ending, json, save, stem};
use crate::arguments::{JsonArgument, MeasuredFile, OutArgument, SettleArgument, TableArguments, ThreadsArgument};
use crate::estimate::{Choices, Estimated, one_parameter, picture, several_parameters};
use anhyst_estimator::LawSettings;
use anhyst_launch::error::RunError;
use anhyst_measured::MeasuredRun;
use anhyst_model::{HysteresisParameter, NominalParameter};
use anhyst_report::chart::Figure;
use anhyst_report::table::Table;
use anhyst_scenario::load_model;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// `estimate`
#[derive(Debug, Args)]
pub struct EstimateArguments {
    /// Model of the actuator (RON): an actuator, or a material alone for sweeps of magnetization or strain, or a hysteresis
    /// alone, as `fit` writes it without strain, for sweeps of magnetization.
    #[arg(long, value_name = "FILE")]
    pub model: PathBuf,
    /// A measured run.
    #[command(flatten)]
    pub data: MeasuredFile,
    /// What of it is read.
    #[command(flatten)]
    pub table: TableArguments,
    /// How it begins.
    #[command(flatten)]
    pub settle: SettleArgument,
    /// By which law; several parameters: gauss-newton.
    #[arg(long, default_value = "gauss-newton", value_parser = PossibleValuesParser::new(LawSettings::ADAPTIVE))]
    pub law: String,
    /// Which parameters, commas between.
    #[arg(long, value_name = "PARAMETER,…", value_delimiter = ',', default_value = "a", value_parser = parameter())]
    pub parameters: Vec<NominalParameter>,
    /// Range of a: `--range-a-per-m 6300..7300` (default: 10 % to either side of the model's).
    #[arg(long, value_parser = range, value_name = "FROM..TO")]
    pub range_a_per_m: Option<(f64, f64)>,
    /// First estimate of a (default: the model's).
    #[arg(long, value_name = "A_PER_M")]
    pub start_a_per_m: Option<f64>,
    /// a wanders by the root of this times the time, (A/m)²/s; 0: it is constant.
    #[arg(long, default_value_t = 0.0, value_name = "VARIANCE")]
    pub drift_variance_per_s: f64,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the models of the bank.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How estimate.json is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

fn range(text: &str) -> Result<(f64, f64), String> {
    let refuse = || format!("{text} is no range; write FROM..TO in A/m, as in 6300..7300");
    let (from, to) = text.split_once("..").ok_or_else(refuse)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| refuse());
    let (from, to) = (number(from)?, number(to)?);
    if from > 0.0 && to > from && to.is_finite() {
        Ok((from, to))
    } else {
        Err(format!(
            "{text}: the lower edge must be above 0 A/m and below the upper one"
        ))
    }
}

/// Runs the command.
///
/// # Errors
/// Bad data, a bad model, or a result that cannot be written.
pub fn run(arguments: &EstimateArguments) -> miette::Result<Ending> {
    let parameters = &arguments.parameters;
    for (at, parameter) in parameters.iter().enumerate() {
        if parameters[..at].contains(parameter) {
            return Err(miette::miette!("--parameters: {} stands twice", parameter.symbol()));
        }
    }
    let is_shape = *parameters == [NominalParameter::Hysteresis(HysteresisParameter::Shape)];
    if !is_shape && (arguments.range_a_per_m.is_some() || arguments.start_a_per_m.is_some()) {
        return Err(miette::miette!(
            "--range-a-per-m and --start-a-per-m are for a alone: leave them out, or write --parameters a"
        ));
    }
    let model = load_model(&arguments.model)?;
    let of_hysteresis = parameters
        .iter()
        .find(|own| matches!(own, NominalParameter::Hysteresis(_)));
    if let (Some(_), Some(parameter)) = (&model.material.law, of_hysteresis) {
        return Err(miette::miette!(
            help = "`anhyst fit` fits the numbers of a law; `anhyst diagnose` says where a law and a run part",
            "--parameters {}: the hysteresis of {} is a law of its own, which has no such constant",
            parameter.symbol(),
            arguments.model.display()
        ));
    }
    let reading = arguments.table.reading();
    let measured = MeasuredRun::read(arguments.data.file(), &reading).map_err(unread(
        "estimate",
        arguments.data.file(),
        &reading,
    ))?;
    let choices = Choices {
        law: arguments.law.clone(),
        range_a_per_m: arguments.range_a_per_m,
        start_a_per_m: arguments.start_a_per_m,
        drift_variance_per_s: arguments.drift_variance_per_s,
        settle_s: arguments.settle.settle_s,
        threads: arguments.threads.count(),
    };
    if !(choices.drift_variance_per_s >= 0.0 && choices.drift_variance_per_s.is_finite()) {
        let given = choices.drift_variance_per_s;
        return Err(miette::miette!(
            "--drift-variance-per-s {given} (A/m)²/s must be finite and not below 0"
        ));
    }
    // The results' folder is made before the work, so that a typing error costs nothing.
    let results = arguments
        .out
        .claim(&format!("estimate-{}", stem(arguments.data.file())))?;
    let out = &results.path;
    let bar = super::long_bar(0, "estimate", "samples");
    let found = if is_shape {
        let members = LawSettings::named(&choices.law).map_or(1, |law| law.members());
        bar.set_length((members * measured.len()) as u64);
        one_parameter(&measured, &model, &choices, |samples| bar.inc(samples))?
    } else {
        several_parameters(&measured, &model, &choices, parameters)?
    };
    bar.finish_and_clear();
    write(&found, &measured, &model.name, out)?;
    if arguments.json.json {
        crate::say!("{}", json(&found.report)?);
    } else {
        print(&found, out);
    }
    Ok(Ending::Held)
}

/// One of the parameters, by its symbol.
fn parameter() -> impl TypedValueParser<Value = NominalParameter> {
    PossibleValuesParser::new(NominalParameter::ALL.map(NominalParameter::symbol))
        .try_map(|symbol| NominalParameter::from_symbol(&symbol).ok_or("no parameter has this symbol"))
}

fn write(found: &Estimated, measured: &MeasuredRun, model: &str, out: &Path) -> Result<(), RunError> {
    save(out, "estimate.json", &(json(&found.report)? + "\n"))?;
    let figure = Figure::new(&format!("{model}: {}", found.report.law), picture(found, measured));
    let drawn = figure.svg().map_err(|error| RunError::Setup(error.to_string()))?;
    save(out, "estimate.svg", &drawn)?;
    #[cfg(feature = "recorder")]
    anhyst_recorder::Album {
        name: model.into(),
        pages: vec![anhyst_recorder::AlbumPage {
            title: "estimate".into(),
            notes: String::new(),
            charts: figure.charts,
        }],
    }
    .save(&out.join("estimate.rrd"))?;
    Ok(())
}

fn print(found: &Estimated, out: &Path) {
    let report = &found.report;
    let deviation = if report.standard_deviation_of_law {
        "standard deviation"
    } else {
        "bound on it"
    };
    let mut table = Table::new(["parameter", "value", deviation]);
    for (symbol, parameter) in &report.parameters {
        table.push([
            symbol.clone(),
            format!("{:.6e}", parameter.value),
            format!("{:.2e}", parameter.standard_deviation),
        ]);
    }
    crate::say!("{}", table.terminal());
    crate::say!(
        "\n{} from {} samples of {} ({:.0} samples/s); informed: {}",
        report.law,
        report.samples,
        report.output,
        report.samples_per_s,
        if report.informed { "yes" } else { "no" }
    );
    crate::say!(
        "residual rms {:.3e} with the model as given, {:.3e} with the estimate; noise {:.3e}",
        report.residual_rms_before,
        report.residual_rms_after,
        report.noise_rms
    );
    for note in &report.notes {
        crate::say!("note: {note}");
    }
    for warning in &report.warnings {
        crate::say!("WARNING: {warning}");
    }
    crate::say!("results: {}", out.display());
}
