//! `anhyst run`: a scenario from start to verdict; several are compared.

use super::{Ending, progress_bar};
use crate::arguments::{JsonArgument, MeetingArguments, OutArgument, SetArguments, ThreadsArgument};
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::external::{ExternalCommand, Nodes};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::report::ProcessReport;
use anhyst_launch::say::quoted;
use anhyst_launch::summary::Summary;
use anhyst_launch::{launcher, resources, signals};
use anhyst_scenario::{Placement, Scenario, load_changed};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;

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
    fn given(&self) -> Option<&'static str> {
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

/// Polls before a waiting process sleeps, on a machine with fewer cores than processes.
pub const YIELDS_SHARED: u32 = 20;
/// The same with a core for each.
const YIELDS_DEDICATED: u32 = 1000;

/// Runs the command.
///
/// # Errors
/// Bad input; a process that fails is an [`Ending`].
pub fn run(arguments: &RunArguments) -> miette::Result<Ending> {
    signals::install();
    match (&arguments.scenarios[..], arguments.alone.given()) {
        ([scenario], _) => alone(scenario, arguments),
        (several, Some(option)) => Err(miette::miette!(
            "{option} is for one scenario; {} are run embedded, in this process",
            several.len()
        )),
        (several, None) => super::several::run(several, arguments),
    }
}

fn alone(scenario: &Path, all: &RunArguments) -> miette::Result<Ending> {
    let arguments = &all.alone;
    // What the command line says is checked with the rest: a fault may not suit it.
    let mut scenario = load_changed(scenario, &all.set.settings, |scenario| {
        if all.embedded {
            scenario.placement = Placement::Embedded;
        }
        add_external(scenario, arguments);
    })?;
    super::part::validate(all, &scenario)?;
    refuse_two_commands(arguments)?;
    if all.no_recording {
        scenario.recording.on = false;
    }
    if arguments.live.is_some() {
        scenario.recording.live_port = arguments.live;
    }
    if let Some(port) = scenario.recording.live_port.filter(|_| scenario.recording.on) {
        crate::complain!("watch: rerun rerun+http://127.0.0.1:{port}/proxy");
    }
    let meeting = resources::Resources::chosen(
        arguments.meeting.service_prefix.as_deref(),
        arguments.meeting.root.as_deref(),
    )
    .map_err(|sentence| miette::miette!("{sentence}"))?;
    // An embedded run has nothing there to keep.
    let claims = (scenario.placement != Placement::Embedded).then(|| meeting.claim());
    let _claimed = claims.transpose().map_err(|sentence| miette::miette!("{sentence}"))?;
    let folder = prepare(&scenario, all.out.out.as_deref())?;
    let yields = if arguments.dedicated_cores {
        YIELDS_DEDICATED
    } else {
        YIELDS_SHARED
    };
    let bar = progress_bar(scenario.ticks(), &scenario.name);
    let outcome = if scenario.placement == Placement::Embedded {
        embedded(&scenario, &folder, &mut |tick| bar.set_position(tick))
    } else {
        resources::sweep();
        let options = launcher::Options {
            yields,
            reverse_start: arguments.reverse_start,
            resources: meeting,
            start_limit: Duration::from_secs_f64(arguments.meeting.start_limit_s),
            commands: arguments.external_commands.clone(),
            across: arguments.across.clone(),
        };
        launcher::launch(&scenario, &folder, &options, &mut |tick| bar.set_position(tick)).map_err(RunError::from)
    };
    bar.finish_and_clear();
    match outcome {
        Ok(reports) if arguments.across.is_part() => super::part::finish(&scenario, &folder, &reports, all.json.json),
        Ok(reports) => finish(&scenario, &folder, &reports, all.json),
        Err(error) => {
            crate::complain!("{error}");
            crate::complain!("what was recorded until then is in {}", folder.path().display());
            Ok(Ending::ProcessFailed)
        }
    }
}

/// # Errors
/// If a node would be started by two commands.
fn refuse_two_commands(arguments: &AloneArguments) -> miette::Result<()> {
    let mut known = Vec::new();
    for node in arguments.external_commands.iter().flat_map(|command| &command.nodes) {
        if known.contains(&node) {
            miette::bail!("{node} has two --external-command; it can have one");
        }
        known.push(node);
    }
    Ok(())
}

/// Works `--external` and `--external-command` into the scenario.
fn add_external(scenario: &mut Scenario, arguments: &AloneArguments) {
    let named = arguments.external.iter().flat_map(|nodes| &nodes.0);
    let commanded = arguments.external_commands.iter().flat_map(|command| &command.nodes);
    for node in named.chain(commanded) {
        if !scenario.external.contains(node) {
            scenario.external.push(*node);
        }
    }
}

fn finish(
    scenario: &Scenario,
    folder: &RunFolder,
    reports: &[ProcessReport],
    json: JsonArgument,
) -> miette::Result<Ending> {
    let summary = Summary::new(scenario, reports);
    summary.write(folder).map_err(|cause| RunError::Write {
        path: folder.summary(),
        cause,
    })?;
    if json.json {
        let told = summary
            .for_programs()
            .map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{}", super::json(&told)?);
    } else {
        crate::say!("{}", summary.table());
        if summary.held {
            let (settling_s, tolerance_um) = (scenario.expect.settling_s, scenario.expect.tolerance_m * 1e6);
            crate::say!("\nheld: every error after {settling_s} s is within ±{tolerance_um:.4} µm");
        } else {
            crate::say!("\nNOT held: {}", summary.failures.join("; "));
        }
        crate::say!("results: {}", folder.path().display());
        if scenario.recording.on {
            crate::say!("look at it: anhyst view {}", quoted(folder.path()));
        }
    }
    Ok(if summary.held { Ending::Held } else { Ending::NotHeld })
}
