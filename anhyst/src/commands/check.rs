//! `anhyst check`: is this scenario usable, and what is its loop like?

use super::Ending;
use crate::arguments::{JsonArgument, ScenarioArguments};
use anhyst_launch::claim::claimed;
use anhyst_launch::disk::{free_bytes, mebibytes};
use anhyst_launch::error::RunError;
use anhyst_launch::loop_section::{loop_section, margins_table};
use anhyst_launch::resources::{SHARED_MEMORY_BYTES, shared_memory_left};
use anhyst_report::number::{Digits, Si};
use anhyst_report::page::Page;
use anhyst_report::table::Table;
use anhyst_scenario::{Foresight, Placement, Scenario, SteppedLoop, load};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// `check`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// What to check.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Print the effective scenario.
    #[arg(long, conflicts_with = "json")]
    pub print: bool,
    /// Draw the loop's shape as a page, check.html, in this folder.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// How the finding is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// The first thing that is wrong with the scenario.
pub fn run(arguments: &CheckArguments) -> miette::Result<Ending> {
    let scenario = load(&arguments.scenario.scenario, &arguments.scenario.set.settings)?;
    if let Some(out) = &arguments.out {
        draw(&scenario, out)?;
    }
    if arguments.print {
        let effective = scenario.to_ron().map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{effective}");
        return Ok(Ending::Held);
    }
    let ticks = scenario.ticks();
    let processes = scenario.placement.processes().len();
    let feedback = scenario.controller.feedback.as_ref();
    let margins = feedback.map(|_| scenario.loop_shape()).transpose();
    let margins = margins.map_err(RunError::from)?.map(|shape| shape.margins());
    let foresight = scenario.foresight().map_err(RunError::from)?;
    let cost = cost(&scenario)?;
    if arguments.json.json {
        let finding = serde_json::json!({
            "scenario": scenario.name,
            "ticks": ticks,
            "tick_s": scenario.tick_s,
            "processes": processes,
            "units": scenario.units(),
            "margins": margins,
            "samples_per_resonance": scenario.samples_per_resonance(),
            "foresight": foresight,
            "cost": cost,
            "warnings": scenario.warnings().into_iter().chain(cost.beyond(arguments.out.as_deref())).collect::<Vec<_>>(),
        });
        crate::say!("{finding:#}");
        return Ok(Ending::Held);
    }
    crate::say!(
        "{}: good; {ticks} ticks of {} µs in {processes} {}",
        scenario.name,
        scenario.tick_s * 1e6,
        if processes == 1 { "process" } else { "processes" }
    );
    crate::say!("{}", foresight_table(&scenario, &foresight, &cost).terminal());
    match margins {
        Some(margins) => crate::say!("{}", margins_table(&margins).terminal()),
        None => crate::say!("no feedback: no loop is closed"),
    }
    for warning in scenario
        .warnings()
        .into_iter()
        .chain(cost.beyond(arguments.out.as_deref()))
    {
        crate::say!("warning: {warning}");
    }
    Ok(Ending::Held)
}

/// Ticks of the loop are timed for so long.
const TIMED: Duration = Duration::from_millis(50);
/// Of a tick that goes through processes which share cores, beside what its blocks compute; docs/scenarios.md, "Placement".
const HANDED_OVER_S: f64 = 6e-5;
/// Bytes of a tick: digests of seven nodes, and the tokens as a recording holds them.
const DIGESTS_BYTES: u64 = 7 * 8;
const RECORDED_BYTES: u64 = 265;

/// What a run costs.
#[derive(Debug, Serialize)]
struct Cost {
    /// All nodes in one process on this machine, as fast as it goes.
    embedded_s: f64,
    /// In the scenario's placement; in real time as long as it lasts.
    run_s: f64,
    /// Of the results' disk.
    disk_bytes: u64,
    /// Kept until the end: the digests.
    memory_bytes: u64,
    shared_memory_bytes: u64,
}

impl Cost {
    /// What this machine has not got, in sentences; the results go to `out`, or below the working directory.
    fn beyond(&self, out: Option<&Path>) -> Vec<String> {
        let folder = std::env::current_dir()
            .unwrap_or_default()
            .join(out.unwrap_or(Path::new("")));
        let disk = free_bytes(&folder).filter(|free| *free < self.disk_bytes).map(|free| {
            let [needed, free] = [self.disk_bytes, free].map(mebibytes);
            format!("the run writes {needed}, and the disk has {free} left: --no-recording and recording.ring_s make it less")
        });
        let shared = (self.shared_memory_bytes > 0)
            .then(|| shared_memory_left().err())
            .flatten();
        disk.into_iter().chain(shared).collect()
    }
}

