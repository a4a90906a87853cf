//! What `anhyst run` is told.

use crate::arguments::{JsonArgument, MeetingArguments, OutArgument, SetArguments, ThreadsArgument};
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::external::{ExternalCommand, Nodes};
use clap::Args;
use std::path::PathBuf;

/// `run`
#[derive(Debug, Args)]
pub struct RunArguments {
    /// Scenario file (RON). Several are run embedded and unrecorded, side by side, and compared with the last one.
    #[arg(required = true, value_name = "SCENARIO")]
    pub scenarios: Vec<PathBuf>,
    /// What is changed in them.
    #[command(flatten)]
    pub set: SetArguments,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// Run all nodes in this process, without iceoryx2.
    #[arg(long)]
    pub embedded: bool,
    /// Do not record.
    #[arg(long)]
    pub no_recording: bool,
    /// Draw the charts of its page as one picture, .svg.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    pub plot: Option<PathBuf>,
    /// What several scenarios leave no room for.
    #[command(flatten)]
    pub alone: AloneArguments,
    /// For several scenarios.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How the summary is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.extension().is_some_and(|ending| ending == "svg") {
        Ok(path)
    } else {
        Err("a picture ends in .svg; the page to zoom into is report.html of the run's folder".into())
    }
}

/// What is said of the processes of one run.
#[derive(Debug, Args)]
pub struct AloneArguments {
    /// Also stream to a Rerun viewer, which joins at rerun+http://127.0.0.1:PORT/proxy (default port 9877; an open viewer has
    /// 9876 for itself).
    #[cfg_attr(feature = "recorder", arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "9877", value_parser = clap::value_parser!(u16).range(1..)))]
    #[cfg_attr(not(feature = "recorder"), arg(skip))]
    pub live: Option<u16>,
    /// Every process has a core of its own: wait by polling, not by sleeping.
    #[arg(long)]
    pub dedicated_cores: bool,
    /// Print the latencies of all links, too; `summary.json` always has them.
    #[arg(long)]
    pub latencies: bool,
    /// Do not start this process (a node, or `plant-sim+amplifier`): another program takes its place (repeatable).
    #[arg(long, value_name = "PROCESS")]
    pub external: Vec<Nodes>,
    /// Start this process by a command of yours, told where to meet by ANHYST_… variables: `amplifier='python3 driver.py'`
    /// (repeatable).
    #[arg(long = "external-command", value_name = "PROCESS=COMMAND")]
    pub external_commands: Vec<ExternalCommand>,
    /// Where the processes meet.
    #[command(flatten)]
    pub meeting: MeetingArguments,
    /// Start the processes in the reverse order (the result must not depend on it).
    #[arg(long, hide = true)]
    pub reverse_start: bool,
    /// Run only a part of the processes here, with a bridge to the host that runs the others.
    #[cfg_attr(feature = "bridge", command(flatten))]
    #[cfg_attr(not(feature = "bridge"), arg(skip))]
    pub across: AcrossArguments,
}

impl AloneArguments {
    /// The first option that was given, by its name.
    pub(super) fn given(&self) -> Option<&'static str> {
        let given = [
            ("--live", self.live.is_some()),
            ("--dedicated-cores", self.dedicated_cores),
            ("--external", !self.external.is_empty()),
            ("--external-command", !self.external_commands.is_empty()),
            ("--service-prefix", self.meeting.service_prefix.is_some()),
            ("--root", self.meeting.root.is_some()),
            ("--reverse-start", self.reverse_start),
            ("--here", self.across.is_part()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }
}
