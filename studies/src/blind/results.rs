//! All runs of a study summed up: bars, confusion matrix, detection limits, timings.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::bars::{Bar, bars};
use super::case::{Family, Plan, listed};
use super::limits::{Limit, limits};
use super::outcome::Outcome;
use super::run::StudyRun;
use super::unlisted::Unlisted;

/// What became of one truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfusionRow {
    pub truth: String,
    pub runs: u64,
    /// In the order of [`Outcome::ALL`].
    pub outcomes: Vec<u64>,
    /// Names given instead of the truth, or tied without it, and how often.
    pub taken_for: BTreeMap<String, u64>,
}

/// The study's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    pub plan: Plan,
    pub model: String,
    pub bars: Vec<Bar>,
    pub confusion: Vec<ConfusionRow>,
    pub limits: Vec<Limit>,
    /// Of one diagnosis on one thread, by the wall clock, s.
    pub median_seconds: f64,
    pub longest_seconds: f64,
    /// Runs that are not right, in the order of the plan.
    pub not_right: Vec<StudyRun>,
}

impl Results {
    /// Sums up; `runs` in any order.
    pub fn new(plan: Plan, model: &str, mut runs: Vec<StudyRun>) -> Self {
        runs.sort_by_key(|run| (run.family, run.index));
        let mut seconds: Vec<f64> = runs.iter().map(|run| run.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        Results {
            plan,
            model: model.to_owned(),
            bars: bars(&runs),
            confusion: confusion(&runs),
            limits: limits(&runs),
            median_seconds: seconds.get(seconds.len() / 2).copied().unwrap_or_default(),
            longest_seconds: seconds.last().copied().unwrap_or_default(),
            not_right: runs.into_iter().filter(|run| !run.outcome.is_right()).collect(),
        }
    }

    /// Whether every bar with runs to judge by held.
    pub fn held(&self) -> bool {
        self.bars.iter().all(|bar| bar.held != Some(false))
    }
}

/// True effects in the order of the library, then none, unlisted effects and pairs; without the sweep for limits.
fn confusion(runs: &[StudyRun]) -> Vec<ConfusionRow> {
    let pairs = "pairs".to_owned();
    let name = |run: &StudyRun| match run.family {
        Family::Pair => pairs.clone(),
        _ => run.truth_name(),
    };
    let mut rows: Vec<String> = listed().iter().map(|term| term.name().to_owned()).collect();
    rows.push("none".to_owned());
    rows.extend(Unlisted::ALL.map(|own| own.name().to_owned()));
    rows.extend([pairs.clone(), "not made".to_owned()]);
    let counted = |truth: String| {
        let own = runs
            .iter()
            .filter(|run| run.family != Family::Limit && name(run) == truth);
        let own: Vec<&StudyRun> = own.collect();
        let outcomes = Outcome::ALL.map(|outcome| own.iter().filter(|run| run.outcome == outcome).count() as u64);
        let mut taken_for = BTreeMap::new();
        for run in &own {
            if matches!(run.outcome, Outcome::WrongName | Outcome::TieWithoutTruth) {
                *taken_for.entry(run.named.join(" + ")).or_default() += 1;
            }
        }
        ConfusionRow {
            runs: own.len() as u64,
            truth,
            outcomes: outcomes.to_vec(),
            taken_for,
        }
    };
    rows.into_iter().map(counted).filter(|row| row.runs > 0).collect()
}
