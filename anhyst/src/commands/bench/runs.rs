//! The whole loop: in this process with and without a recording, in a process a node, and in processes whose blocks answer with zeros.

use super::blocks::BLOCKS;
use super::measure::Timed;
use anhyst_launch::across::AcrossArguments;
use anhyst_launch::embedded::{embedded, judged, prepare};
use anhyst_launch::error::RunError;
use anhyst_launch::launcher::{self, Options};
use anhyst_launch::realtime::cpu_s;
use anhyst_launch::report::ProcessReport;
use anhyst_launch::resources::Resources;
use anhyst_scenario::{Clock, Placement, Scenario};
use std::path::Path;
use std::time::Duration;

/// How many times as many ticks as of a block.
pub const TIMES: f64 = 5.0;
/// Where the results of the last run go.
const RESULTS: &str = "runs/speed";
const START_LIMIT: Duration = Duration::from_secs(30);

const UNRECORDED: &str = "tick, all blocks in one process, no recording";
const EMPTY: &str = "tick of processes that answer with zeros";

/// All of them; those in this process by CPU time, the others by wall clock.
///
/// # Errors
/// A loop that cannot be had.
pub fn timed(scenario: &Scenario) -> Result<Vec<Timed<'static>>, RunError> {
    let loop_of = |placement: Placement, recording: bool| {
        let mut scenario = scenario.clone();
        scenario.placement = placement;
        scenario.recording.on = recording;
        scenario
    };
    let unrecorded = loop_of(Placement::Embedded, false);
    let separate = loop_of(Placement::Separate, false);
    let mut empty = separate.clone();
    empty.clock = Clock::Lockstep {
        receive_limit_s: scenario.clock.receive_limit_s(),
        empty_blocks: true,
    };
    let of = |name: &str, mut once: Box<dyn FnMut() -> Result<f64, RunError>>| {
        let ticks = scenario.ticks() as f64;
        let mut timed = Timed::failing(name, "tick", move || Ok(1e9 * once()? / ticks));
        timed.tick_s = Some(scenario.tick_s);
        timed
    };
    let mut all = vec![
        of(
            UNRECORDED,
            Box::new(move || {
                let begun_s = cpu_s();
                judged(&unrecorded)?;
                Ok(cpu_s() - begun_s)
            }),
        )
        .at_least("its blocks", BLOCKS.map(|block| (1.0, block))),
    ];
    if cfg!(feature = "recorder") {
        let recorded = loop_of(Placement::Embedded, true);
        let name = "the same with a recording";
        let once = move || {
            let begun_s = cpu_s();
            let folder = prepare(&recorded, Some(Path::new(RESULTS)))?;
            embedded(&recorded, &folder, &mut |_| ())?;
            Ok(cpu_s() - begun_s)
        };
        all.push(of(name, Box::new(once)).at_least("without", [(1.0, UNRECORDED)]));
    }
    all.push(of(EMPTY, Box::new(move || processes(&empty))));
    all.push(
        of("tick of the processes", Box::new(move || processes(&separate)))
            .at_least("zeros and the blocks", [(1.0, EMPTY), (1.0, UNRECORDED)]),
    );
    Ok(all)
}

/// How long the loop of the slowest of a scenario's processes took, s.
fn processes(scenario: &Scenario) -> Result<f64, RunError> {
    let folder = prepare(scenario, Some(Path::new(RESULTS)))?;
    let options = Options {
        yields: crate::arguments::YIELDS_SHARED,
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
