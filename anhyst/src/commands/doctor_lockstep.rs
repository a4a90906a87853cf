//! `anhyst doctor --lockstep SCENARIO`: what a hop from one process to the next costs on this machine, by placement, by how one waits for it and
//! on how many cores, and so how a run without a clock is fastest.

use super::Ending;
use super::doctor_realtime::{GROUPED, SEPARATE, parsed};
use crate::arguments::{YIELDS_DEDICATED, YIELDS_SHARED};
use anhyst_ipc::NodeId;
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_report::table::Table;
use anhyst_scenario::{Scenario, Setting, load};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use serde::Serialize;
use std::path::Path;

/// How often every way is measured, in turns; the median is told.
const TURNS: usize = 3;
/// Without hops: what the blocks themselves take.
const EMBEDDED: &str = "placement=Embedded";

const LOCKSTEP: &str = "clock=Lockstep()";

/// A way to run in lockstep.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Way {
    /// As a change of the scenario.
    placement: &'static str,
    /// Polls before a waiting process sleeps.
    yields: u32,
    /// The CPU that all processes share; null: they may use all.
    cpu: Option<usize>,
}

/// What it came to.
#[derive(Debug, Serialize)]
struct Measured {
    way: Way,
    hops: usize,
    ticks_per_s: f64,
    /// Of what a tick takes longer than the blocks do, the share of one hop; null without hops.
    hop_us: Option<f64>,
    /// What runs the scenario so.
    command: String,
}

/// What the command prints.
#[derive(Debug, Serialize)]
struct Findings {
    cpus: usize,
    turns: usize,
    ways: Vec<Measured>,
    /// The fastest with a process for each node.
    separate: String,
    /// The fastest in several processes.
    fastest: String,
}

/// Measures and prints.
///
/// # Errors
/// A scenario that cannot be used, or a process that failed.
pub fn run(path: &Path, settings: &[Setting], duration_s: f64, json: bool) -> miette::Result<Ending> {
    anhyst_launch::signals::install();
    anhyst_launch::resources::sweep();
    let allowed =
        sched_getaffinity(None).map_err(|cause| miette::miette!("this process's CPUs are not known: {cause}"))?;
    let cpus: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|cpu| allowed.is_set(*cpu)).collect();
    let duration_s = duration_s / TURNS as f64;
    let real_time = load(path, settings)?.clock.realtime().is_some();
    let scenario = |way: &Way| -> miette::Result<Scenario> {
        let own = [
            LOCKSTEP.into(),
            "recording.on=false".into(),
            format!("duration_s={duration_s}"),
            way.placement.into(),
        ];
        Ok(load(path, &[settings, &parsed(&own)?].concat())?)
    };
    let ways = ways(&cpus);
    let mut rates = vec![Vec::new(); ways.len()];
    for turn in 0..TURNS {
        for (index, way) in ways.iter().enumerate() {
            let name = format!("way {} of {}, turn {} of {TURNS}", index + 1, ways.len(), turn + 1);
            rates[index].push(rate(&scenario(way)?, way, &allowed, &name)?);
        }
    }
    let median = |mut rates: Vec<f64>| {
        rates.sort_by(f64::total_cmp);
        rates[rates.len() / 2]
    };
    let rates: Vec<f64> = rates.into_iter().map(median).collect();
    let mut measured = Vec::new();
    for (way, &ticks_per_s) in ways.iter().zip(&rates) {
        let hops = hops(&scenario(way)?);
        // Of embedded blocks, the first way.
        let longer_s = 1.0 / ticks_per_s - 1.0 / rates[0];
        measured.push(Measured {
            hops,
            ticks_per_s,
            hop_us: (hops > 0).then(|| 1e6 * longer_s / hops as f64),
            command: way.command(path, settings, real_time),
            way: way.clone(),
        });
    }
    let fastest = |of: &dyn Fn(&&Measured) -> bool| {
        let best = measured
            .iter()
            .filter(of)
            .max_by(|one, other| one.ticks_per_s.total_cmp(&other.ticks_per_s));
        best.map(|best| best.command.clone()).unwrap_or_default()
    };
    let findings = Findings {
        cpus: cpus.len(),
        turns: TURNS,
        separate: fastest(&|one| one.way.placement == SEPARATE),
        fastest: fastest(&|one| one.hops > 0),
        ways: measured,
    };
    if json {
        crate::say!("{}", super::json(&findings)?);
    } else {
        crate::say!("{}", findings.text());
    }
    Ok(Ending::Held)
}

