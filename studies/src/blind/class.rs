//! Runs under one nuisance, counted.

use anhyst_witness::Nuisance;
use serde::{Deserialize, Serialize};

use super::case::{Family, LIMIT_GAPS};
use super::outcome::{Interval, Outcome};
use super::run::StudyRun;
use super::share::Share;

/// Of a share found, from the truth.
const CLOSE: f64 = 0.05;
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

impl Class {
    pub(super) fn of(nuisance: Nuisance, runs: &[&StudyRun]) -> Self {
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

    pub(super) fn runs(&self) -> u64 {
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

/// Shares, true and found, of hidden effects that were named where all was right.
pub(super) fn found<'a>(runs: &'a [&'a StudyRun]) -> impl Iterator<Item = [f64; 2]> + 'a {
    let right = runs.iter().filter(|run| run.outcome.is_right());
    right
        .flat_map(|run| &run.hidden)
        .filter_map(|part| Some([part.share?, part.share_found?]))
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
}
