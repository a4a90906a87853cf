//! dMirr/dH = ρ (Man − Mirr)/k also where the walls only bend (δ̂ = 0): minor loops settle on the anhysteretic curve.
//!
//! Mirr irreversible part, Man anhysteretic magnetization (A/m), k pinning (A/m), ρ share of the walls that move
//! although the field runs away from Man (no unit): 0 is the domain wall model, where such walls are frozen after a
//! reversal. Both halves of a minor loop then pull towards Man, so it drifts cycle by cycle and closes; on the major loop
//! reversals happen at saturation, where Man = M, and nothing changes. Rate-independent.
//! M follows through the effective field, by dM = (1 − c) dMirr/(1 − cα ∂Man/∂He) and (1 − c)(Man − Mirr) = Man − M.
//! Stepped by splitting: walls bend over a part of the tick, then relax by 1 − e^(−ρ|ΔH|/k) of the mean of (Man − M)/(1 − cα ∂Man/∂He);
//! second order in the tick. Source: Della Torre's accommodation, in the paper's terms.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Hysteresis,
    needs_time: false,
    summary: "minor loops drift towards the anhysteretic curve, cycle by cycle",
    signature: "gap counted by reversals and fading with cycles, zero on the major loop, rate-free",
    source: "accommodation of minor loops (Della Torre)",
    confused_with: &["after_effect", "parameter_c", "parameter_k"],
    parameters: &[ParameterSpec::size("relaxing_share", "", [0.0, 1.0], 0.002).by_ratio()],
    ..Description::USUAL
};

/// √ρ |ΔH|/k of a part: the splitting's error grows with ρ (ΔH/k)².
const MAX_PART: f64 = 0.016;
/// A longer move, or one that is not a number, is cut into no more.
const MAX_PARTS: f64 = 256.0;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Accommodation {
    share: f64,
}

impl Accommodation {
    pub fn new(values: &[f64]) -> Self {
        Accommodation { share: values[0] }
    }

    /// Into how many parts a move of the field is cut, at least 1.
    pub fn parts(&self, change_a_per_m: f64, pinning_a_per_m: f64) -> f64 {
        let many = libm::ceil(libm::sqrt(self.share) * change_a_per_m.abs() / (MAX_PART * pinning_a_per_m));
        if many < MAX_PARTS { many.max(1.0) } else { MAX_PARTS }
    }

    /// What to add to M (A/m) after the field has changed by `change_a_per_m`, from (Man − M)/(1 − cα ∂Man/∂He) before and after it.
    #[inline]
    pub fn relaxation(&self, change_a_per_m: f64, lag_from: f64, lag_to: f64, pinning_a_per_m: f64) -> f64 {
        // Only lags against the direction of the field count.
        let against = |lag: f64| if lag * change_a_per_m < 0.0 { lag } else { 0.0 };
        let (from, to) = (against(lag_from), against(lag_to));
        let mean = if from == 0.0 || to != 0.0 {
            0.5 * (from + to)
        } else {
            // The lag vanished on the way: the mean of a straight line cut off at zero.
            0.5 * from * from / (from - lag_to)
        };
        -libm::expm1(-self.share * change_a_per_m.abs() / pinning_a_per_m) * mean
    }
}
