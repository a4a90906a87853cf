//! w = y − v,  v̇ = 2πf (y − v): a high-pass for the measured displacement and for every predicted one alike.
//!
//! y displacement (m), v its slow part (m), f corner (Hz). Transfer function s/(s + 2πf).
//! What moves the tip slowly without moving `a` (thermal expansion, the mean force of a cut, a drifting sensor) would
//! otherwise be taken for a change of `a`. A filter that does not depend on `a` may stand before the law: its proof speaks of any
//! output f(u, θ), filtered outputs included.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One high-pass per predicted output and one for the measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Washout {
    /// 1 − exp(−2πfT).
    share: f64,
    slow_predicted_m: Vec<f64>,
    slow_measured_m: f64,
    predicted_m: Vec<f64>,
}

impl Washout {
    /// For `members` outputs at rest.
    pub fn new(corner_hz: f64, members: usize, tick_s: f64) -> Self {
        Self {
            share: -libm::expm1(-TAU * corner_hz * tick_s),
            slow_predicted_m: vec![0.0; members],
            slow_measured_m: 0.0,
            predicted_m: vec![0.0; members],
        }
    }

    /// The fast parts of the predicted outputs.
    pub fn predicted(&mut self, displacements_m: &[f64]) -> &[f64] {
        let parts = self.predicted_m.iter_mut().zip(&mut self.slow_predicted_m);
        for ((fast, slow), &displacement) in parts.zip(displacements_m) {
            *fast = wash(self.share, slow, displacement);
        }
        &self.predicted_m
    }

    /// Moves the first output's slow part by so much of each of the others', which are its derivatives.
    pub fn shift(&mut self, change: &[f64]) {
        if let Some((value, derivatives)) = self.slow_predicted_m.split_first_mut() {
            *value += derivatives
                .iter()
                .zip(change)
                .map(|(by, times)| times * by)
                .sum::<f64>();
        }
    }

    /// The fast part of the measured one. What is not finite passes and leaves no trace.
    pub fn measured(&mut self, displacement_m: f64) -> f64 {
        if !displacement_m.is_finite() {
            return displacement_m;
        }
        wash(self.share, &mut self.slow_measured_m, displacement_m)
    }
}

fn wash(share: f64, slow: &mut f64, displacement_m: f64) -> f64 {
    let fast = displacement_m - *slow;
    *slow += share * fast;
    fast
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the two ends of the transfer function: nothing of a constant, all of a jump.
    #[test]
    fn a_constant_dies_and_a_jump_passes() {
        let mut washout = Washout::new(2.0, 1, 5e-5);
        assert_eq!(washout.measured(1e-6), 1e-6);
        let after_a_second = (1..20_000).map(|_| washout.measured(1e-6)).last().unwrap_or_default();
        let expected = 1e-6 * libm::exp(-TAU * 2.0 * 19_999.0 * 5e-5);
        assert!((after_a_second / expected - 1.0).abs() < 1e-6, "{after_a_second} m");
        assert_eq!(washout.predicted(&[3e-6]), &[3e-6]);
    }

    // Guards against a poisoned filter: one missing measurement must not end all later ones.
    #[test]
    fn what_is_not_finite_leaves_no_trace() {
        let mut washout = Washout::new(2.0, 0, 5e-5);
        assert!(washout.measured(f64::NAN).is_nan());
        assert_eq!(washout.measured(1e-6), 1e-6);
    }
}
