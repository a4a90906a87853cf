//! Which runs a study makes: what is hidden under which nuisance, each from its own seed.
//!
//! Effects come round in turn, so that each is hidden equally often; everything else is drawn by the rig. A class is a nuisance with a
//! family. Its seeds do not depend on how many runs the others have: a longer study begins with the runs of a shorter.

use super::subject::Subject;
use anhyst_witness::{Effect, Nuisance, Wanted};
use serde::{Deserialize, Serialize};

/// Gaps over noise of the sweep for detection limits.
pub const LIMIT_GAPS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Seeds set aside for each class.
const SEEDS_OF_A_CLASS: u64 = 10_000;
/// Coprime to the numbers of effects: from one run to the next to another stage of the chain, and through all of them.
const STRIDE: usize = 7;

/// Why a run is in the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Nothing but the nuisance.
    None,
    /// One effect of the library.
    Single,
    /// Two at once.
    Pair,
    /// One effect that the library does not hold.
    Unlisted,
    /// One at a given gap, for detection limits.
    Limit,
}

impl Family {
    pub const ALL: [Family; 5] = [
        Family::None,
        Family::Single,
        Family::Pair,
        Family::Unlisted,
        Family::Limit,
    ];
}

/// One run to be made and diagnosed.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    pub nuisance: Nuisance,
    pub family: Family,
    /// Within the class.
    pub index: u64,
    pub seed: u64,
    pub wanted: Wanted,
}

/// How many runs of each family under each nuisance, and the first seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    pub none: u64,
    pub singles: u64,
    pub pairs: u64,
    pub unlisted: u64,
    /// Runs at each gap of [`LIMIT_GAPS`].
    pub limits: u64,
    pub first_seed: u64,
    /// Samples of a run.
    pub rows: usize,
}

impl Plan {
    /// Every run, class by class.
    pub fn cases(&self, subject: &Subject) -> Vec<Case> {
        let [listed, unlisted, of_two_laws] =
            [&Effect::LISTED[..], &Effect::UNLISTED, &Effect::OF_TWO_LAWS].map(|all| subject.effects(all));
        let classes = Nuisance::ALL.into_iter().enumerate();
        let classes = classes.flat_map(|(place, nuisance)| Family::ALL.map(|family| (place, nuisance, family)));
        classes
            .flat_map(|(place, nuisance, family)| {
                let effects = match (nuisance, family) {
                    (_, Family::Unlisted) => &unlisted,
                    (Nuisance::OtherLaw, _) => &of_two_laws,
                    _ => &listed,
                };
                (0..self.runs(nuisance, family)).map(move |index| self.case(place, nuisance, family, index, effects))
            })
            .collect()
    }

    fn runs(&self, nuisance: Nuisance, family: Family) -> u64 {
        match family {
            // Another law is one of a hidden effect.
            Family::None | Family::Unlisted if nuisance == Nuisance::OtherLaw => 0,
            Family::None => self.none,
            Family::Single => self.singles,
            Family::Pair => self.pairs,
            Family::Unlisted => self.unlisted,
            Family::Limit => self.limits * LIMIT_GAPS.len() as u64,
        }
    }

    fn case(&self, place: usize, nuisance: Nuisance, family: Family, index: u64, effects: &[Effect]) -> Case {
        let level = index as usize % LIMIT_GAPS.len();
        let (turn, gap_over_noise) = match family {
            Family::Limit => (index as usize / LIMIT_GAPS.len(), Some(LIMIT_GAPS[level])),
            _ => (index as usize, None),
        };
        let first = (STRIDE * turn + 5 * place) % effects.len();
        let other = (first + 1 + (5 * turn + place) % (effects.len() - 1)) % effects.len();
        let hidden = match family {
            Family::None => Vec::new(),
            Family::Pair => vec![effects[first], effects[other]],
            _ => vec![effects[first]],
        };
        let class = (place * Family::ALL.len() + family as usize) as u64;
        Case {
            nuisance,
            family,
            index,
            seed: self.first_seed + class * SEEDS_OF_A_CLASS + index,
            wanted: Wanted {
                effects: hidden,
                nuisance,
                drive: None,
                gap_over_noise,
                rows: self.rows,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::ActuatorModel;

    fn usual() -> Subject {
        Subject::of(ActuatorModel::terfenol_d()).unwrap()
    }

    fn plan(singles: u64) -> Plan {
        Plan {
            none: 2,
            singles,
            pairs: 40,
            unlisted: 6,
            limits: 2,
            first_seed: 900_000,
            rows: 1000,
        }
    }

    /// Guards resuming: a longer study must hold the runs of a shorter unchanged, and no seed twice.
    #[test]
    fn a_longer_study_continues_a_shorter() {
        let (short, long) = (plan(5).cases(&usual()), plan(70).cases(&usual()));
        assert!(short.iter().all(|case| long.contains(case)));
        let mut seeds: Vec<u64> = long.iter().map(|case| case.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), long.len());
    }

    /// Guards fairness: under every nuisance every effect is hidden that can be, and pairs are of two.
    #[test]
    fn every_effect_is_hidden_under_every_nuisance() {
        let cases = plan(Effect::LISTED.len() as u64).cases(&usual());
        let there = |nuisance: Nuisance, family: Family, effect: &Effect| {
            let mut own = cases
                .iter()
                .filter(|own| own.nuisance == nuisance && own.family == family);
            own.any(|own| own.wanted.effects == [*effect])
        };
        for nuisance in Nuisance::ALL {
            let (listed, unlisted): (&[Effect], &[Effect]) = match nuisance {
                Nuisance::OtherLaw => (&Effect::OF_TWO_LAWS, &[]),
                _ => (&Effect::LISTED, &Effect::UNLISTED),
            };
            assert!(listed.iter().all(|effect| there(nuisance, Family::Single, effect)));
            assert!(unlisted.iter().all(|effect| there(nuisance, Family::Unlisted, effect)));
        }
        let mut pairs = cases.iter().filter(|case| case.family == Family::Pair);
        assert!(pairs.all(|case| case.wanted.effects[0] != case.wanted.effects[1]));
    }
}
