//! Shares of runs with their 95 % intervals, and what they must reach.
//!
//! Interval of a share k/n: Wilson (1927), (p + z²/2n ± z √(p(1 − p)/n + z²/4n²)) / (1 + z²/n), p = k/n, z = 1.96.

use serde::{Deserialize, Serialize};

use super::case::Family;
use super::outcome::{Interval, Outcome};
use super::run::StudyRun;

const Z: f64 = 1.959_963_985;
/// Gap over noise from which a name must be right.
const GAP_THAT_COUNTS: f64 = 1.0;

/// k of n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    pub count: u64,
    pub of: u64,
}

impl Share {
    pub(super) fn of<T>(items: impl Iterator<Item = T>, counts: impl Fn(&T) -> bool) -> Self {
        items.fold(Share::default(), |share, item| Share {
            count: share.count + u64::from(counts(&item)),
            of: share.of + 1,
        })
    }

    /// NaN of nothing.
    pub fn value(self) -> f64 {
        self.count as f64 / self.of as f64
    }

    /// 95 % interval.
    pub fn interval(self) -> [f64; 2] {
        let (n, p) = (self.of as f64, self.value());
        if self.of == 0 {
            return [0.0, 1.0];
        }
        let middle = p + Z * Z / (2.0 * n);
        let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        let end = |sign: f64| ((middle + sign * half) / (1.0 + Z * Z / n)).clamp(0.0, 1.0);
        [end(-1.0), end(1.0)]
    }
}

/// One figure and its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    pub name: String,
    pub share: Share,
    pub at_least: f64,
    pub at_most: f64,
    /// By the share itself, not by its interval; none where nothing counted.
    pub held: Option<bool>,
}

impl Bar {
    fn new(name: &str, share: Share, [at_least, at_most]: [f64; 2]) -> Self {
        let value = share.value();
        Bar {
            name: name.to_owned(),
            share,
            at_least,
            at_most,
            held: (share.of > 0).then_some(value >= at_least && value <= at_most),
        }
    }
}

/// Every bar of the study; runs of the sweep for detection limits do not count.
pub(super) fn bars(runs: &[StudyRun]) -> Vec<Bar> {
    let of = |families: &'static [Family]| runs.iter().filter(move |run| families.contains(&run.family));
    let counts = |run: &&StudyRun| run.gap_over_noise() >= GAP_THAT_COUNTS;
    let right = |run: &&StudyRun| run.outcome.is_right();
    let hidden = &[Family::Single, Family::Pair, Family::Unlisted];
    let intervals = of(&[Family::Single, Family::Pair]).flat_map(|run| &run.intervals);
    vec![
        Bar::new(
            "right or a tie with the truth, single effects, gap ≥ noise",
            Share::of(of(&[Family::Single]).filter(counts), right),
            [0.95, 1.0],
        ),
        Bar::new(
            "right or a tie with the truth, pairs, both gaps ≥ noise",
            Share::of(of(&[Family::Pair]).filter(counts), right),
            [0.95, 1.0],
        ),
        Bar::new(
            "right or a tie with the truth, single effects and pairs, gap ≥ noise",
            Share::of(of(&[Family::Single, Family::Pair]).filter(counts), right),
            [0.95, 1.0],
        ),
        Bar::new(
            "wrong name without a flag, whatever the gap, unlisted effects too",
            Share::of(of(hidden), |run| run.outcome == Outcome::WrongName),
            [0.0, 0.02],
        ),
        Bar::new(
            "false alarm where nothing is hidden",
            Share::of(of(&[Family::None]), |run| run.outcome != Outcome::Right),
            [0.0, 0.01],
        ),
        Bar::new(
            "unlisted effects reported as unknown",
            Share::of(of(&[Family::Unlisted]), right),
            [0.90, 1.0],
        ),
        Bar::new(
            "95 % intervals that hold the true value",
            Share::of(intervals, |own: &&Interval| own.covers()),
            [0.90, 0.98],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the intervals against published values (Newcombe 1998, table I: 81 of 263, 15 of 148).
    #[test]
    fn intervals_are_wilsons() {
        for (count, of, low, high) in [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605)] {
            let [own_low, own_high] = Share { count, of }.interval();
            assert!((own_low - low).abs() < 1e-4 && (own_high - high).abs() < 1e-4);
        }
    }

    /// Guards against passing by having measured nothing.
    #[test]
    fn nothing_counted_is_nothing_held() {
        assert!(bars(&[]).iter().all(|bar| bar.held.is_none()));
    }
}
