//! `anhyst sweep`: a scenario under values that vary and under many seeds; `anhyst gather`: its shards put together.

use crate::arguments::{JsonArgument, OutArgument, ScenarioArguments, ThreadsArgument};
use crate::commands::{Ending, json, long_bar};
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_launch::signals;
use anhyst_sweep::{
    Findings, Made, Manifest, Plan, Rows, Shard, Sweep, SweepError, Variation, gather, publish, ranges,
};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Tables of more rows are in their files only.
const MOST_TOLD: usize = 24;

/// `sweep`
#[derive(Debug, Args)]
pub struct SweepArguments {
    /// The scenario; its runs are embedded, in lockstep and unrecorded.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// A value that varies: `path=FROM..TO:COUNT`, evenly in the logarithm `path=FROM..TO:COUNT:log`, or `path=[value, value]`; of
    /// several all combinations are run (repeatable).
    #[arg(long, value_name = "PATH=VALUES")]
    pub vary: Vec<Variation>,
    /// Run each combination under so many seeds, from the scenario's on.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = seeds)]
    pub seeds: u64,
    /// Make the I-th of N parts only: every N-th run. `anhyst gather` puts the parts together.
    #[arg(long, default_value_t = Shard::WHOLE, hide_default_value = true, value_name = "I/N")]
    pub shard: Shard,
    /// Where the results go. Runs that are there already are not made again.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the runs.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How the summary is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

fn seeds(text: &str) -> Result<u64, String> {
    let seeds = text.parse::<u64>().ok().filter(|seeds| *seeds > 0);
    seeds.ok_or_else(|| format!("{text} is no whole number of at least 1"))
}

/// `gather`
#[derive(Debug, Args)]
pub struct GatherArguments {
    /// Folders of shards.
    #[arg(required = true, value_name = "FOLDER")]
    pub folders: Vec<PathBuf>,
    /// Where the whole goes; rows of this sweep that are there already stay.
    #[command(flatten)]
    pub out: OutArgument,
    /// How the summary is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// What is printed for programs.
#[derive(Debug, Serialize)]
struct Told<'a> {
    scenario: &'a str,
    shard: Shard,
    /// Of the shard.
    runs: u64,
    found: u64,
    missing: u64,
    held: Option<u64>,
    failed: Option<u64>,
    made: Option<Cost>,
    folder: &'a Path,
}

/// What the runs cost that were made now.
#[derive(Debug, Clone, Copy, Serialize)]
struct Cost {
    runs: u64,
    threads: usize,
    took_s: f64,
    /// Of all threads together, without what lies between the runs.
    in_runs_s: f64,
}

impl Cost {
    /// The share of the threads' time that was not in runs.
    fn beside(&self) -> f64 {
        1.0 - self.in_runs_s / (self.took_s * self.threads as f64)
    }
}

/// Runs the command.
///
/// # Errors
/// A bad scenario or value, a folder of another sweep, or a result that cannot be written.
pub fn run(arguments: &SweepArguments) -> miette::Result<Ending> {
    signals::install();
    let own = &arguments.scenario;
    let sweep = Sweep::new(
        &own.scenario,
        &own.set.settings,
        arguments.vary.clone(),
        arguments.seeds,
        arguments.shard,
    )
    .map_err(told)?;
    let threads = arguments.threads.count();
    sweep.check(threads).map_err(told)?;
    let results = arguments.out.claim("sweep")?;
    let wanted = arguments.shard.count(sweep.plan().runs());
    let bar = long_bar(wanted, "sweep", "runs");
    let mut begun = false;
    let made = sweep.run(&results.path, threads, |found| {
        bar.set_position(found);
        if !std::mem::replace(&mut begun, true) {
            // What was there before says nothing of the time left.
            bar.reset_eta();
        }
    });
    bar.finish_and_clear();
    let Made {
        rows,
        new,
        threads,
        took_s,
        in_runs_s,
    } = made.map_err(told)?;
    let cost = (new > 0).then_some(Cost {
        runs: new,
        threads,
        took_s,
        in_runs_s,
    });
    let manifest = sweep.manifest();
    if rows.found() < rows.wanted() {
        if arguments.json.json {
            crate::say!("{}", summary(manifest, &rows, None, cost, &results.path)?);
        }
        let (found, wanted, folder) = (rows.found(), rows.wanted(), quoted(&results.path));
        crate::complain!("stopped: {found} of {wanted} runs are there; the same command with --out {folder} goes on");
        return Ok(Ending::ProcessFailed);
    }
    let findings = publish(&results.path, manifest, sweep.plan(), &rows).map_err(told)?;
    if arguments.json.json {
        crate::say!("{}", summary(manifest, &rows, Some(&findings), cost, &results.path)?);
        return Ok(Ending::Held);
    }
    print(sweep.plan(), &findings, cost);
    crate::say!(
        "results: {} (sweep.html, sweep.csv, sweep.parquet)",
        results.path.display()
    );
    Ok(Ending::Held)
}

/// Runs the command. Exit status 1 if runs are missing.
///
/// # Errors
/// Folders that are no parts of one sweep, or a result that cannot be written.
pub fn run_gather(arguments: &GatherArguments) -> miette::Result<Ending> {
    let results = arguments.out.claim("sweep")?;
    let gathered = gather(&arguments.folders, &results.path).map_err(told)?;
    let (manifest, plan, rows) = (&gathered.manifest, &gathered.plan, &gathered.rows);
    let missing = rows.wanted() - rows.found();
    let findings = match missing {
        0 => Some(publish(&results.path, manifest, plan, rows).map_err(told)?),
        _ => None,
    };
    if arguments.json.json {
        crate::say!("{}", summary(manifest, rows, findings.as_ref(), None, &results.path)?);
    }
    let Some(findings) = findings else {
        crate::complain!(
            "{missing} of {} runs are missing: {}; the sweep's own command with --out {} makes them",
            rows.wanted(),
            ranges(rows.missing()),
            quoted(&results.path)
        );
        return Ok(Ending::NotHeld);
    };
    if !arguments.json.json {
        print(plan, &findings, None);
        crate::say!(
            "results: {} (sweep.html, sweep.csv, sweep.parquet)",
            results.path.display()
        );
    }
    Ok(Ending::Held)
}

fn summary(
    manifest: &Manifest,
    rows: &Rows,
    findings: Option<&Findings>,
    made: Option<Cost>,
    folder: &Path,
) -> Result<String, RunError> {
    json(&Told {
        scenario: manifest.name(),
        shard: manifest.shard,
        runs: rows.wanted(),
        found: rows.found(),
        missing: rows.wanted() - rows.found(),
        held: findings.map(|own| own.whole.held),
        failed: findings.map(|own| own.failed),
        made,
        folder,
    })
}

fn print(plan: &Plan, findings: &Findings, cost: Option<Cost>) {
    let (whole, failed) = (&findings.whole, findings.failed);
    let of_failed = match failed {
        0 => String::new(),
        failed => format!(", {failed} did not come to their end"),
    };
    crate::say!("{} of {} runs held{of_failed}", whole.held, whole.runs);
    if let Some(table) = findings.table(plan, MOST_TOLD) {
        crate::say!("{}", table.terminal());
    }
    if let Some(cost) = cost {
        crate::say!(
            "{} runs made in {:.1} s on {} threads, {:.1} ms each, {:.1} % of their time beside the runs",
            cost.runs,
            cost.took_s,
            cost.threads,
            1e3 * cost.in_runs_s / cost.runs as f64,
            1e2 * cost.beside()
        );
    }
}

/// A disk that is full has an exit status of its own, which follows from the error of a run.
pub(super) fn told(error: SweepError) -> miette::Report {
    match error {
        SweepError::Write(cause) => cause.into(),
        other => other.into(),
    }
}
