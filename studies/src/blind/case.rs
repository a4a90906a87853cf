//! Which runs a study makes: what is hidden and how large, each from its own seed.
//!
//! Single effects come round in turn, so that each is hidden equally often; everything else is drawn. Gaps are drawn uniformly
//! in the logarithm. A family's seeds do not depend on how many runs the others have: a longer study begins with the runs of a shorter.

use anhyst_model::{EffectKind, NominalParameter};
use serde::{Deserialize, Serialize};

use super::draw::Draw;
use super::unlisted::Unlisted;
use anhyst_diagnosis::Term;

/// Gap over noise of single effects; for what is beside or beyond them, at least the noise.
const SINGLE_GAPS: [f64; 2] = [0.3, 30.0];
const OTHER_GAPS: [f64; 2] = [1.0, 30.0];
/// Gaps over noise of the sweep for detection limits.
pub const LIMIT_GAPS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Seeds set aside for each family.
const SEEDS_OF_A_FAMILY: u64 = 100_000;
/// Stream of the draws that decide what is hidden.
const HIDDEN_STREAM: u64 = 70;

/// Why a run is in the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// One effect of the library, or another value of a nominal parameter.
    Single,
    /// Nothing.
    None,
    /// One effect that the library does not hold.
    Unlisted,
    /// Two at once.
    Pair,
    /// One at a given gap, for detection limits.
    Limit,
}

/// What is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Hidden {
    Nothing,
    Terms([Option<Term>; 2]),
    Unlisted(Unlisted),
}

/// One run to be made and diagnosed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    pub family: Family,
    /// Within the family.
    pub index: u64,
    pub seed: u64,
    pub(super) hidden: Hidden,
    /// Gap over noise of each part.
    pub(super) gaps: [f64; 2],
}

/// How many runs of each family, and the first seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    pub singles: u64,
    pub none: u64,
    pub unlisted: u64,
    pub pairs: u64,
    /// Runs for each effect and gap of [`LIMIT_GAPS`].
    pub limits: u64,
    pub first_seed: u64,
    /// Samples of a run.
    pub rows: usize,
}

/// Everything that the library and the nominal model can be told to lack.
pub(super) fn listed() -> Vec<Term> {
    let effects = EffectKind::ALL.into_iter().map(Term::Effect);
    effects
        .chain(NominalParameter::ALL.into_iter().map(Term::Parameter))
        .collect()
}

impl Plan {
    /// Every run, family by family.
    pub fn cases(&self) -> Vec<Case> {
        let terms = listed();
        let of_each = |all: u64, family: Family| (0..all).map(move |index| (family, index));
        let sweep = self.limits * (terms.len() * LIMIT_GAPS.len()) as u64;
        of_each(self.singles, Family::Single)
            .chain(of_each(self.none, Family::None))
            .chain(of_each(self.unlisted, Family::Unlisted))
            .chain(of_each(self.pairs, Family::Pair))
            .chain(of_each(sweep, Family::Limit))
            .map(|(family, index)| self.case(&terms, family, index))
            .collect()
    }

    fn case(&self, terms: &[Term], family: Family, index: u64) -> Case {
        let seed = self.first_seed + family as u64 * SEEDS_OF_A_FAMILY + index;
        let mut draw = Draw::new(seed, HIDDEN_STREAM);
        let mut gap = |[low, high]: [f64; 2]| draw.log_between(low, high);
        let turn = |length: usize| (index % length as u64) as usize;
        let (hidden, gaps) = match family {
            Family::None => (Hidden::Nothing, [0.0; 2]),
            Family::Single => (
                Hidden::Terms([Some(terms[turn(terms.len())]), None]),
                [gap(SINGLE_GAPS), 0.0],
            ),
            Family::Limit => {
                let level = (index as usize / terms.len()) % LIMIT_GAPS.len();
                (
                    Hidden::Terms([Some(terms[turn(terms.len())]), None]),
                    [LIMIT_GAPS[level], 0.0],
                )
            }
            Family::Unlisted => {
                let own = Unlisted::ALL[turn(Unlisted::ALL.len())];
                (Hidden::Unlisted(own), [gap(OTHER_GAPS), 0.0])
            }
            Family::Pair => {
                let gaps = [gap(OTHER_GAPS), gap(OTHER_GAPS)];
                let one = draw.one_of(terms);
                let others: Vec<Term> = terms.iter().copied().filter(|term| *term != one).collect();
                (Hidden::Terms([Some(one), Some(draw.one_of(&others))]), gaps)
            }
        };
        Case {
            family,
            index,
            seed,
            hidden,
            gaps,
        }
    }
}

impl Case {
    /// Names of what is hidden; none for nothing.
    pub fn truth(&self) -> Vec<String> {
        match self.hidden {
            Hidden::Nothing => Vec::new(),
            Hidden::Terms(terms) => terms.iter().flatten().map(|term| term.name().to_owned()).collect(),
            Hidden::Unlisted(own) => vec![own.name().to_owned()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(singles: u64) -> Plan {
        Plan {
            singles,
            none: 2,
            unlisted: 3,
            pairs: 40,
            limits: 0,
            first_seed: 900_000,
            rows: 1000,
        }
    }

    /// Guards resuming: a longer study must hold the runs of a shorter unchanged, and no seed twice.
    #[test]
    fn a_longer_study_continues_a_shorter() {
        let (short, long) = (plan(5).cases(), plan(70).cases());
        assert_eq!(short[..5], long[..5]);
        assert_eq!(short[5..], long[70..]);
        let mut seeds: Vec<u64> = long.iter().map(|case| case.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), long.len());
    }

    /// Guards fairness: every term is hidden, gaps keep to their limits, pairs are of two.
    #[test]
    fn every_term_is_hidden() {
        let cases = plan(listed().len() as u64).cases();
        for term in listed() {
            assert!(cases.iter().any(|case| case.truth() == [term.name()]), "{term}");
        }
        for case in &cases {
            match case.family {
                Family::Single => assert!((0.3..=30.0).contains(&case.gaps[0])),
                Family::Pair => {
                    assert!(case.gaps.iter().all(|gap| (1.0..=30.0).contains(gap)));
                    assert!(case.truth().len() == 2 && case.truth()[0] != case.truth()[1]);
                }
                _ => (),
            }
        }
    }
}
