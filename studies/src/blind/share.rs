//! Shares of runs with their 95 % intervals.
//!
//! Interval of a share k/n: Wilson (1927), (p + z²/2n ± z √(p(1 − p)/n + z²/4n²)) / (1 + z²/n), p = k/n, z = 1.96.

use serde::{Deserialize, Serialize};

const Z: f64 = 1.959_963_985;

/// k of n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    pub count: u64,
    pub of: u64,
}

impl std::iter::Sum for Share {
    fn sum<All: Iterator<Item = Share>>(all: All) -> Share {
        all.fold(Share::default(), |sum, own| Share {
            count: sum.count + own.count,
            of: sum.of + own.of,
        })
    }
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
}
