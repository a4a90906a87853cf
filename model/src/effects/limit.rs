//! y = u/(1 + |u/L|^p)^(1/p): what a signal becomes that cannot leave ±L.
//!
//! u and y in the unit of L; p sharpness (no unit): 2 is round, and from 1000 on, unless told otherwise, y = clip(u, ±L).

use serde::{Deserialize, Serialize};

use crate::parameter::ParameterSpec;

/// From here on the limit has an edge.
const EDGE: f64 = 1000.0;
/// p.
pub(super) const SHARPNESS: ParameterSpec = ParameterSpec::fixed("sharpness", "", [2.0, EDGE], EDGE)
    .by_ratio()
    .believed(3.5);

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Limit {
    level: f64,
    sharpness: f64,
}

impl Limit {
    pub fn new(level: f64, sharpness: f64) -> Self {
        Limit { level, sharpness }
    }

    /// With an edge.
    pub fn clip(level: f64) -> Self {
        Limit::new(level, EDGE)
    }

    pub fn is_round(&self) -> bool {
        self.sharpness < EDGE
    }

    #[inline]
    pub fn of(&self, signal: f64) -> f64 {
        if !self.is_round() {
            return signal.clamp(-self.level, self.level);
        }
        // (1 + r^p)^(-1/p) by logarithms, which take less time than two powers.
        let (ratio, p) = ((signal / self.level).abs(), self.sharpness);
        let power = p * libm::log(ratio);
        let factor = libm::exp(-libm::log1p(libm::exp(-power.abs())) / p);
        if power > 0.0 {
            (self.level * factor).copysign(signal)
        } else {
            signal * factor
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the clip on both sides, that it leaves the rest alone, and that a round limit is the equation's, on both sides of L.
    #[test]
    fn only_what_is_beyond_is_limited() {
        let clip = Limit::clip(1e-5);
        assert_eq!([-2e-5, 3e-6, 2e-5].map(|u| clip.of(u)), [-1e-5, 3e-6, 1e-5]);
        let round = Limit::new(2.0, 12.0);
        for u in [-50.0_f64, -2.5, -1.9, 0.0, 1e-3, 2.0, 3.0, 1e30] {
            let expected = u / (1.0 + (u / 2.0).abs().powi(12)).powf(1.0 / 12.0);
            if expected != 0.0 {
                assert!((round.of(u) / expected - 1.0).abs() < 1e-14, "{u}");
            }
            assert!(round.of(u).abs() <= 2.0 && round.of(u) == -round.of(-u));
        }
    }
}
