//! `anhyst doctor --realtime SCENARIO`: which way to wait and which placement miss least on this machine, what each costs, and
//! the highest rate at which the loop is late in less than a thousandth of its ticks.
//!
//! First the transport alone, at one rate: a ring of the scenario's processes, messages and wiring whose blocks answer with
//! zeros, once for each way. Then the scenario's own blocks, the best way, at rates found by halving a ladder.

use super::doctor_arguments::DoctorArguments;
use super::least::refuse_short;
use super::{Ending, progress_bar};
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::embedded::{embedded, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::launcher::{self, Options, Waits};
use anhyst_launch::realtime::RealtimeSummary;
use anhyst_launch::resources::{self, Resources};
use anhyst_launch::summary::Summary;
use anhyst_report::table::Table;
use anhyst_scenario::{Placement, Scenario, Setting, load};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// How long the processes may take to find each other.
const START_LIMIT: Duration = Duration::from_secs(30);
/// Share of a run's ticks that may be late.
const MAX_LATE: f64 = 1e-3;
/// Rates that are tried, Hz.
const LADDER_HZ: [f64; 11] = [
    250.0, 500.0, 1000.0, 1500.0, 2000.0, 3000.0, 4000.0, 5000.0, 7000.0, 10_000.0, 20_000.0,
];
pub(super) const SEPARATE: &str = "placement=Separate";
/// What a rig's computer has to do shares a process; amplifier and plant are somebody else's there.
pub(super) const GROUPED: &str = "placement=Groups([[estimator, controller, inverse, guard]])";
/// No link but the recorder's: what is late here is the machine's own doing. No rig can be placed so.
const ALL: &str = "placement=Groups([[plant, estimator, controller, inverse, guard, amplifier]])";

/// A way to wait and to place, as changes of the scenario.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Way {
    wait: &'static str,
    placement: &'static str,
    priority: Option<u8>,
    cpus: Vec<usize>,
    /// A rig can be run so.
    for_rigs: bool,
    settings: Vec<String>,
}

/// What a run of it came to.
#[derive(Debug, Serialize)]
struct Measured {
    way: Way,
    rate_hz: f64,
    ticks: u64,
    /// Ticks that the process missed that missed most, of all.
    late_share: f64,
    longest_row: u64,
    round_p50_us: f64,
    round_p99_us: f64,
    wake_p99_us: f64,
    /// CPUs' time over the run's, all processes but the recorder.
    cpus_used: f64,
    /// What the system did not give.
    refused: Vec<String>,
}

/// What the command prints.
#[derive(Debug, Serialize)]
struct Findings {
    cpus: usize,
    isolated_cpus: Vec<usize>,
    seconds: f64,
    max_late_share: f64,
    /// Of blocks that do nothing, at one rate.
    ways: Vec<Measured>,
    /// Of the scenario's own, the best way.
    rates: Vec<Measured>,
    /// Highest rate with less than `max_late_share` late; null: none.
    highest_rate_hz: Option<f64>,
    /// Changes that make the scenario so.
    settings: Vec<String>,
}

/// Measures and prints. What was missed is shown, not judged.
///
/// # Errors
/// A scenario that cannot be used at this rate, or a process that failed.
pub fn run(path: &Path, arguments: &DoctorArguments) -> miette::Result<Ending> {
    let (settings, duration_s, rate_hz) = (&arguments.set.settings, arguments.duration_s, arguments.rate_hz);
    anhyst_launch::signals::install();
    resources::sweep();
    let cpus = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let isolated_cpus = isolated_cpus();
    let mut doctor = Doctor::new(path, arguments)?;
    let ways = ways(cpus, &isolated_cpus);
    refuse_short(duration_s, load(path, settings)?.duration_s, |duration_s| {
        let lasting = Doctor {
            duration_s,
            ..doctor.clone()
        };
        lasting.scenario(&ways[0], rate_hz, true)
    })?;
    let count = ways.len();
    let mut measured = Vec::new();
    for (index, way) in ways.into_iter().enumerate() {
        let name = format!("way {} of {count}", index + 1);
        measured.push(doctor.measure(way, rate_hz, true, &name)?);
    }
    let best = best(&measured)
        .ok_or_else(|| miette::miette!("no way was measured"))?
        .way
        .clone();
    let (rates, highest_rate_hz) = doctor.search(&best)?;
    let tick = highest_rate_hz.map(|rate_hz| format!("tick_s={:e}", 1.0 / rate_hz));
    let findings = Findings {
        cpus,
        isolated_cpus,
        seconds: duration_s,
        max_late_share: MAX_LATE,
        ways: measured,
        rates,
        highest_rate_hz,
        settings: best.settings.into_iter().chain(tick).collect(),
    };
    if arguments.json.json {
        crate::say!("{}", super::json(&findings)?);
    } else {
        crate::say!("{}", findings.text());
    }
    Ok(Ending::Held)
}

