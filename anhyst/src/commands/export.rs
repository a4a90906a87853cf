//! `anhyst export RUN`: a recorded run as a measured table and an actuator model, as `anhyst diagnose` and `anhyst estimate`
//! take them. Nothing that only a simulation knows is written.

use super::{Ending, expect_recording, run_folder};
use crate::arguments::JsonArgument;
use crate::written::Format;
use anhyst_fmu::Kind;
use anhyst_ipc::{Measurement, SafeField};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::measured_table::measured_table;
use anhyst_recorder::Recording;
use anhyst_scenario::{load, to_ron};
use clap::Args;
use std::path::{Path, PathBuf};

/// `export`
#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Folder of the recorded run; with --fmu a scenario file, too.
    pub run: PathBuf,
    /// Folder of the results: run.csv (or as --format says), model.ron (default: the run's own); with --fmu the file to write (default: KIND.fmu).
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write this part of a scenario as an FMI 3.0 co-simulation unit: plant, inverse, controller or loop.
    #[arg(long, value_name = "KIND")]
    pub fmu: Option<Kind>,
    /// The library that goes into the FMU (default: the one built with this executable).
    #[arg(long, requires = "fmu", value_name = "FILE")]
    pub library: Option<PathBuf>,
    /// Format of the table: run.csv, run.parquet, run.mat or run.mcap.
    #[arg(long, value_enum, default_value_t = Format::Csv, conflicts_with = "fmu")]
    pub format: Format,
    /// How what was written is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A run without recording, a folder that cannot be written.
pub fn run(arguments: &ExportArguments) -> miette::Result<Ending> {
    if let Some(kind) = arguments.fmu {
        let usual = PathBuf::from(format!("{}.fmu", kind.name()));
        let out = arguments.out.as_ref().unwrap_or(&usual);
        let library = arguments.library.as_deref();
        let file = match arguments.run.is_dir() {
            true => RunFolder::open(&arguments.run).scenario(),
            false => arguments.run.clone(),
        };
        return super::export_fmu::run(kind, &file, library, out, arguments.json.json);
    }
    let folder = run_folder(&arguments.run)?;
    expect_recording(&folder)?;
    let scenario = load(&folder.scenario(), &[])?;
    let recording = Recording::of_parts(&folder.recordings()).map_err(RunError::from)?;
    let measured: Vec<Measurement> = recording.tokens().map_err(RunError::from)?;
    let asked: Vec<SafeField> = recording.tokens().map_err(RunError::from)?;
    let out = arguments.out.as_deref().unwrap_or(&arguments.run);
    let table = measured_table(&measured, &asked, scenario.tick_s, &scenario.units());
    let setup = |error: &dyn std::fmt::Display| RunError::Setup(error.to_string());
    let believed = scenario.believed_model().map_err(|error| setup(&error))?;
    let model = format!(
        "// What the controller's side of scenario \"{}\" believes: material, amplifier, and the rod's two poles.\n{}\n",
        scenario.name,
        to_ron(&believed).map_err(|error| setup(&error))?
    );
    let name = format!("run.{}", arguments.format.ending());
    let bytes = arguments.format.bytes(&table).map_err(RunError::Setup)?;
    save(out, &name, &bytes)?;
    save(out, "model.ron", model.as_bytes())?;
    let rows = measured.len();
    if arguments.json.json {
        let written = serde_json::json!({
            "rows": rows,
            "data": out.join(&name),
            "model": out.join("model.ron"),
        });
        crate::say!("{written:#}");
        return Ok(Ending::Held);
    }
    crate::say!("{} rows: {}", rows, out.join(&name).display());
    crate::say!(
        "what the controller's side believes: {}",
        out.join("model.ron").display()
    );
    Ok(Ending::Held)
}

fn save(out: &Path, file: &str, bytes: &[u8]) -> Result<(), RunError> {
    let path = out.join(file);
    std::fs::create_dir_all(out)
        .and_then(|()| std::fs::write(&path, bytes))
        .map_err(|cause| RunError::Write { path, cause })
}
