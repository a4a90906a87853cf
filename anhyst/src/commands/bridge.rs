//! `anhyst bridge`: stands on this host for the processes of the other one.

use super::Ending;
use super::node::{end_with_launcher, meeting};
use crate::arguments::ProcessArguments;
use anhyst_bridge::{BridgeError, BridgeSettings, End};
use anhyst_launch::across::{AcrossArguments, BRIDGE};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::process::Meeting;
use anhyst_launch::report::{Failure, ProcessReport};
use anhyst_launch::signals;
use anhyst_scenario::{Scenario, load, wires};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// `bridge`
#[derive(Debug, Args)]
pub struct BridgeArguments {
    /// As for the processes of this host.
    #[command(flatten)]
    pub node: ProcessArguments,
    /// Where the border runs.
    #[command(flatten)]
    pub across: AcrossArguments,
}

/// Runs the command.
///
/// # Errors
/// Bad input; a link that cannot be used, or a side that fails, is an [`Ending`].
pub fn run(arguments: &BridgeArguments) -> miette::Result<Ending> {
    signals::install();
    let node = &arguments.node;
    end_with_launcher(node)?;
    if node.live.is_some() {
        miette::bail!("--live is for the recorder's process; a bridge records nothing");
    }
    arguments
        .across
        .validate()
        .map_err(|sentence| miette::miette!("{sentence}"))?;
    let scenario = load(&node.scenario.scenario, &node.scenario.set.settings)?;
    super::part::validate_clock(&scenario)?;
    let agreement = scenario
        .agreement()
        .map_err(|error| RunError::Setup(error.to_string()))?;
    let meeting = meeting(node, agreement)?;
    let settings = settings(arguments, &scenario, meeting)?;
    let ticks = settings.ticks;
    let mut words = Words {
        path: node.end_with_launcher.map(|_| RunFolder::open(&node.out).link()),
        text: String::new(),
    };
    let crossed = anhyst_bridge::run(settings, &mut |link| {
        words.say(&format!("round trip over Zenoh: {}", link.zenoh));
        words.say(&format!("plain TCP, same link:  {}", link.tcp));
        words.say(&format!(
            "medians: Zenoh takes {:.2} times as long as TCP",
            link.ratio()
        ));
    });
    let mut report = ProcessReport {
        process: BRIDGE.into(),
        ..ProcessReport::default()
    };
    let ending = match crossed {
        Ok(crossed) => {
            let (sent, received) = (crossed.sent, crossed.received);
            words.say(&format!(
                "bridge: {ticks} ticks, {sent} tokens sent, {received} received, none lost"
            ));
            Ending::Held
        }
        Err(BridgeError::Setting(sentence)) => return Err(miette::miette!("{sentence}")),
        Err(error) => {
            let failure = Failure::refused(&error);
            failure.tell(node.end_with_launcher.is_some());
            report.failure = Some(failure);
            Ending::ProcessFailed
        }
    };
    if node.end_with_launcher.is_some() {
        let path = RunFolder::open(&node.out).report(BRIDGE);
        let text = serde_json::to_string_pretty(&report).map_err(|error| RunError::Setup(error.to_string()))?;
        std::fs::write(&path, text).map_err(|cause| RunError::Write { path, cause })?;
    }
    Ok(ending)
}

fn settings(arguments: &BridgeArguments, scenario: &Scenario, meeting: Meeting) -> Result<BridgeSettings, RunError> {
    let receive_limit = Duration::from_secs_f64(scenario.clock.receive_limit_s());
    let (node, across) = (&arguments.node, &arguments.across);
    let end = match (&across.listen, &across.connect) {
        (Some(endpoint), _) => End::Listen(endpoint.clone()),
        (None, Some(endpoint)) => End::Connect(endpoint.clone()),
        (None, None) => {
            return Err(RunError::Setup(
                "a bridge needs --here and --listen or --connect".into(),
            ));
        }
    };
    Ok(BridgeSettings {
        end,
        run: across.run_name.clone(),
        prefix: meeting.prefix,
        root: meeting.root,
        died: node.end_with_launcher.map(|_| RunFolder::open(&node.out).died()),
        processes: scenario.placement.processes(),
        here: across.here.clone(),
        wires: wires(),
        agreement: meeting.agreement,
        tick_s: scenario.tick_s,
        ticks: scenario.ticks(),
        yields: meeting.yields,
        receive_limit,
        start_limit: meeting.start_limit,
        // In lockstep the loop waits for a token as long as the receive limit says.
        budget: across
            .budget_us
            .map_or(receive_limit, |budget_us| Duration::from_secs_f64(budget_us * 1e-6)),
    })
}

/// What the bridge says: to the user, and for a launcher into a file.
struct Words {
    path: Option<PathBuf>,
    text: String,
}

impl Words {
    fn say(&mut self, line: &str) {
        crate::say!("{line}");
        self.text.push_str(line);
        self.text.push('\n');
        if let Some(path) = &self.path
            && let Err(cause) = std::fs::write(path, &self.text)
        {
            crate::complain!("{} cannot be written: {cause}", path.display());
        }
    }
}
