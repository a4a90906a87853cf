//! `anhyst doctor --lockstep SCENARIO`: what a hop from one process to the next costs on this machine, by placement, by how one waits for it and
//! on how many cores, and so how a run without a clock is fastest.

use super::Ending;
use super::doctor_arguments::DoctorArguments;
use super::doctor_realtime::{GROUPED, SEPARATE, parsed};
use super::least::refuse_short;
use anhyst_ipc::NodeId;
use anhyst_launch::launcher::Waits;
use anhyst_launch::say::quoted;
use anhyst_report::table::Table;
use anhyst_scenario::{Scenario, Setting, load};
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
    /// Each process polls on a core of its own; if not, the loop has one core, and who has nothing to do sleeps.
    dedicated_cores: bool,
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
pub fn run(path: &Path, arguments: &DoctorArguments) -> miette::Result<Ending> {
    let (settings, duration_s) = (&arguments.set.settings, arguments.duration_s);
    anhyst_launch::signals::install();
    anhyst_launch::resources::sweep();
    let told = load(path, settings)?;
    let real_time = told.clock.realtime().is_some();
    let lasting = |way: &Way, duration_s: f64| -> miette::Result<Scenario> {
        let duration_s = duration_s / TURNS as f64;
        let own = [
            LOCKSTEP.into(),
            "recording.on=false".into(),
            format!("duration_s={duration_s}"),
            way.placement.into(),
        ];
        Ok(load(path, &[&settings[..], &parsed(&own)?].concat())?)
    };
    let ways = ways();
    refuse_short(duration_s, TURNS as f64 * told.duration_s, |duration_s| {
        lasting(&ways[0], duration_s)
    })?;
    let scenario = |way: &Way| lasting(way, duration_s);
    let mut rates = vec![Vec::new(); ways.len()];
    for turn in 0..TURNS {
        for (index, way) in ways.iter().enumerate() {
            let name = format!("way {} of {}, turn {} of {TURNS}", index + 1, ways.len(), turn + 1);
            rates[index].push(rate(&scenario(way)?, way, &arguments.out, &name)?);
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
        cpus: std::thread::available_parallelism().map_or(1, usize::from),
        turns: TURNS,
        separate: fastest(&|one| one.way.placement == SEPARATE),
        fastest: fastest(&|one| one.hops > 0),
        ways: measured,
    };
    if arguments.json.json {
        crate::say!("{}", super::json(&findings)?);
    } else {
        crate::say!("{}", findings.text());
    }
    Ok(Ending::Held)
}

/// The blocks alone first.
fn ways() -> Vec<Way> {
    let way = |placement, dedicated_cores| Way {
        placement,
        dedicated_cores,
    };
    let of_processes = [SEPARATE, GROUPED].into_iter();
    let of_processes = of_processes.flat_map(|placement| [way(placement, false), way(placement, true)]);
    std::iter::once(way(EMBEDDED, false)).chain(of_processes).collect()
}

/// Ticks per second of one run.
fn rate(scenario: &Scenario, way: &Way, out: &Path, name: &str) -> miette::Result<f64> {
    let waits = Waits::of(scenario, way.dedicated_cores);
    Ok(super::doctor_realtime::summary(scenario, waits, out, name)?.ticks_per_s)
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
        let polls = if self.dedicated_cores { " --dedicated-cores" } else { "" };
        let settings = settings
            .iter()
            .map(|setting| format!("{}={}", setting.path, setting.value));
        let clock = real_time.then(|| LOCKSTEP.to_owned());
        let all = settings.chain(clock).chain([self.placement.to_owned()]);
        let all: String = all.map(|setting| format!(" --set '{setting}'")).collect();
        format!("anhyst run {}{polls}{all}", quoted(path))
    }
}

impl Findings {
    fn text(&self) -> String {
        let mut table = Table::new(["placement", "processes", "hops a tick", "ticks per second", "a hop, µs"]);
        for one in &self.ways {
            let way = &one.way;
            let placement = match way.placement {
                EMBEDDED => "one process",
                SEPARATE => "separate",
                _ => "grouped",
            };
            table.push([
                placement.into(),
                match (way.placement, way.dedicated_cores) {
                    (EMBEDDED, _) => "-".into(),
                    (_, false) => "share a core".into(),
                    (_, true) => "poll".into(),
                },
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
}
