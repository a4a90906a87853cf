//! Arguments of the commands that run, replay and look at scenarios; those of the others stand with their command.

use anhyst_launch::across::AcrossArguments;
use anhyst_launch::external::{ExternalCommand, Nodes};
use anhyst_scenario::Setting;
use clap::Args;
use std::path::PathBuf;

/// A scenario and changes to it.
#[derive(Debug, Args)]
pub struct ScenarioArguments {
    /// Scenario file (RON).
    pub scenario: PathBuf,
    /// Change a value: `--set controller.feedback.kp=0.5` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<Setting>,
}

/// `run`
#[derive(Debug, Args)]
pub struct RunArguments {
    /// What to run.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Folder of the results (default: a new one under runs/).
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Run all nodes in this process, without iceoryx2.
    #[arg(long)]
    pub embedded: bool,
    /// Do not record.
    #[arg(long)]
    pub no_recording: bool,
    /// Also stream to a Rerun viewer, which joins at rerun+http://127.0.0.1:PORT/proxy (default port 9877; an open viewer has
    /// 9876 for itself).
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "9877", value_parser = clap::value_parser!(u16).range(1..))]
    pub live: Option<u16>,
    /// Every process has a core of its own: wait by polling, not by sleeping.
    #[arg(long)]
    pub dedicated_cores: bool,
    /// Do not start this process (a node, or `plant-sim+amplifier`): another program takes its place (repeatable).
    #[arg(long, value_name = "PROCESS")]
    pub external: Vec<Nodes>,
    /// Start this process by a command of yours, told where to meet by ANHYST_… variables: `amplifier='python3 driver.py'`
    /// (repeatable).
    #[arg(long = "external-command", value_name = "PROCESS=COMMAND")]
    pub external_commands: Vec<ExternalCommand>,
    /// Prefix of the run's iceoryx2 resources (default: one that no other run has).
    #[arg(long)]
    pub service_prefix: Option<String>,
    /// Directory of iceoryx2's files (default: one that no other run has).
    #[arg(long)]
    pub root: Option<PathBuf>,
    /// How long the processes may take to find each other, in seconds.
    #[arg(long, default_value_t = 60.0, value_parser = limit_s)]
    pub start_limit_s: f64,
    /// Start the processes in the reverse order (the result must not depend on it).
    #[arg(long, hide = true)]
    pub reverse_start: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
    /// Run only a part of the processes here, with a bridge to the host that runs the others.
    #[command(flatten)]
    pub across: AcrossArguments,
}

/// `bridge`
#[derive(Debug, Args)]
pub struct BridgeArguments {
    /// As for the processes of this host.
    #[command(flatten)]
    pub node: NodeArguments,
    /// Where the border runs.
    #[command(flatten)]
    pub across: AcrossArguments,
}

/// A limit in seconds.
fn limit_s(text: &str) -> Result<f64, String> {
    let limit_s: f64 = text.parse().map_err(|_| format!("{text} is no number"))?;
    if (0.1..=86_400.0).contains(&limit_s) {
        Ok(limit_s)
    } else {
        Err(format!("{limit_s} s is outside [0.1, 86400] s"))
    }
}

/// `check`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// What to check.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Print the effective scenario.
    #[arg(long)]
    pub print: bool,
}

/// `graph`
#[derive(Debug, Args)]
pub struct GraphArguments {
    /// Whose wiring.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
}

/// `compare`
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Scenario files; the last is the one that the others are compared with.
    #[arg(required = true)]
    pub scenarios: Vec<PathBuf>,
    /// Change a value in all of them.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<Setting>,
    /// Folder of the results, one within it for each scenario; those of an earlier comparison are replaced.
    #[arg(long, default_value = "runs/compare")]
    pub out: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// `replay`
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Folder of the recorded run.
    pub run: PathBuf,
    /// Which node; default: every node that the recording can feed.
    #[arg(long)]
    pub node: Option<String>,
    /// Print JSON instead of sentences.
    #[arg(long)]
    pub json: bool,
}

/// `view`
#[derive(Debug, Args)]
pub struct ViewArguments {
    /// Folder of the run, or a recording.
    pub run: PathBuf,
}

/// `doctor`
#[derive(Debug, Args)]
pub struct DoctorArguments {
    /// Remove what crashed runs have left.
    #[arg(long)]
    pub clean: bool,
    /// Run this scenario in real time, and a ring of the same processes whose blocks do nothing, and compare them.
    #[arg(long, value_name = "SCENARIO", conflicts_with = "clean")]
    pub realtime: Option<PathBuf>,
    /// Length of each of the two runs.
    #[arg(long, default_value_t = 60.0, requires = "realtime")]
    pub seconds: f64,
    /// Ticks per second.
    #[arg(long, default_value_t = 5000.0, requires = "realtime")]
    pub rate_hz: f64,
    /// Change a value of the scenario (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE", requires = "realtime")]
    pub settings: Vec<Setting>,
    /// Print JSON instead of sentences.
    #[arg(long)]
    pub json: bool,
}

/// A process started by hand or by the launcher.
#[derive(Debug, Args)]
pub struct NodeArguments {
    /// Scenario file; all processes of a run must be given the same.
    pub scenario: PathBuf,
    /// Change a value, the same in all processes of a run.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<Setting>,
    /// Folder of the results; the same for all processes of a run.
    #[arg(long, default_value = "runs/by-hand")]
    pub out: PathBuf,
    /// Prefix of the run's iceoryx2 resources; the same for all processes of a run.
    #[arg(long, default_value = "anhyst_hand_")]
    pub service_prefix: String,
    /// Directory of iceoryx2's files (default: /tmp/anhyst-UID/hand); the same for all processes of a run.
    #[arg(long)]
    pub root: Option<PathBuf>,
    /// Polls before a waiting process sleeps.
    #[arg(long, default_value_t = 20)]
    pub yields: u32,
    /// How long to wait for the other processes, in seconds.
    #[arg(long, default_value_t = 60.0)]
    pub start_limit_s: f64,
    /// Open a port for a Rerun viewer (recorder only).
    #[arg(long)]
    pub live: Option<u16>,
    /// Take the place of a process that died, in a real-time run that goes on.
    #[arg(long)]
    pub rejoin: bool,
    /// End when the launcher with this process number ends, and tell it on standard output what this one fails of.
    #[arg(long, hide = true, value_name = "PID")]
    pub end_with_launcher: Option<u32>,
}
