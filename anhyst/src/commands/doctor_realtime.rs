//! `anhyst doctor --realtime SCENARIO`: the loop in real time on this machine, beside a ring of the same processes, messages
//! and wiring whose blocks do nothing. The ratio tells what is the loop's and what the machine's.

use super::{Ending, progress_bar};
use crate::arguments::SetArguments;
use anhyst_ipc::LatencySummary;
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::embedded::prepare;
use anhyst_launch::error::RunError;
use anhyst_launch::launcher::{self, Options};
use anhyst_launch::realtime::{Distribution, RealtimeSummary};
use anhyst_launch::resources::{self, Resources};
use anhyst_launch::summary::Summary;
use anhyst_report::table::Table;
use anhyst_scenario::{Clock, Realtime, Scenario, load};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where the results of the two runs go.
const RESULTS: &str = "runs/doctor";
/// How long the processes may take to find each other.
const START_LIMIT: Duration = Duration::from_secs(30);

/// One figure of a distribution.
type Quantile = fn(&LatencySummary) -> f64;

/// `doctor --realtime`
#[derive(Debug, Args)]
pub struct RealtimeArguments {
    /// Run this scenario in real time, and a ring of the same processes whose blocks do nothing, and compare them.
    #[arg(long, value_name = "SCENARIO", conflicts_with = "clean")]
    pub realtime: Option<PathBuf>,
    /// Length of each of the two runs.
    #[arg(long, default_value_t = 60.0, value_name = "S", requires = "realtime")]
    pub duration_s: f64,
    /// Ticks per second.
    #[arg(long, default_value_t = 5000.0, value_name = "HZ", requires = "realtime")]
    pub rate_hz: f64,
    /// What is changed in the scenario.
    #[command(flatten)]
    pub set: SetArguments,
}

/// The two runs.
#[derive(Debug, Serialize)]
struct Compared {
    rate_hz: f64,
    seconds: f64,
    /// The scenario's own blocks.
    real: RealtimeSummary,
    /// Blocks that answer with zeros.
    empty: RealtimeSummary,
}

/// Runs both and prints the comparison. What was missed is shown, not judged.
///
/// # Errors
/// A scenario that cannot be used at this rate, or a process that failed.
pub fn run(path: &Path, arguments: &RealtimeArguments, json: bool) -> miette::Result<Ending> {
    anhyst_launch::signals::install();
    let scenario = load(path, &arguments.set.settings)?;
    resources::sweep();
    let run_one = |empty_blocks| one(&timed(&scenario, arguments, empty_blocks)?);
    let compared = Compared {
        rate_hz: arguments.rate_hz,
        seconds: arguments.duration_s,
        real: run_one(false)?,
        empty: run_one(true)?,
    };
    if json {
        crate::say!("{}", super::json(&compared)?);
    } else {
        crate::say!("{}", compared.table());
    }
    Ok(Ending::Held)
}

/// The scenario in real time, as long and as fast as asked.
fn timed(scenario: &Scenario, arguments: &RealtimeArguments, empty_blocks: bool) -> Result<Scenario, RunError> {
    let mut timed = scenario.clone();
    timed.tick_s = 1.0 / arguments.rate_hz;
    timed.duration_s = arguments.duration_s;
    timed.recording.on = false;
    timed.clock = Clock::Realtime(Realtime {
        empty_blocks,
        ..scenario.clock.realtime().cloned().unwrap_or_default()
    });
    timed.validate()?;
    Ok(timed)
}

fn one(scenario: &Scenario) -> Result<RealtimeSummary, RunError> {
    let empty = scenario.clock.realtime().is_some_and(|realtime| realtime.empty_blocks);
    let name = if empty { "empty" } else { "loop" };
    let folder = prepare(scenario, Some(&Path::new(RESULTS).join(name)))?;
    let options = Options {
        yields: crate::arguments::YIELDS_SHARED,
        reverse_start: false,
        resources: Resources::unique(),
        start_limit: START_LIMIT,
        commands: Vec::new(),
        across: AcrossArguments::default(),
    };
    let bar = progress_bar(scenario.ticks(), name);
    let reports = launcher::launch(scenario, &folder, &options, &mut |tick| bar.set_position(tick));
    bar.finish_and_clear();
    let summary = Summary::written(scenario, &reports?, &folder)?;
    let realtime = summary.realtime;
    realtime.ok_or_else(|| RunError::Setup("no process has reported real-time figures".into()))
}

impl Compared {
    fn table(&self) -> String {
        let mut table = Table::new(["", "loop", "empty ring", "ratio"]);
        let mut row = |name: String, real: f64, empty: f64| {
            let ratio = if empty > 0.0 {
                format!("{:.2}", real / empty)
            } else {
                "-".into()
            };
            table.push([name, format!("{real:.1}"), format!("{empty:.1}"), ratio]);
        };
        let kinds = [
            (
                "measurement to coil field",
                find(self, |process| process.round.as_ref()),
            ),
            ("waking of the timer", find(self, |process| process.wake.as_ref())),
            (
                "period of the timer",
                find(self, |process| process.wake.as_ref().map(|_| &process.period)),
            ),
        ];
        for (kind, [real, empty]) in kinds {
            let quantiles: [(&str, Quantile); 4] = [
                ("p50", |summary| summary.p50_us),
                ("p99", |summary| summary.p99_us),
                ("p99.9", |summary| summary.p999_us),
                ("max", |summary| summary.max_us),
            ];
            for (name, of) in quantiles {
                row(format!("{kind}, {name}, µs"), of(&real), of(&empty));
            }
        }
        row(
            "missed deadlines".into(),
            self.real.missed as f64,
            self.empty.missed as f64,
        );
        let rows = (self.real.longest_row as f64, self.empty.longest_row as f64);
        row("longest row of misses".into(), rows.0, rows.1);
        let ticks = (self.rate_hz * self.seconds).round();
        let processes = self.real.processes.len().saturating_sub(1);
        format!(
            "{}\n{ticks} ticks of {:.1} µs; a deadline a tick in each of {processes} processes",
            table.terminal(),
            1e6 / self.rate_hz
        )
    }
}

fn find(
    compared: &Compared,
    kind: impl Fn(&anhyst_launch::realtime::RealtimeReport) -> Option<&Distribution>,
) -> [LatencySummary; 2] {
    [&compared.real, &compared.empty].map(|summary| summary.find(&kind).map(|found| found.summary).unwrap_or_default())
}
