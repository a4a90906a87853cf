//! The whole loop: in this process with and without a recording, in a process a node, and in processes whose blocks answer with zeros.

use super::blocks::BLOCKS;
use super::measure::Timed;
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::embedded::{embedded, judged, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::launcher::{self, Options, Waits};
use anhyst_launch::realtime::cpu_s;
use anhyst_launch::report::ProcessReport;
use anhyst_launch::resources::Resources;
use anhyst_scenario::{Clock, Placement, Scenario};
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

/// How many times as many ticks as of a block: of processes, and of what is in this process, where what is done once in a run shall not count.
pub const TIMES: f64 = 5.0;
const TIMES_EMBEDDED: f64 = 25.0;
/// Ticks of a run that has little but what is done once.
const FEW_TICKS: f64 = 100.0;
const START_LIMIT: Duration = Duration::from_secs(30);

const UNRECORDED: &str = "tick, all blocks in one process, no recording";
const ONCE: &str = "a recorded run of 100 ticks";
const EMPTY: &str = "tick of processes that answer with zeros";

/// All of them, each in this folder in the place of the one before; those in this process by CPU time, the others by wall clock.
///
/// # Errors
/// A loop that cannot be had.
pub fn timed(scenario: &Scenario, out: &Path) -> Result<Vec<Timed<'static>>, RunError> {
    let out: Rc<Path> = out.into();
    let loop_of = |placement: Placement, recording: bool, duration_s: f64| {
        let mut scenario = scenario.clone();
        scenario.placement = placement;
        scenario.recording.on = recording;
        scenario.duration_s = duration_s;
        scenario
    };
    let long_s = scenario.duration_s * (TIMES_EMBEDDED / TIMES);
    let unrecorded = loop_of(Placement::Embedded, false, long_s);
    let separate = loop_of(Placement::Separate, false, scenario.duration_s);
    let mut empty = separate.clone();
    empty.clock = Clock::Lockstep {
        receive_limit_s: scenario.clock.receive_limit_s(),
        empty_blocks: true,
    };
    let of = |name: &str, scenario: &Scenario, mut once: Box<dyn FnMut() -> Result<f64, RunError>>| {
        let ticks = scenario.ticks() as f64;
        let mut timed = Timed::failing(name, "tick", move || Ok(1e9 * once()? / ticks));
        timed.tick_s = Some(scenario.tick_s);
        timed
    };
    let without = of(
        UNRECORDED,
        &unrecorded.clone(),
        Box::new(move || {
            let begun_s = cpu_s();
            judged(&unrecorded)?;
            Ok(cpu_s() - begun_s)
        }),
    );
    let mut all = vec![without.at_least("its blocks", BLOCKS.map(|block| (1.0, block)))];
    if cfg!(feature = "recorder") {
        let long = loop_of(Placement::Embedded, true, long_s);
        let (of_long, of_short) = (out.clone(), out.clone());
        let with = of(
            "the same with a recording",
            &long.clone(),
            Box::new(move || recorded(&long, &of_long)),
        );
        all.push(with.at_least("without", [(1.0, UNRECORDED)]));
        let short = loop_of(Placement::Embedded, true, FEW_TICKS * scenario.tick_s);
        all.push(Timed::failing(ONCE, "run", move || {
            Ok(1e9 * recorded(&short, &of_short)?)
        }));
    }
    let of_empty = out.clone();
    all.push(of(
        EMPTY,
        &empty.clone(),
        Box::new(move || processes(&empty, &of_empty)),
    ));
    let own = of(
        "tick of the processes",
        &separate.clone(),
        Box::new(move || processes(&separate, &out)),
    );
    all.push(own.at_least("zeros and the blocks", [(1.0, EMPTY), (1.0, UNRECORDED)]));
    Ok(all)
}

/// CPU time of a recorded run in this process, s.
fn recorded(scenario: &Scenario, out: &Path) -> Result<f64, RunError> {
    let begun_s = cpu_s();
    let folder = prepare(scenario, Some(out))?;
    embedded(scenario, &folder, &mut |_| ())?;
    Ok(cpu_s() - begun_s)
}

/// How long the loop of the slowest of a scenario's processes took, s.
fn processes(scenario: &Scenario, out: &Path) -> Result<f64, RunError> {
    let folder = prepare(scenario, Some(out))?;
    let options = Options {
        waits: Waits::of(scenario, false),
        reverse_start: false,
        resources: Resources::unique(),
        start_limit: START_LIMIT,
        commands: Vec::new(),
        across: AcrossArguments::default(),
    };
    let reports = launcher::launch(scenario, &folder, &options, &mut |_| ())?;
    let loop_s = |report: &ProcessReport| report.loop_s;
    Ok(reports.iter().map(loop_s).fold(0.0, f64::max))
}
