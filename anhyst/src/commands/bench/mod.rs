//! `anhyst bench`: what each part of the loop costs on this machine, in units of one scalar `tanh` of the same run, beside the least
//! that it could be made of.
//!
//! All take turns, and each is set against the `tanh` of its own turn, so that a machine that is now faster and now slower disturbs
//! little. Times are CPU time of this process with all its threads: on one core it takes as long. Of several processes it is wall clock.

mod blocks;
mod laws;
mod measure;
mod models;
mod runs;

use super::{Ending, count_bar};
use crate::arguments::{JsonArgument, SetArguments, beside};
use anhyst_launch::{resources, signals};
use anhyst_model::Instructions;
use anhyst_report::number::Digits;
use anhyst_report::table::Table;
use anhyst_scenario::load_changed;
use clap::Args;
use measure::{Row, in_turns};
use serde::Serialize;
use std::path::PathBuf;

const MOST_TICKS: u32 = 1_000_000;

/// `bench`
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// Whose loop is measured.
    #[arg(default_value = "built-in/milling.ron")]
    pub scenario: PathBuf,
    /// What is changed in it.
    #[command(flatten)]
    pub set: SetArguments,
    /// Turns; in each everything is measured once.
    #[arg(long, default_value_t = 11, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub turns: u32,
    /// Steps of a model or a block in a turn; the loop goes five times as many in processes, 25 times in one.
    #[arg(long, default_value_t = 8000, value_name = "N", value_parser = clap::value_parser!(u32).range(100..=i64::from(MOST_TICKS)))]
    pub ticks: u32,
    /// Folder of the runs that are measured, each in the place of the one before.
    #[arg(long, default_value = "runs/speed", value_name = "FOLDER")]
    pub out: PathBuf,
    /// How the table is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// What is printed for programs.
#[derive(Debug, Serialize)]
struct Measured {
    /// Of the bank.
    instructions: &'static str,
    cores: usize,
    turns: u32,
    rows: Vec<Row>,
}

/// Runs the command.
///
/// # Errors
/// A scenario that cannot be used, or a run that failed.
pub fn run(arguments: &BenchArguments) -> miette::Result<Ending> {
    beside(Some(&arguments.out), "scenario.ron", &arguments.scenario)?;
    signals::install();
    resources::sweep();
    let ticks = arguments.ticks as usize;
    let lasting = |ticks: u64| {
        load_changed(&arguments.scenario, &arguments.set.settings, |scenario| {
            scenario.duration_s = runs::TIMES * ticks as f64 * scenario.tick_s;
            // Every tick is judged, as in a long run.
            scenario.expect.settling_s = 0.0;
        })
    };
    let scenario = lasting(arguments.ticks.into()).map_err(|refused| {
        let least = super::least::least(arguments.ticks.into(), MOST_TICKS.into(), |ticks| {
            lasting(ticks).is_ok()
        });
        least.map_or_else(
            || refused.into(),
            |least| miette::miette!("--ticks: {ticks} are too few for this scenario, it takes at least {least}"),
        )
    })?;
    let mut all = models::timed(ticks);
    all.extend(laws::timed(ticks));
    all.extend(blocks::timed(&scenario, ticks)?);
    all.extend(runs::timed(&scenario, &arguments.out)?);
    let bar = count_bar(u64::from(arguments.turns) * all.len() as u64, "bench");
    let rows = in_turns(all, arguments.turns, &mut || bar.inc(1));
    bar.finish_and_clear();
    let measured = Measured {
        instructions: Instructions::best().name(),
        cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        turns: arguments.turns,
        rows: rows?,
    };
    if arguments.json.json {
        crate::say!("{}", super::json(&measured)?);
        return Ok(Ending::Held);
    }
    crate::say!("{}", measured.table().terminal());
    crate::say!(
        "medians of {} turns; spread: half of the turns lie so far apart; banks on {} unless told otherwise, {} cores",
        measured.turns,
        measured.instructions,
        measured.cores
    );
    Ok(Ending::Held)
}

impl Measured {
    fn table(&self) -> Table {
        let mut table = Table::new([
            "what",
            "of",
            "time, ns",
            "x tanh",
            "least",
            "spread, %",
            "floor, x tanh",
            "which is",
            "x real time",
        ]);
        for own in &self.rows {
            let digits = |value: f64| Digits(value, 3).to_string();
            let some = |value: Option<f64>| value.map(digits).unwrap_or_default();
            table.push([
                own.name.clone(),
                own.of.to_owned(),
                digits(own.median_ns),
                digits(own.tanh),
                digits(own.least_tanh),
                format!("{:.1}", 100.0 * own.spread),
                some(own.floor_tanh),
                own.floor_is.to_owned(),
                some(own.times_real_time),
            ]);
        }
        table
    }
}