/// From a few thousand ticks of the loop in this process.
fn cost(scenario: &Scenario) -> Result<Cost, RunError> {
    let ticks = scenario.ticks();
    let mut stepped = SteppedLoop::new(scenario)?;
    let start = Instant::now();
    let timed = (0..ticks).take_while(|tick| {
        stepped.step(*tick);
        start.elapsed() < TIMED
    });
    let timed = timed.count().max(1);
    let tick_s = start.elapsed().as_secs_f64() / timed as f64;
    let embedded = scenario.placement == Placement::Embedded;
    let embedded_s = tick_s * ticks as f64;
    let run_s = match scenario.clock.realtime() {
        Some(_) => scenario.duration_s,
        None if embedded => embedded_s,
        None => embedded_s + HANDED_OVER_S * ticks as f64,
    };
    let recorded = if scenario.recording.on { RECORDED_BYTES } else { 0 };
    Ok(Cost {
        embedded_s,
        run_s,
        disk_bytes: ticks * (DIGESTS_BYTES + recorded),
        memory_bytes: ticks * DIGESTS_BYTES,
        shared_memory_bytes: if embedded { 0 } else { SHARED_MEMORY_BYTES },
    })
}

/// What the motion needs and the run costs, as rows.
fn foresight_table(scenario: &Scenario, foresight: &Foresight, cost: &Cost) -> Table {
    let units = scenario.units();
    let (input, output) = (units.input.as_str(), units.output.as_str());
    // What is nothing beside the rest is nothing.
    let ends_of = |low: f64, high: f64, unit: &str| {
        let plain = |end: f64| if end.abs() < 1e-9 * (high - low) { 0.0 } else { end };
        format!("{} to {}", Si(plain(low), unit), Si(plain(high), unit))
    };
    let ends = |[low, high]: [f64; 2]| ends_of(low, high, output);
    let mut table = Table::default();
    let mut row = |name: &str, value: String| table.push([name.to_owned(), value]);
    let samples = 1.0 / (foresight.resonance_hz * scenario.tick_s);
    row(
        "resonance",
        format!(
            "{}, damping ratio {}, {} samples in a period",
            Si(foresight.resonance_hz, "Hz"),
            Digits(foresight.damping_ratio, 3),
            Digits(samples, 3)
        ),
    );
    if let Some(asks) = foresight.asks_m {
        row(
            "the motion asks for",
            format!("{}, of {}", ends(asks), ends(foresight.gives_m)),
        );
    }
    if let Some(field) = foresight.field_a_per_m {
        let limit = foresight.field_limit_a_per_m;
        let limits = match scenario.guard.lowest_field_a_per_m {
            Some(lowest) => ends_of(lowest, limit, input),
            None => format!("±{}", Si(limit, input)),
        };
        row("input for it, limit", format!("{}, {limits}", Si(field, input)));
    }
    if let Some(floor) = foresight.floor_rms_m {
        row("error from the sensor's noise, rms", Si(floor, output).to_string());
    }
    if let Some(tolerance) = scenario.expect.tolerance_m {
        row("expected error at most", Si(tolerance, output).to_string());
    }
    row(
        "time on this machine",
        format!(
            "some {} s, embedded {} s",
            Digits(cost.run_s, 2),
            Digits(cost.embedded_s, 2)
        ),
    );
    row(
        "disk, memory, shared memory",
        format!(
            "{}, {}, {}",
            mebibytes(cost.disk_bytes),
            mebibytes(cost.memory_bytes),
            mebibytes(cost.shared_memory_bytes)
        ),
    );
    table
}

fn draw(scenario: &Scenario, out: &Path) -> miette::Result<()> {
    let section = loop_section(scenario);
    let section = section.ok_or_else(|| miette::miette!("--out draws the loop, and this scenario has no feedback"))?;
    let page = Page::new(
        &format!("Loop of {}", scenario.name),
        "How far the loop is from its edge of stability, before it runs.",
    );
    let results = claimed(Some(out), &scenario.name)?;
    super::save(&results.path, "check.html", &page.section(section).html())?;
    Ok(())
}
