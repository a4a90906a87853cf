//! dΔT/dt = r (H/H₀)² − ΔT/τ: warming by ohmic loss against a loss to the surroundings.
//!
//! ΔT rise over ambient (K), r heating (K/s) at the field H₀ = 10 kA/m, H coil field (A/m), τ loss time (s).
//! Exact for the mean of H² over a tick in which H is a straight line. Assumptions: one lumped temperature, and a
//! coil resistance that stays. Source: [`crate::heat`], with r = R_coil (H₀/κ)²/C.

use serde::{Deserialize, Serialize};

use super::EffectParameter;

/// H₀, A/m.
const REFERENCE_FIELD_A_PER_M: f64 = 1e4;

/// r as a parameter, with the smallest value worth finding.
pub(super) const fn heating(typical: f64) -> EffectParameter {
    EffectParameter::size("heating_k_per_s", "K/s", [0.0, 200.0], typical).by_ratio()
}

/// The rise of one lumped temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Warming {
    decay: f64,
    /// Rise after one tick at 1 (A/m)², K.
    rise_per_square: f64,
    field_a_per_m: f64,
    rise_k: f64,
}

impl Warming {
    pub fn new(heating_k_per_s: f64, loss_time_s: f64, tick_s: f64) -> Self {
        let fallen = -libm::expm1(-tick_s / loss_time_s);
        let square = REFERENCE_FIELD_A_PER_M * REFERENCE_FIELD_A_PER_M;
        Warming {
            decay: 1.0 - fallen,
            rise_per_square: heating_k_per_s * loss_time_s * fallen / square,
            field_a_per_m: 0.0,
            rise_k: 0.0,
        }
    }

    /// At ambient, with the coil at this field.
    pub fn settle(&mut self, field_a_per_m: f64) {
        (self.field_a_per_m, self.rise_k) = (field_a_per_m, 0.0);
    }

    /// ΔT after one more tick, K; the field goes linearly to `field_a_per_m`.
    #[inline]
    pub fn step(&mut self, field_a_per_m: f64) -> f64 {
        let (from, to) = (self.field_a_per_m, field_a_per_m);
        let mean_square = (from * from + from * to + to * to) / 3.0;
        self.rise_k = self.decay * self.rise_k + self.rise_per_square * mean_square;
        self.field_a_per_m = to;
        self.rise_k
    }

    pub fn rise_k(&self) -> f64 {
        self.rise_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the thermal effects: at constant field the rise is rτ(H/H₀)²(1 − e^(−t/τ)), and settles at rτ(H/H₀)².
    #[test]
    fn the_rise_is_exponential_and_settles() {
        let (heating, loss_time_s, tick_s) = (2.0, 20.0, 1e-2);
        let mut warming = Warming::new(heating, loss_time_s, tick_s);
        warming.settle(5e3);
        let settled = heating * loss_time_s * 0.25;
        for k in 1..=20_000 {
            let rise = warming.step(5e3);
            let expected = -settled * libm::expm1(-tick_s * f64::from(k) / loss_time_s);
            assert!((rise - expected).abs() < 1e-10 * settled, "tick {k}");
        }
        assert!((warming.rise_k() / settled - 1.0).abs() < 1e-4);
    }
}