/// Every wait with every placement, and two more that change one thing. Whoever polls at a real-time priority leaves its CPU to
/// nobody: that is asked for only where one is left over.
fn ways(cpus: usize, isolated_cpus: &[usize]) -> Vec<Way> {
    let way = |busy: bool, placement: &'static str, priority: bool, cpus: Vec<usize>| {
        let priority = priority.then_some(20);
        Way {
            wait: if busy { "busy" } else { "sleeping" },
            placement: match placement {
                SEPARATE => "separate",
                GROUPED => "grouped",
                _ => "all in one",
            },
            priority,
            for_rigs: placement != ALL,
            settings: vec![
                placement.into(),
                format!("clock.busy_wait={busy}"),
                format!("clock.priority={priority:?}"),
                format!("clock.cpus={cpus:?}"),
            ],
            cpus,
        }
    };
    let mut ways = Vec::new();
    for (placement, processes) in [(SEPARATE, 6), (GROUPED, 3), (ALL, 1)] {
        ways.push(way(false, placement, true, Vec::new()));
        ways.push(way(true, placement, processes < cpus, Vec::new()));
    }
    ways.push(way(false, GROUPED, false, Vec::new()));
    let own = if isolated_cpus.is_empty() {
        vec![cpus - 1]
    } else {
        isolated_cpus.to_vec()
    };
    ways.push(way(false, GROUPED, true, own.clone()));
    ways.push(way(false, SEPARATE, true, own));
    ways
}

/// Of those that are late at most twice as often as the best, which a run this short does not tell apart, the one that costs
/// least. Only what a rig can be.
fn best(measured: &[Measured]) -> Option<&Measured> {
    let of_rigs = || measured.iter().filter(|one| one.way.for_rigs);
    let least = of_rigs().map(|one| one.late_share).fold(f64::INFINITY, f64::min);
    of_rigs()
        .filter(|one| one.late_share <= 2.0 * least)
        .min_by(|one, other| one.cpus_used.total_cmp(&other.cpus_used))
}

/// CPUs that the system gives to nobody by itself, as the kernel lists them: `2-3,6`.
fn isolated_cpus() -> Vec<usize> {
    let listed = std::fs::read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
    let range = |part: &str| -> Option<std::ops::RangeInclusive<usize>> {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some(first.parse().ok()?..=last.parse().ok()?)
    };
    listed.trim().split(',').filter_map(range).flatten().collect()
}

#[derive(Clone)]
struct Doctor<'a> {
    path: &'a Path,
    out: &'a Path,
    duration_s: f64,
    settings: Vec<Setting>,
}

impl<'a> Doctor<'a> {
    fn new(path: &'a Path, arguments: &'a DoctorArguments) -> miette::Result<Self> {
        let mut settings = arguments.set.settings.clone();
        if load(path, &settings)?.clock.realtime().is_none() {
            settings.extend(parsed(&["clock=Realtime(lock_memory: true)".into()])?);
        }
        Ok(Self {
            path,
            out: &arguments.out,
            duration_s: arguments.duration_s,
            settings,
        })
    }

