//! All runs of a study summed up: classes, bars, confusion matrix, reliability, places, detection limits, timings.

use std::collections::BTreeMap;

use anhyst_diagnosis::Verdict;
use anhyst_witness::{Effect, Nuisance};
use serde::{Deserialize, Serialize};

use super::bars::{Bar, bars};
use super::case::{Family, Plan};
use super::class::{Class, found};
use super::outcome::Outcome;
use super::places::{Axis, Places};
use super::run::{Said, StudyRun};
use super::share::Share;

const BINS: usize = 5;
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

/// Answers of like confidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Mean of what is stated.
    pub stated: f64,
    /// Right.
    pub reached: Share,
}

/// The study's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    pub plan: Plan,
    pub model: String,
    pub bars: Vec<Bar>,
    pub classes: Vec<Class>,
    pub confusion: Vec<ConfusionRow>,
    /// Of answers that name something, and of all others.
    pub reliability: [Vec<Bin>; 2],
    pub places: Vec<Places>,
    /// Share of the gap, true and found, of each effect named.
    pub shares: Vec<[f64; 2]>,
    /// Of one diagnosis on one thread, by the wall clock, s.
    pub median_seconds: f64,
    pub longest_seconds: f64,
    /// Runs that are not right, in the order of the plan.
    pub not_right: Vec<StudyRun>,
}

impl Results {
    /// Sums up; `runs` in any order.
    pub fn new(plan: Plan, model: &str, mut runs: Vec<StudyRun>) -> Self {
        runs.sort_by_key(|run| run.seed);
        let said = || runs.iter().filter_map(|run| run.said.as_ref());
        let mut seconds: Vec<f64> = said().map(|said| said.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let classes = Nuisance::ALL.map(|nuisance| {
            let own = runs.iter().filter(|run| run.nuisance == nuisance.name());
            Class::of(nuisance, &own.collect::<Vec<_>>())
        });
        let counted: Vec<&StudyRun> = runs.iter().filter(|run| run.family != Family::Limit).collect();
        let places = Axis::ALL.map(|axis| {
            let own = said().flat_map(|said| &said.places).filter(|own| own.axis == axis);
            let sum = |of: fn(&Places) -> u64| own.clone().map(of).sum();
            Places {
                axis,
                claimed: sum(|own| own.claimed),
                there: sum(|own| own.there),
                right: sum(|own| own.right),
            }
        });
        Results {
            plan,
            model: model.to_owned(),
            bars: bars(&classes),
            confusion: confusion(&counted),
            reliability: [true, false].map(|names| reliability(&counted, names)),
            places: places.to_vec(),
            shares: found(&counted).collect(),
            median_seconds: seconds.get(seconds.len() / 2).copied().unwrap_or_default(),
            longest_seconds: seconds.last().copied().unwrap_or_default(),
            classes: classes.into_iter().filter(|own| own.runs() > 0).collect(),
            not_right: runs.into_iter().filter(|run| !run.outcome.is_right()).collect(),
        }
    }

    /// Whether every bar with runs to judge by held.
    pub fn held(&self) -> bool {
        self.bars.iter().all(|bar| bar.held != Some(false))
    }
}

/// True effects in the order of the chain, then none, unlisted effects and pairs.
fn confusion(runs: &[&StudyRun]) -> Vec<ConfusionRow> {
    let name = |run: &StudyRun| match run.family {
        Family::Pair => "pairs".to_owned(),
        _ => run.truth(),
    };
    let effects = Effect::LISTED.into_iter().chain(Effect::UNLISTED);
    let rows = effects.map(Effect::name).chain(["pairs", "none"]);
    let counted = |truth: &str| {
        let own: Vec<&&StudyRun> = runs.iter().filter(|run| name(run) == truth).collect();
        let outcomes = Outcome::ALL.map(|outcome| own.iter().filter(|run| run.outcome == outcome).count() as u64);
        let mut taken_for = BTreeMap::new();
        for run in &own {
            if let (Outcome::WrongName | Outcome::TieWithoutTruth, Some(said)) = (run.outcome, &run.said) {
                *taken_for.entry(said.named.join(" + ")).or_default() += 1;
            }
        }
        ConfusionRow {
            runs: own.len() as u64,
            truth: truth.to_owned(),
            outcomes: outcomes.to_vec(),
            taken_for,
        }
    };
    rows.map(counted).filter(|row| row.runs > 0).collect()
}

/// Bins of equal width; empty ones are left out.
fn reliability(runs: &[&StudyRun], names: bool) -> Vec<Bin> {
    let named = |said: &Said| !matches!(said.verdict, Verdict::None | Verdict::NotExcited | Verdict::Unknown);
    let stated = |run: &StudyRun| {
        run.said
            .as_ref()
            .filter(|said| named(said) == names)
            .map(|said| said.confidence)
    };
    let bin = |confidence: f64| ((confidence * BINS as f64) as usize).min(BINS - 1);
    let bins = (0..BINS).filter_map(|place| {
        let own = runs
            .iter()
            .filter(|run| stated(run).is_some_and(|own| bin(own) == place));
        let reached = Share::of(own.clone(), |run| run.outcome.is_right());
        let sum: f64 = own.filter_map(|run| stated(run)).sum();
        (reached.of > 0).then(|| Bin {
            stated: sum / reached.of as f64,
            reached,
        })
    });
    bins.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards against passing by having measured nothing.
    #[test]
    fn nothing_counted_is_nothing_held() {
        let plan = Plan {
            none: 0,
            singles: 0,
            pairs: 0,
            unlisted: 0,
            limits: 0,
            first_seed: 1,
            rows: 1000,
        };
        let results = Results::new(plan, "", Vec::new());
        assert!(results.bars.iter().all(|bar| bar.held.is_none()));
    }
}
