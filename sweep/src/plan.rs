//! Which runs a sweep has: every combination of the values, each under every seed; the last value changes fastest, the seed faster.

use crate::error::SweepError;
use crate::variation::Variation;
use anhyst_scenario::Setting;

/// Of this many runs eight bytes each are kept in memory.
const MOST_RUNS: u64 = 10_000_000;

/// What varies, and under how many seeds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    variations: Vec<Variation>,
    seeds: u64,
    first_seed: u64,
    runs: u64,
}

impl Plan {
    /// Under `seeds` seeds from `first_seed` on.
    ///
    /// # Errors
    /// A path that varies twice, no run, or too many.
    pub fn new(variations: Vec<Variation>, seeds: u64, first_seed: u64) -> Result<Self, SweepError> {
        let refuse = |sentence| Err(SweepError::Refused(sentence));
        for (place, own) in variations.iter().enumerate() {
            if variations[..place].iter().any(|other| other.path == own.path) {
                return refuse(format!("{} has two --vary; it can have one", own.path));
            }
        }
        let counts = variations.iter().map(|own| own.values.len() as u64);
        let runs = counts.fold(seeds, u64::saturating_mul);
        if !(1..=MOST_RUNS).contains(&runs) {
            return refuse(format!("{runs} runs are asked for; a sweep has 1 to {MOST_RUNS}"));
        }
        if first_seed.checked_add(seeds - 1).is_none() {
            return refuse(format!("{seeds} seeds from {first_seed} on are more than there are"));
        }
        Ok(Self {
            variations,
            seeds,
            first_seed,
            runs,
        })
    }

    /// How many runs there are.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// Runs at each combination of values.
    pub fn seeds(&self) -> u64 {
        self.seeds
    }

    /// What varies.
    pub fn variations(&self) -> &[Variation] {
        &self.variations
    }

    /// Of each variation the place of a run's value in its list.
    pub fn places(&self, index: u64) -> Vec<usize> {
        let mut rest = index / self.seeds;
        let mut places: Vec<usize> = Vec::with_capacity(self.variations.len());
        for variation in self.variations.iter().rev() {
            let count = variation.values.len() as u64;
            places.push((rest % count) as usize);
            rest /= count;
        }
        places.reverse();
        places
    }

    /// The seed of a run.
    pub fn seed(&self, index: u64) -> u64 {
        self.first_seed + index % self.seeds
    }

    /// What makes the scenario be that of a run.
    pub fn settings(&self, index: u64) -> Vec<Setting> {
        let seed = Setting {
            path: "seed".into(),
            value: self.seed(index).to_string(),
        };
        let varied = self.variations.iter().zip(self.places(index));
        varied
            .map(|(variation, place)| variation.setting(place))
            .chain([seed])
            .collect()
    }

    /// Runs that have, together, each value of each variation: the others at their first.
    pub fn each_value_once(&self) -> Vec<u64> {
        let mut stride = self.runs;
        let mut indices = vec![0];
        for variation in &self.variations {
            let count = variation.values.len() as u64;
            stride /= count;
            indices.extend((1..count).map(|place| place * stride));
        }
        indices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Plan {
        let variations = ["a=1..2:2", "b=[x, y, z]"].map(|text| text.parse().unwrap());
        Plan::new(variations.to_vec(), 4, 10).unwrap()
    }

    /// Guards the index, which is all that a row says of what varied.
    #[test]
    fn an_index_tells_what_varied() {
        let plan = plan();
        let told = |index| -> Vec<String> { plan.settings(index).into_iter().map(|own| own.value).collect() };
        assert_eq!(plan.runs(), 24);
        assert_eq!(told(0), ["1", "x", "10"]);
        assert_eq!(told(3), ["1", "x", "13"]);
        assert_eq!(told(4), ["1", "y", "10"]);
        assert_eq!(told(23), ["2", "z", "13"]);
        let all: std::collections::BTreeSet<Vec<String>> = (0..24).map(told).collect();
        assert_eq!(all.len(), 24);
    }

    #[test]
    fn each_value_is_looked_at_before_anything_runs() {
        let plan = plan();
        let seen: Vec<Vec<usize>> = plan.each_value_once().iter().map(|index| plan.places(*index)).collect();
        assert_eq!(seen, [[0, 0], [1, 0], [0, 1], [0, 2]]);
    }

    #[test]
    fn too_many_runs_and_none_are_refused() {
        let new = |texts: &[&str], seeds, first| {
            let variations = texts.iter().map(|text| text.parse().unwrap()).collect();
            Plan::new(variations, seeds, first).is_ok()
        };
        assert!(new(&[], 1, 0));
        assert!(!new(&[], 0, 0));
        assert!(!new(&["a=1..2:5000", "b=1..2:5000"], 1, 0));
        assert!(!new(&["a=1..2:2", "a=1..2:3"], 1, 0));
        assert!(!new(&[], 2, u64::MAX));
    }
}
