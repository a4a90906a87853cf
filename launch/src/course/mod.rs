//! What a trajectory is judged by beyond its error: settling and overshoot of steps, straightness of lines, gain and phase over
//! frequency. One file per kind; all listen tick by tick, to the reference and the true displacement.

mod instant;
mod lines;
mod multisine;
mod response;
mod show;
mod steps;
mod sweep;

pub(crate) use instant::Instant;
pub use lines::LinesVerdict;
pub use multisine::{LineResponse, MultisineVerdict};
pub use steps::{StepVerdict, StepsVerdict};
pub use sweep::{Band, SweepVerdict};

use anhyst_controller::{Course, Trajectory};
use anhyst_scenario::Expect;
use lines::LinesJudge;
use multisine::MultisineJudge;
use serde::{Deserialize, Serialize};
use steps::StepsJudge;
use sweep::SweepJudge;

/// Who listens.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) enum CourseJudge {
    Steps(StepsJudge),
    Lines(LinesJudge),
    Sweep(SweepJudge),
    Multisine(MultisineJudge),
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CourseVerdict {
    /// Step by step.
    Steps(StepsVerdict),
    /// Of the lines of a triangle, a sawtooth or a raster.
    Lines(LinesVerdict),
    /// Band by band.
    Sweep(SweepVerdict),
    /// Line by line.
    Multisine(MultisineVerdict),
}

impl CourseJudge {
    /// None for a trajectory that is judged by its error alone.
    pub fn new(trajectory: &Trajectory, expect: &Expect, tick_s: f64) -> Option<Self> {
        Some(match trajectory.course() {
            Course::Path => return None,
            Course::Steps(steps) => Self::Steps(StepsJudge::new(steps, expect.tolerance_m, tick_s)),
            Course::Scan(scan) => Self::Lines(LinesJudge::new(scan, tick_s)),
            Course::Sweep(sweep) => Self::Sweep(SweepJudge::new(sweep)),
            Course::Multisine(multisine) => Self::Multisine(MultisineJudge::new(multisine)),
        })
    }

    /// Takes in an instant of this trajectory.
    pub fn observe(&mut self, trajectory: &Trajectory, instant: Instant) {
        match (self, trajectory.course()) {
            (Self::Steps(judge), Course::Steps(steps)) => judge.observe(steps, instant),
            (Self::Lines(judge), Course::Scan(scan)) => judge.observe(scan, instant),
            (Self::Sweep(judge), Course::Sweep(sweep)) => judge.observe(sweep, instant),
            (Self::Multisine(judge), Course::Multisine(multisine)) => judge.observe(multisine, instant),
            _ => {}
        }
    }

    pub fn verdict(&self) -> CourseVerdict {
        match self {
            Self::Steps(judge) => CourseVerdict::Steps(judge.verdict()),
            Self::Lines(judge) => CourseVerdict::Lines(judge.verdict()),
            Self::Sweep(judge) => CourseVerdict::Sweep(judge.verdict()),
            Self::Multisine(judge) => CourseVerdict::Multisine(judge.verdict()),
        }
    }
}

/// True where the error counts: not in a turn, nor on a way back that is of no use, nor while a step may still settle.
pub(crate) fn counts(trajectory: &Trajectory, expect: &Expect, time_s: f64) -> bool {
    match trajectory.course() {
        Course::Scan(scan) => scan.line(time_s).is_some(),
        Course::Steps(steps) => {
            let settling_s = expect.step_settling_s.unwrap_or(0.0);
            steps.begun(time_s).is_none_or(|(_, since_s)| since_s >= settling_s)
        }
        Course::Path | Course::Sweep(_) | Course::Multisine(_) => true,
    }
}

impl CourseVerdict {
    /// What did not hold, as sentences.
    pub fn failures(&self, expect: &Expect, unit: &str) -> Vec<String> {
        let mut failures = Vec::new();
        match self {
            Self::Steps(own) => own.refuse(expect, unit, &mut failures),
            Self::Lines(own) => own.refuse(expect, &mut failures),
            Self::Sweep(own) => own.refuse(expect, &mut failures),
            Self::Multisine(_) => {}
        }
        failures
    }
}
