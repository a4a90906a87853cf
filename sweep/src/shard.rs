//! A part of a sweep for one machine of several: every n-th run.

use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// `i/n`, i from 1: the runs whose index divided by n leaves i - 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub number: u64,
    /// How many there are.
    pub of: u64,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether a run belongs to it.
    pub fn has(self, index: u64) -> bool {
        index % self.of == self.number - 1
    }

    /// How many of so many runs belong to it.
    pub fn count(self, runs: u64) -> u64 {
        (runs + self.of - self.number) / self.of
    }

    /// The indices of its runs, of so many.
    pub fn indices(self, runs: u64) -> impl Iterator<Item = u64> {
        (self.number - 1..runs).step_by(usize::try_from(self.of).unwrap_or(usize::MAX))
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/');
        let numbers = parts.and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            Some((number, of)) => Err(format!(
                "{number}/{of}: the first shard of {of} is 1/{of}, the last {of}/{of}"
            )),
            None => Err(format!("{text} is no shard; write 1/8 for the first of eight")),
        }
    }
}

impl Display for Shard {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.number, self.of)
    }
}

/// Rising numbers in words, `0-4, 7`; of many ranges the first ten.
pub fn ranges(numbers: impl Iterator<Item = u64>) -> String {
    let mut ranges: Vec<RangeInclusive<u64>> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some(last) if last.end() + 1 == number => *last = *last.start()..=number,
            _ => ranges.push(number..=number),
        }
    }
    let told = ranges.iter().take(10).map(|range| match range.end() - range.start() {
        0 => range.start().to_string(),
        _ => format!("{}-{}", range.start(), range.end()),
    });
    let told: Vec<String> = told.collect();
    let more = if ranges.len() > 10 { ", …" } else { "" };
    format!("{}{more}", told.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Guards that shards are a sweep: each run in one of them, whatever their number.
        #[test]
        fn every_run_is_in_one_shard(runs in 0_u64..60, of in 1_u64..20) {
            let shards: Vec<Shard> = (1..=of).map(|number| Shard { number, of }).collect();
            let mut all: Vec<u64> = shards.iter().flat_map(|shard| shard.indices(runs)).collect();
            all.sort_unstable();
            prop_assert_eq!(all, (0..runs).collect::<Vec<_>>());
            for shard in shards {
                prop_assert_eq!(shard.count(runs), shard.indices(runs).count() as u64);
                prop_assert!(shard.indices(runs).all(|index| shard.has(index)));
            }
        }
    }

    #[test]
    fn shards_count_from_one() {
        assert_eq!("3/8".parse(), Ok(Shard { number: 3, of: 8 }));
        for wrong in ["0/8", "9/8", "1/0", "3", "a/b", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_are_told_as_ranges() {
        assert_eq!(ranges([0, 1, 2, 5, 7, 8].into_iter()), "0-2, 5, 7-8");
        assert!(ranges((0..40).step_by(2)).ends_with("18, …"));
    }
}
