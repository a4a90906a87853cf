//! All runs of a study summed up: classes, bars, confusion matrix, reliability, places, detection limits, timings.

use std::collections::BTreeMap;

use anhyst_diagnosis::Verdict;
use anhyst_witness::{Effect, Nuisance};
use serde::{Deserialize, Serialize};

use super::bars::{Bar, Share, bars};
use super::case::{Family, LIMIT_GAPS, Plan};
use super::outcome::{Interval, Outcome};
use super::places::{Axis, Places};
use super::run::{Said, StudyRun};

/// Of a share found, from the truth.
const CLOSE: f64 = 0.05;
const BINS: usize = 5;
/// From here on a gap must be named this often.
const NAMED: f64 = 0.9;
/// Gaps over noise of the levels: those of the sweep, and those of the other runs in octaves.
pub(super) const LEVELS: [f64; 9] = [
    LIMIT_GAPS[0],
    LIMIT_GAPS[1],
    LIMIT_GAPS[2],
    LIMIT_GAPS[3],
    LIMIT_GAPS[4],
    8.0,
    16.0,
    32.0,
    64.0,
];

/// Runs under one nuisance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Class {
    pub nuisance: String,
    /// Right, of those with one effect of the library, with two, with one that it does not hold.
    pub named: Share,
    pub pairs: Share,
    pub unlisted: Share,
    /// A wrong name without a flag, of all that hide something.
    pub wrong: Share,
    /// "Unknown" or nothing, of those with effects of the library.
    pub silent: Share,
    /// An effect, of those that hide nothing.
    pub false_alarms: Share,
    /// The nuisance called an effect of the library.
    pub beside: Share,
    /// Shares that are right, of the effects named.
    pub shares: Share,
    pub intervals: Share,
    /// Right by gap over noise, one effect, at [`LEVELS`], and the level from which on nine of ten are.
    pub levels: Vec<Share>,
    pub named_from: Option<f64>,
}

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

/// Shares, true and found, of hidden effects that were named where all was right.
fn found<'a>(runs: &'a [&'a StudyRun]) -> impl Iterator<Item = [f64; 2]> + 'a {
    let right = runs.iter().filter(|run| run.outcome.is_right());
    right
        .flat_map(|run| &run.hidden)
        .filter_map(|part| Some([part.share?, part.share_found?]))
}

impl Class {
    fn of(nuisance: Nuisance, runs: &[&StudyRun]) -> Self {
        let of = |families: &'static [Family]| runs.iter().filter(|run| families.contains(&run.family)).copied();
        let right = |run: &&StudyRun| run.outcome.is_right();
        let listed = &[Family::Single, Family::Pair];
        let counted: Vec<&StudyRun> = runs.iter().filter(|run| run.family != Family::Limit).copied().collect();
        let said = || counted.iter().filter_map(|run| run.said.as_ref());
        let levels: Vec<Share> = (0..LEVELS.len())
            .map(|level| {
                let own = of(&[Family::Single, Family::Limit]).filter(|run| level_of(run.gap_over_noise()) == level);
                Share::of(own, right)
            })
            .collect();
        Class {
            nuisance: nuisance.name().to_owned(),
            named: Share::of(of(&[Family::Single]), right),
            pairs: Share::of(of(&[Family::Pair]), right),
            unlisted: Share::of(of(&[Family::Unlisted]), right),
            wrong: Share::of(of(&[Family::Single, Family::Pair, Family::Unlisted]), |run| {
                run.outcome == Outcome::WrongName
            }),
            silent: Share::of(of(listed), |run| {
                matches!(run.outcome, Outcome::Unknown | Outcome::NotSeen)
            }),
            false_alarms: Share::of(of(&[Family::None]), |run| {
                run.said.as_ref().is_some_and(|said| !said.named.is_empty())
            }),
            beside: Share::of(said(), |said| !said.beside.is_empty()),
            shares: Share::of(found(&counted), |[truth, found]| (truth - found).abs() <= CLOSE),
            intervals: Share::of(said().flat_map(|said| &said.intervals), |own: &&Interval| own.covers()),
            named_from: named_from(&levels),
            levels,
        }
    }

    fn runs(&self) -> u64 {
        self.wrong.of + self.false_alarms.of + self.levels.iter().map(|own| own.of).sum::<u64>()
    }
}

/// The level that is nearest by ratio.
fn level_of(gap: f64) -> usize {
    let edges = LEVELS.windows(2).map(|pair| (pair[0] * pair[1]).sqrt());
    edges.take_while(|edge| gap > *edge).count()
}

fn named_from(levels: &[Share]) -> Option<f64> {
    let named = |own: &Share| own.of == 0 || own.value() >= NAMED;
    let from = levels.len() - levels.iter().rev().take_while(|own| named(own)).count();
    let lowest = (from..levels.len()).find(|level| levels[*level].of > 0)?;
    Some(LEVELS[lowest])
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

    /// Guards the levels' borders: a gap belongs to the level that is nearest by ratio.
    #[test]
    fn gaps_go_to_the_nearest_level() {
        for (place, gap) in LEVELS.into_iter().enumerate() {
            for near in [gap, 1.3 * gap, gap / 1.3] {
                assert_eq!(level_of(near), place);
            }
        }
        assert_eq!(level_of(100.0), LEVELS.len() - 1);
    }

    /// Guards limits: a hole above a level that was named takes the level with it, one without runs does not.
    #[test]
    fn a_limit_has_no_hole_above_it() {
        let share = |count, of| Share { count, of };
        let mut levels = [share(0, 0); LEVELS.len()];
        assert_eq!(named_from(&levels), None);
        (levels[1], levels[3], levels[6]) = (share(9, 10), share(5, 10), share(10, 10));
        assert_eq!(named_from(&levels), Some(LEVELS[6]));
        levels[3] = share(10, 11);
        assert_eq!(named_from(&levels), Some(LEVELS[1]));
        levels[8] = share(1, 2);
        assert_eq!(named_from(&levels), None);
    }

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
