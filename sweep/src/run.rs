//! The runs of a sweep in this process, on several threads, each kept when it is done.

use crate::error::SweepError;
use crate::journal::Journal;
use crate::manifest::Manifest;
use crate::plan::Plan;
use crate::publish::{ROWS, keep_manifest};
use crate::row::Row;
use crate::rows::Rows;
use crate::shard::Shard;
use crate::variation::Variation;
use anhyst_identify::parallel;
use anhyst_ipc::stop_requested;
use anhyst_launch::embedded::{assembled, judged};
use anhyst_launch::summary::Summary;
use anhyst_scenario::{Placement, Scenario, ScenarioText, Setting};
use std::fs::File;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A scenario and what varies in it.
#[derive(Debug)]
pub struct Sweep {
    text: ScenarioText,
    plan: Plan,
    manifest: Manifest,
}

/// What came of the runs that were missing.
#[derive(Debug)]
pub struct Made {
    /// All rows that are there now.
    pub rows: Rows,
    /// How many are new.
    pub new: u64,
    /// That worked side by side.
    pub threads: usize,
    /// From the first new run to the last, s.
    pub took_s: f64,
    /// Of it in runs, from their values to what they came to, all threads together, s.
    pub in_runs_s: f64,
}

impl Sweep {
    /// Reads the scenario, and sees that every value suits it: nothing has run when one is refused.
    ///
    /// # Errors
    /// What is wrong with the scenario or a value.
    pub fn new(
        path: &Path,
        settings: &[Setting],
        variations: Vec<Variation>,
        seeds: u64,
        shard: Shard,
    ) -> Result<Self, SweepError> {
        let text = ScenarioText::read(path, settings)?;
        let scenario = embedded(&text)?;
        let plan = Plan::new(variations, seeds, scenario.seed)?;
        let manifest = Manifest::new(&plan, shard, &scenario)?;
        Ok(Self { text, plan, manifest })
    }

    /// Sees that each value suits the scenario, the other values at their first.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self, threads: usize) -> Result<(), SweepError> {
        let mut refused: Option<(usize, SweepError)> = None;
        let looked_at = self.plan.each_value_once();
        parallel::each(
            threads,
            looked_at.iter().enumerate(),
            |(place, index)| (place, self.buildable(*index)),
            |(place, outcome)| match outcome {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    if refused.as_ref().is_none_or(|(first, _)| place < *first) {
                        refused = Some((place, error));
                    }
                    ControlFlow::Break(())
                }
            },
        );
        refused.map_or(Ok(()), |(_, error)| Err(error))
    }

    fn buildable(&self, index: u64) -> Result<(), SweepError> {
        let scenario = self.scenario(index)?;
        assembled(&scenario).map_err(|error| {
            let varied = self.plan.settings(index).into_iter();
            let varied: Vec<String> = varied.map(|own| format!("{}={}", own.path, own.value)).collect();
            SweepError::Refused(format!("with {}: {error}", varied.join(" ")))
        })
    }

    /// Which runs there are.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What it is.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Makes the runs that the folder lacks, until all are there or the program is asked to stop. `progress` hears how many are
    /// there.
    ///
    /// # Errors
    /// A folder of another sweep, or a row that cannot be kept.
    pub fn run(&self, folder: &Path, threads: usize, mut progress: impl FnMut(u64) + Send) -> Result<Made, SweepError> {
        keep_manifest(folder, &self.manifest)?;
        let path = folder.join(ROWS);
        let made = File::options().create(true).append(true).open(&path);
        made.map_err(SweepError::write(&path))?;
        let mut rows = Rows::new(self.manifest.shard, self.plan.runs());
        let file = rows.file(&path)?;
        let mut noted = Ok(());
        let mut journal = Journal::open(&path, |row: Row, at| {
            if noted.is_ok() {
                noted = rows.note(&row, file, at);
            }
        })?;
        noted?;
        progress(rows.found());
        let missing: Vec<u64> = rows.missing().collect();
        let threads = threads.min(missing.len());
        let (in_runs_ns, begin) = (AtomicU64::new(0), Instant::now());
        let (mut new, mut kept) = (0, Ok(()));
        parallel::each(
            threads,
            missing.into_iter().take_while(|_| !stop_requested()),
            |index| self.row(index, &in_runs_ns),
            |row| {
                // A run that was broken off says nothing of the scenario.
                let Some(row) = row else { return ControlFlow::Break(()) };
                kept = journal.append(&row).and_then(|at| rows.note(&row, file, at));
                new += u64::from(kept.is_ok());
                progress(rows.found());
                match kept {
                    Ok(()) => ControlFlow::Continue(()),
                    Err(_) => ControlFlow::Break(()),
                }
            },
        );
        kept?;
        Ok(Made {
            rows,
            new,
            threads,
            took_s: begin.elapsed().as_secs_f64(),
            in_runs_s: in_runs_ns.into_inner() as f64 * 1e-9,
        })
    }

    fn scenario(&self, index: u64) -> Result<Scenario, SweepError> {
        let text = self.text.changed(&self.plan.settings(index), "--vary")?;
        embedded(&text)
    }

    /// What a run comes to; none if it was broken off. One whose values do not suit each other, or that panics, is a failed run and
    /// not the end of the sweep.
    fn row(&self, index: u64, in_runs_ns: &AtomicU64) -> Option<Row> {
        let seed = self.plan.seed(index);
        let begin = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| self.made(index)));
        in_runs_ns.fetch_add(begin.elapsed().as_nanos() as u64, Ordering::Relaxed);
        match outcome {
            Ok(Ok(summary)) => Some(Row::of(index, seed, &summary)),
            Ok(Err(_)) if stop_requested() => None,
            Ok(Err(error)) => Some(Row::failed(index, seed, error.to_string())),
            Err(_) => Some(Row::failed(index, seed, "the run panicked".into())),
        }
    }

    /// All that `anhyst run` does for one, too.
    fn made(&self, index: u64) -> Result<Summary, SweepError> {
        let scenario = self.scenario(index)?;
        let reports = judged(&scenario).map_err(SweepError::Run)?;
        Ok(Summary::new(&scenario, &reports))
    }
}

/// As a run of a sweep is: in this process, in lockstep, unrecorded.
fn embedded(text: &ScenarioText) -> Result<Scenario, SweepError> {
    let scenario = text.checked(|scenario| {
        scenario.placement = Placement::Embedded;
        scenario.external.clear();
        scenario.recording.on = false;
    })?;
    if scenario.clock.realtime().is_some() {
        return Err(SweepError::Refused(format!(
            "{}: the clock is {}, and the runs of a sweep are in lockstep, so that no machine's speed is in them: \
             --set 'clock=Lockstep(receive_limit_s: 2.0)'",
            scenario.name,
            scenario.clock.name()
        )));
    }
    Ok(scenario)
}
