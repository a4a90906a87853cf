//! ü + k̂·u̇ + ĉ·u = w·M + f·F: the rod as one damped oscillator.
//!
//! u tip displacement (m), M magnetization (A/m), F tip force (N); w m/s² per A/m, k̂ 1/s, ĉ 1/s², f 1/kg.
//! Assumptions: λ linear in M, frequencies well below the rod's second mode. Source: the paper's (13).

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require, require_not_negative, require_positive};

/// The paper's (13), computed from the elements by [`super::RodElements::two_pole`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwoPole {
    /// w, m/s² per A/m.
    pub gain: f64,
    /// k̂, 1/s.
    pub damping_per_s: f64,
    /// ĉ, 1/s².
    pub stiffness_per_s2: f64,
    /// Acceleration per tip force, 1/kg; over ĉ it is the static compliance. 0, no force acts, where a file leaves it out.
    #[serde(default)]
    pub force_gain_per_kg: f64,
}

impl TwoPole {
    /// Static displacement per magnetization, m per A/m: w/ĉ.
    pub fn dc_gain(&self) -> f64 {
        self.gain / self.stiffness_per_s2
    }

    /// Undamped natural frequency √ĉ/2π, Hz.
    pub fn natural_frequency_hz(&self) -> f64 {
        libm::sqrt(self.stiffness_per_s2) / (2.0 * std::f64::consts::PI)
    }

    /// k̂/(2√ĉ), no unit.
    pub fn damping_ratio(&self) -> f64 {
        0.5 * self.damping_per_s / libm::sqrt(self.stiffness_per_s2)
    }

    /// Acceleration input w·M + f·F, m/s², for [`super::TwoPolePropagator::advance`].
    #[inline]
    pub fn acceleration(&self, magnetization_a_per_m: f64, force_n: f64) -> f64 {
        self.gain * magnetization_a_per_m + self.force_gain_per_kg * force_n
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        require(
            self.gain != 0.0,
            "rod gain w",
            self.gain,
            "m/s^2 per A/m",
            "finite and not 0",
        )?;
        require_not_negative(self.damping_per_s, "rod damping", "1/s")?;
        require_positive(self.stiffness_per_s2, "rod stiffness", "1/s^2")?;
        require_not_negative(self.force_gain_per_kg, "rod force gain", "1/kg")
    }
}
