//! `anhyst estimate`: parameters of a model from a measured run, by the laws of the loop, off line.

use super::Ending;
use crate::estimate::{Choices, Estimated, one_parameter, picture, several_parameters};
use anhyst_estimator::LawSettings;
use anhyst_launch::error::RunError;
use anhyst_launch::table::plain_table;
use anhyst_measured::{ColumnMapping, MeasuredError, MeasuredRun, RowRange, RunReadOptions};
use anhyst_model::{HysteresisParameter, NominalParameter};
use anhyst_report::figure::svg;
use anhyst_scenario::load_model;
use clap::Args;
use comfy_table::CellAlignment;
use std::path::{Path, PathBuf};

/// `estimate`
#[derive(Debug, Args)]
pub struct EstimateArguments {
    /// Model of the actuator (RON): an actuator, or a material alone for sweeps of magnetization or strain.
    #[arg(long)]
    pub model: PathBuf,
    /// Measured run (CSV with a header, or Parquet).
    #[arg(long)]
    pub data: PathBuf,
    /// Folder of the results: estimate.json, estimate.svg, estimate.rrd.
    #[arg(long)]
    pub out: PathBuf,
    /// folded, gauss-newton, matrix, scalar or gradient; several parameters: gauss-newton.
    #[arg(long, default_value = "gauss-newton")]
    pub law: String,
    /// Which parameters, of Ms, a, k, alpha, c, and w, damping, stiffness of a rod.
    #[arg(long, value_delimiter = ',', default_value = "a")]
    pub parameters: Vec<String>,
    /// Range of a, A/m: `--range 6300..7300` (default: 10 % to either side of the model's).
    #[arg(long, value_parser = range, value_name = "FROM..TO")]
    pub range: Option<(f64, f64)>,
    /// First estimate of a, A/m (default: the model's).
    #[arg(long)]
    pub start: Option<f64>,
    /// a wanders by the root of this times the time, (A/m)²/s; 0: it is constant.
    #[arg(long, default_value_t = 0.0)]
    pub drift_variance: f64,
    /// Name a column: `--column displacement=probe*1e-6`.
    #[arg(long = "column", value_name = "QUANTITY=HEADER[*SCALE]")]
    pub columns: Vec<ColumnMapping>,
    /// Use these rows only, counted from 0 after the header: `--rows 0..570`.
    #[arg(long, value_name = "FROM..TO")]
    pub rows: Option<RowRange>,
    /// Leave rows out.
    #[arg(long, value_name = "FROM..TO")]
    pub drop_rows: Vec<RowRange>,
    /// Print estimate.json instead of a table.
    #[arg(long)]
    pub json: bool,
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
    let parameters = parameters(&arguments.parameters)?;
    let model = load_model(&arguments.model)?;
    let reading = RunReadOptions {
        mappings: arguments.columns.clone(),
        rows: arguments.rows,
        drop_rows: arguments.drop_rows.clone(),
    };
    let refused = |error: MeasuredError| miette::miette!("{error}");
    let measured = MeasuredRun::read(&arguments.data, &reading).map_err(refused)?;
    let choices = Choices {
        law: arguments.law.clone(),
        range_a_per_m: arguments.range,
        start_a_per_m: arguments.start,
        drift_variance_per_s: arguments.drift_variance,
    };
    if !(choices.drift_variance_per_s >= 0.0 && choices.drift_variance_per_s.is_finite()) {
        let given = choices.drift_variance_per_s;
        return Err(miette::miette!(
            "--drift-variance {given} (A/m)²/s must be finite and not below 0"
        ));
    }
    // The results' folder is made before the work, so that a typing error costs nothing.
    make_folder(&arguments.out)?;
    let bar = super::progress_bar(0, "estimate");
    let found = if parameters == [NominalParameter::Hysteresis(HysteresisParameter::Shape)] {
        let members = LawSettings::named(&choices.law).map_or(1, |law| law.members());
        bar.set_length((members * measured.len()) as u64);
        one_parameter(&measured, &model, &choices, |samples| bar.inc(samples))?
    } else {
        several_parameters(&measured, &model, &choices, &parameters)?
    };
    bar.finish_and_clear();
    write(&found, &measured, &model.name, &arguments.out)?;
    if arguments.json {
        crate::say!("{}", json(&found)?);
    } else {
        print(&found, &arguments.out);
    }
    Ok(Ending::Held)
}

fn parameters(names: &[String]) -> miette::Result<Vec<NominalParameter>> {
    let mut parameters = Vec::new();
    for name in names {
        let parameter = NominalParameter::from_symbol(name).ok_or_else(|| {
            let known = NominalParameter::ALL.map(NominalParameter::symbol).join(", ");
            miette::miette!("--parameters {name}: there is no such parameter; there are {known}")
        })?;
        if parameters.contains(&parameter) {
            return Err(miette::miette!("--parameters: {name} stands twice"));
        }
        parameters.push(parameter);
    }
    Ok(parameters)
}

fn make_folder(out: &Path) -> Result<(), RunError> {
    std::fs::create_dir_all(out).map_err(|cause| RunError::Write {
        path: out.to_owned(),
        cause,
    })
}

fn json(found: &Estimated) -> Result<String, RunError> {
    serde_json::to_string_pretty(&found.report).map_err(|error| RunError::Setup(error.to_string()))
}

fn write(found: &Estimated, measured: &MeasuredRun, model: &str, out: &Path) -> Result<(), RunError> {
    let save = |file: &str, text: String| {
        let path = out.join(file);
        std::fs::write(&path, text).map_err(|cause| RunError::Write { path, cause })
    };
    save("estimate.json", json(found)? + "\n")?;
    let panels = picture(found, measured);
    let drawn = svg(&format!("{model}: {}", found.report.law), &panels);
    save(
        "estimate.svg",
        drawn.map_err(|error| RunError::Setup(error.to_string()))?,
    )?;
    #[cfg(feature = "recorder")]
    anhyst_recorder::Album {
        name: model.into(),
        pages: vec![anhyst_report::album::album_page("estimate", "", &panels)],
    }
    .save(&out.join("estimate.rrd"))?;
    Ok(())
}

fn print(found: &Estimated, out: &Path) {
    let report = &found.report;
    let mut table = plain_table();
    let deviation = if report.sd_of_law {
        "standard deviation"
    } else {
        "bound on it"
    };
    table.set_header(["parameter", "value", deviation]);
    for (symbol, parameter) in &report.parameters {
        table.add_row([
            symbol.clone(),
            format!("{:.6e}", parameter.value),
            format!("{:.2e}", parameter.sd),
        ]);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    crate::say!("{table}");
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