    fn scenario(&self, way: &Way, rate_hz: f64, empty_blocks: bool) -> miette::Result<Scenario> {
        let duration_s = self.duration_s;
        let more = [
            format!("clock.empty_blocks={empty_blocks}"),
            format!("tick_s={:e}", 1.0 / rate_hz),
            format!("duration_s={duration_s}"),
            "recording.on=false".into(),
        ];
        let settings = [&self.settings[..], &parsed(&way.settings)?, &parsed(&more)?].concat();
        Ok(load(self.path, &settings)?)
    }

    fn measure(&mut self, way: Way, rate_hz: f64, empty_blocks: bool, name: &str) -> miette::Result<Measured> {
        let scenario = self.scenario(&way, rate_hz, empty_blocks)?;
        let summary = one(&scenario, self.out, name)?;
        let ticks = scenario.ticks();
        let round = summary.find(|process| process.round.as_ref());
        let round = round.map(|round| round.summary).unwrap_or_default();
        let wake = summary.find(|process| process.wake.as_ref());
        let asked = summary.processes.iter().flat_map(|(_, process)| &process.asked);
        let mut refused: Vec<String> = asked
            .filter(|attempt| !attempt.granted)
            .map(|attempt| attempt.what.clone())
            .collect();
        refused.sort();
        refused.dedup();
        Ok(Measured {
            way,
            rate_hz,
            ticks,
            late_share: summary.most_missed() as f64 / ticks as f64,
            longest_row: summary.longest_row,
            round_p50_us: round.p50_us,
            round_p99_us: round.p99_us,
            wake_p99_us: wake.map(|wake| wake.summary.p99_us).unwrap_or_default(),
            cpus_used: summary.cpu_s() / scenario.duration_s,
            refused,
        })
    }

    /// The highest rate of the ladder that is kept, if whoever keeps one keeps all below it.
    fn search(&mut self, way: &Way) -> miette::Result<(Vec<Measured>, Option<f64>)> {
        let usable = |rate_hz: &f64| self.scenario(way, *rate_hz, false).is_ok();
        let ladder: Vec<f64> = LADDER_HZ.into_iter().filter(usable).collect();
        let (mut kept, mut missed) = (0, ladder.len() + 1);
        let mut rates = Vec::new();
        while kept + 1 < missed {
            // Counted from 1: 0 is none.
            let middle = usize::midpoint(kept, missed);
            let rate_hz = ladder[middle - 1];
            let one = self.measure(way.clone(), rate_hz, false, &format!("{rate_hz} Hz"))?;
            if one.late_share < MAX_LATE {
                kept = middle;
            } else {
                missed = middle;
            }
            rates.push(one);
        }
        rates.sort_by(|one, other| one.rate_hz.total_cmp(&other.rate_hz));
        Ok((rates, kept.checked_sub(1).map(|kept| ladder[kept])))
    }
}

pub(super) fn parsed(settings: &[String]) -> miette::Result<Vec<Setting>> {
    let parsed = settings.iter().map(|setting| setting.parse());
    parsed
        .collect::<Result<_, String>>()
        .map_err(|sentence| miette::miette!("{sentence}"))
}

fn one(scenario: &Scenario, out: &Path, name: &str) -> Result<RealtimeSummary, RunError> {
    let realtime = summary(scenario, Waits::shared(), out, name)?.realtime;
    realtime.ok_or_else(|| RunError::Setup("no process has reported real-time figures".into()))
}

/// What one run came to.
pub(super) fn summary(scenario: &Scenario, waits: Waits, out: &Path, name: &str) -> Result<Summary, RunError> {
    let folder = prepare(scenario, Some(out))?;
    let bar = progress_bar(scenario.ticks(), name);
    let mut progress = |tick| bar.set_position(tick);
    let reports = if scenario.placement == Placement::Embedded {
        embedded(scenario, &folder, &mut progress)?
    } else {
        let options = Options {
            waits,
            reverse_start: false,
            resources: Resources::unique(),
            start_limit: START_LIMIT,
            commands: Vec::new(),
            across: AcrossArguments::default(),
        };
        launcher::launch(scenario, &folder, &options, &mut progress)?
    };
    bar.finish_and_clear();
    Summary::written(scenario, &reports, &folder)
}