/// The blocks alone first.
fn ways(cpus: &[usize]) -> Vec<Way> {
    let way = |placement, yields, cpu| Way { placement, yields, cpu };
    let mut ways = vec![way(EMBEDDED, YIELDS_SHARED, None)];
    for placement in [SEPARATE, GROUPED] {
        for yields in [YIELDS_SHARED, YIELDS_DEDICATED] {
            ways.push(way(placement, yields, None));
            if cpus.len() > 1 {
                ways.push(way(placement, yields, cpus.first().copied()));
            }
        }
    }
    ways
}

/// Ticks per second of one run. Processes inherit the CPUs of the thread that starts them.
fn rate(scenario: &Scenario, way: &Way, allowed: &CpuSet, name: &str) -> miette::Result<f64> {
    let bind = |cpus: &CpuSet| {
        sched_setaffinity(None, cpus).map_err(|cause| RunError::Setup(format!("CPUs cannot be chosen: {cause}")))
    };
    if let Some(cpu) = way.cpu {
        let mut one = CpuSet::new();
        one.set(cpu);
        bind(&one)?;
    }
    let summary = super::doctor_realtime::summary(scenario, way.yields, name);
    bind(allowed)?;
    Ok(summary?.ticks_per_s)
}

/// How often a tick's tokens, on their way round the loop, go from one process to another.
fn hops(scenario: &Scenario) -> usize {
    let processes = scenario.placement.processes();
    let process_of = |node: &NodeId| processes.iter().position(|(_, nodes)| nodes.contains(node));
    let loop_nodes = NodeId::SENDERS;
    let next = loop_nodes.iter().cycle().skip(1);
    loop_nodes
        .iter()
        .zip(next)
        .filter(|(one, other)| process_of(one) != process_of(other))
        .count()
}

impl Way {
    /// `real_time`: what the scenario's clock is by itself.
    fn command(&self, path: &Path, settings: &[Setting], real_time: bool) -> String {
        let bound = self.cpu.map_or(String::new(), |cpu| format!("taskset -c {cpu} "));
        let polls = if self.yields == YIELDS_DEDICATED {
            " --dedicated-cores"
        } else {
            ""
        };
        let settings = settings
            .iter()
            .map(|setting| format!("{}={}", setting.path, setting.value));
        let clock = real_time.then(|| LOCKSTEP.to_owned());
        let all = settings.chain(clock).chain([self.placement.to_owned()]);
        let all: String = all.map(|setting| format!(" --set '{setting}'")).collect();
        format!("{bound}anhyst run {}{polls}{all}", quoted(path))
    }
}

impl Findings {
    fn text(&self) -> String {
        let mut table = Table::new([
            "placement",
            "waits",
            "CPUs",
            "hops a tick",
            "ticks per second",
            "a hop, µs",
        ]);
        for one in &self.ways {
            let way = &one.way;
            let (placement, waits) = match way.placement {
                EMBEDDED => ("one process", "-"),
                own => (
                    if own == SEPARATE { "separate" } else { "grouped" },
                    if way.yields == YIELDS_DEDICATED {
                        "polls"
                    } else {
                        "polls, then sleeps"
                    },
                ),
            };
            table.push([
                placement.into(),
                waits.into(),
                way.cpu.map_or("all".into(), |cpu| format!("{cpu} only")),
                one.hops.to_string(),
                format!("{:.0}", one.ticks_per_s),
                one.hop_us.map_or("-".into(), |hop_us| format!("{hop_us:.1}")),
            ]);
        }
        format!(
            "{} CPUs; medians of {} runs each, in turns, without a recording\n{}\n\nfastest with a process for each node:\n  {}\nfastest in several processes:\n  {}",
            self.cpus,
            self.turns,
            table.terminal(),
            self.separate,
            self.fastest
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the cost of a hop: what a tick takes longer is shared out over as many as there are.
    #[test]
    fn hops_are_those_of_the_placement() {
        let hops_of = |placement: &str| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/milling.ron");
            hops(&load(&path, &parsed(&[placement.to_owned()]).unwrap()).unwrap())
        };
        assert_eq!(hops_of(EMBEDDED), 0);
        assert_eq!(hops_of(SEPARATE), 6);
        assert_eq!(hops_of(GROUPED), 3);
        assert_eq!(hops_of("placement=Groups([[plant, amplifier]])"), 5);
    }

    // Guards a machine, or a container, with one CPU, whose number need not be 0.
    #[test]
    fn one_core_is_measured_where_there_are_more() {
        let bound = |cpus: &[usize]| ways(cpus).iter().filter_map(|way| way.cpu).collect::<Vec<_>>();
        assert!(bound(&[3]).is_empty());
        assert_eq!(bound(&[2, 3]), [2; 4]);
    }
}
