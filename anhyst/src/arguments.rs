//! What several commands say alike: one struct an idea, flattened into each of them.

use anhyst_identify::parallel;
use anhyst_ipc::{YIELDS_SHARED, number_between};
use anhyst_launch::claim::{Claimed, claimed};
use anhyst_launch::error::RunError;
use anhyst_measured::{ColumnMapping, RowRange, RunReadOptions};
use anhyst_scenario::Setting;
use clap::Args;
use std::path::{Path, PathBuf};

/// A scenario and changes to it.
#[derive(Debug, Args)]
pub struct ScenarioArguments {
    /// Scenario file (RON).
    pub scenario: PathBuf,
    /// What is changed.
    #[command(flatten)]
    pub set: SetArguments,
}

/// Changes to a scenario.
#[derive(Debug, Args)]
pub struct SetArguments {
    /// Change a value of the scenario: `--set controller.feedback.kp=0.5` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<Setting>,
}

/// Where results go.
#[derive(Debug, Args)]
pub struct OutArgument {
    /// Folder of the results (default: a new one under runs/).
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
}

impl OutArgument {
    /// The folder, made and kept from others for as long as the result lives: the one that was named, or `runs/NAME-TIME`.
    ///
    /// # Errors
    /// If it cannot be made, or somebody else writes to it.
    pub fn claim(&self, name: &str) -> Result<Claimed, RunError> {
        claimed(self.out.as_deref(), name)
    }

    /// The same, where a result of this name must not be written over what is read.
    ///
    /// # Errors
    /// As [`OutArgument::claim`], or if it would be.
    pub fn claim_beside(&self, name: &str, result: &str, read: &Path) -> Result<Claimed, RunError> {
        beside(self.out.as_deref(), result, read)?;
        self.claim(name)
    }
}

/// A result that goes into a folder under this name is another file than what is read.
///
/// # Errors
/// If it is the same.
pub fn beside(out: Option<&Path>, result: &str, read: &Path) -> Result<(), RunError> {
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    let Some(written) = out.and_then(|folder| real(&folder.join(result))) else {
        return Ok(());
    };
    if real(read) != Some(written) {
        return Ok(());
    }
    Err(RunError::Setup(format!(
        "{} is read, and the results in {} would be written over it: give --out another folder",
        read.display(),
        out.unwrap_or(Path::new("")).display()
    )))
}

/// How results are printed.
#[derive(Debug, Clone, Copy, Args)]
pub struct JsonArgument {
    /// Print JSON instead of tables and sentences.
    #[arg(long)]
    pub json: bool,
}

/// How many threads work side by side.
#[derive(Debug, Clone, Copy, Args)]
pub struct ThreadsArgument {
    /// Threads that work side by side (default: one a core).
    #[arg(long, alias = "jobs", default_value_t = 0, hide_default_value = true)]
    pub threads: usize,
}

impl ThreadsArgument {
    /// Their number.
    pub fn count(&self) -> usize {
        match self.threads {
            0 => parallel::available(),
            threads => threads,
        }
    }
}

/// A measured file.
#[derive(Debug, Args)]
pub struct MeasuredFile {
    /// Measured file: CSV, Parquet, MATLAB, HDF5, NumPy, TDMS, MDF4 or MCAP.
    #[arg(value_name = "DATA", required_unless_present = "data", conflicts_with = "data")]
    file: Option<PathBuf>,
    /// The same by name.
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
}

impl MeasuredFile {
    /// Where it is.
    pub fn file(&self) -> &Path {
        let file = self.data.as_ref().or(self.file.as_ref());
        // The command line demands one of the two.
        file.map_or(Path::new(""), PathBuf::as_path)
    }
}

/// Measured files.
#[derive(Debug, Args)]
pub struct MeasuredFiles {
    /// Measured files, which are explained together: CSV, Parquet, MATLAB, HDF5, NumPy, TDMS, MDF4 or MCAP.
    #[arg(value_name = "DATA", required_unless_present = "data")]
    files: Vec<PathBuf>,
    /// The same by name (repeatable).
    #[arg(long, value_name = "FILE")]
    data: Vec<PathBuf>,
}

impl MeasuredFiles {
    /// Where they are.
    pub fn files(&self) -> Vec<PathBuf> {
        self.data.iter().chain(&self.files).cloned().collect()
    }
}

/// What of a measured table is read.
#[derive(Debug, Args)]
pub struct TableArguments {
    /// Name a column, with what takes it to SI units: `--column 'field=H_raw*1000'` (repeatable).
    #[arg(long = "column", value_name = "QUANTITY=HEADER[*SCALE[+OFFSET]]")]
    pub columns: Vec<ColumnMapping>,
    /// Use these rows only, counted from 0 after the header, the end not in it: `--rows 200..1139`.
    #[arg(long, value_name = "FROM..TO")]
    pub rows: Option<RowRange>,
    /// Leave rows out: `--drop-rows 1139..` (repeatable).
    #[arg(long, value_name = "FROM..TO")]
    pub drop_rows: Vec<RowRange>,
}

impl TableArguments {
    /// For the reader.
    pub fn reading(&self) -> RunReadOptions {
        RunReadOptions {
            mappings: self.columns.clone(),
            rows: self.rows,
            drop_rows: self.drop_rows.clone(),
        }
    }
}

/// How the beginning of a run over time is taken.
#[derive(Debug, Clone, Copy, Args)]
pub struct SettleArgument {
    /// Simulate the first seconds and do not compare them: a start from an unknown state.
    #[arg(long, default_value_t = 0.0, value_name = "S", value_parser = number_between(0.0..=1e9, "s"))]
    pub settle_s: f64,
}

/// Where and how long the processes of a run wait for each other.
#[derive(Debug, Args)]
pub struct MeetingArguments {
    /// Prefix of the run's iceoryx2 resources (default: one that no other run has; with `node` and `bridge`: anhyst_hand_).
    #[arg(long, value_name = "PREFIX")]
    pub service_prefix: Option<String>,
    /// Directory of iceoryx2's files (default: one that no other run has; with `node` and `bridge`: /tmp/anhyst-UID/hand).
    #[arg(long, value_name = "FOLDER")]
    pub root: Option<PathBuf>,
    /// How long the processes may take to find each other.
    #[arg(long, default_value_t = 60.0, value_name = "S", value_parser = number_between(0.1..=86_400.0, "s"))]
    pub start_limit_s: f64,
}

/// A process started by hand or by the launcher.
#[derive(Debug, Args)]
pub struct ProcessArguments {
    /// Scenario file; all processes of a run must be given the same, with the same --set, --out and names.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Folder of the results; the same for all processes of a run.
    #[arg(long, default_value = "runs/by-hand", value_name = "FOLDER")]
    pub out: PathBuf,
    /// Where the others are.
    #[command(flatten)]
    pub meeting: MeetingArguments,
    /// Polls before a waiting process sleeps.
    #[arg(long, default_value_t = YIELDS_SHARED, value_name = "POLLS")]
    pub yields: u32,
    /// Open a port for a Rerun viewer (default port 9877; recorder only).
    #[cfg_attr(feature = "recorder", arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "9877", value_parser = clap::value_parser!(u16).range(1..)))]
    #[cfg_attr(not(feature = "recorder"), arg(skip))]
    pub live: Option<u16>,
    /// Take the place of a process that died, in a real-time run that goes on.
    #[arg(long)]
    pub rejoin: bool,
    /// End when the launcher with this process number ends, and tell it on standard output what this one fails of.
    #[arg(long, hide = true, value_name = "PID")]
    pub end_with_launcher: Option<u32>,
}