impl Findings {
    fn text(&self) -> String {
        let isolated = match &self.isolated_cpus[..] {
            [] => "none isolated".into(),
            cpus => format!("isolated: {cpus:?}"),
        };
        let late = 100.0 * self.max_late_share;
        let mut text = format!(
            "{} CPUs, {isolated}; runs of {} s. late: ticks that the process missed that missed most; round: measurement to coil \
             field; CPUs used: by all processes but the recorder\n\nThe transport alone; what is late with all in one is this machine's own \
             doing\n{}\n\nThe scenario's own blocks\n{}\n",
            self.cpus,
            self.seconds,
            table(&self.ways),
            table(&self.rates)
        );
        let refused: Vec<&String> = self.ways.iter().flat_map(|one| &one.refused).collect();
        if let Some(refused) = refused.first() {
            text += &format!("\nThe system refused: {refused}");
        }
        text += &match self.highest_rate_hz {
            Some(rate_hz) => format!("\n{rate_hz} Hz is the highest rate tried with less than {late} % late:"),
            None => format!(
                "\nNo rate tried has less than {late} % late on this machine as it is now; the way that was tried:"
            ),
        };
        let settings = self.settings.iter().map(|setting| format!(" --set '{setting}'"));
        text + &settings.collect::<String>()
    }
}

fn table(rows: &[Measured]) -> String {
    let header = ["wait", "placement", "priority", "bound to", "rate, Hz", "late"];
    let more = ["longest row", "round p50, µs", "p99", "timer p99", "CPUs used"];
    let mut table = Table::new(header.into_iter().chain(more));
    for one in rows {
        let way = &one.way;
        table.push([
            way.wait.into(),
            way.placement.into(),
            way.priority.map_or("none".into(), |priority| priority.to_string()),
            if way.cpus.is_empty() {
                "any".into()
            } else {
                format!("{:?}", way.cpus)
            },
            format!("{}", one.rate_hz),
            format!("{:.2} %", 100.0 * one.late_share),
            one.longest_row.to_string(),
            format!("{:.0}", one.round_p50_us),
            format!("{:.0}", one.round_p99_us),
            format!("{:.0}", one.wake_p99_us),
            format!("{:.2}", one.cpus_used),
        ]);
    }
    table.terminal()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(late_share: f64, cpus_used: f64, for_rigs: bool) -> Measured {
        let mut way = ways(2, &[]).remove(0);
        way.for_rigs = for_rigs;
        Measured {
            way,
            rate_hz: 1000.0,
            ticks: 1000,
            late_share,
            longest_row: 0,
            round_p50_us: 0.0,
            round_p99_us: 0.0,
            wake_p99_us: 0.0,
            cpus_used,
            refused: Vec::new(),
        }
    }

    // Guards the choice: what misses clearly more is out however cheap, what is no rig's too; among the rest the price decides.
    #[test]
    fn the_cheapest_of_the_best_is_chosen() {
        let ways = [
            measured(0.0, 0.1, false),
            measured(0.001, 0.7, true),
            measured(0.002, 0.4, true),
            measured(0.0021, 0.2, true),
        ];
        assert_eq!(best(&ways).map(|best| best.cpus_used), Some(0.4));
        assert_eq!(best(&ways[..1]).map(|best| best.cpus_used), None);
    }

    // Guards a small machine: nobody who polls has a real-time priority unless a CPU is left to the others.
    #[test]
    fn polling_leaves_a_cpu_to_the_others() {
        for cpus in [1, 2, 4, 8] {
            for way in ways(cpus, &[]) {
                let processes = match way.placement {
                    "separate" => 6,
                    "grouped" => 3,
                    _ => 1,
                };
                assert!(
                    way.wait == "sleeping" || way.priority.is_none() || processes < cpus,
                    "{way:?}"
                );
            }
        }
    }
}
