//! p = (r″ + k̂·r′ + ĉ·r)/ĉ, and with the hold's correction p − (T²/12)·p″.
//!
//! Transfer function: P(s) = (s² + k̂s + ĉ)/ĉ, the inverse of the rod ĉ/(s² + k̂s + ĉ), times 1 − (sT)²/12.
//! r the reference and p the quasi-static displacement, both m; k̂ in 1/s and ĉ in 1/s² of the rod; T the tick in s.
//! Ports: in the motion at t_{k+2}, out p (m) and p′ (m/s) for t_{k+2}.
//!
//! Why the correction: between ticks the magnetization is a straight line. A line through two samples of a curve is off by
//! p″·τ(T − τ)/2 at τ after the first, T²/12·p″ in the mean; a sine of ω is attenuated by (sin(ωT/2)/(ωT/2))² = 1 − (ωT)²/12 + ….
//! The rod follows the mean, so the samples are placed T²/12·p″ outside the curve. Left are (ωT)⁴/240, and the
//! lines' images around the sampling rate, (ω/ωₛ)² each, as far as the rod passes them.
//! With a curved strain law the line is straight in M, not in p: then T²/12·λ″/λ′·(dM/dt)² (in units of M) stays uncorrected.

use crate::Motion;
use anhyst_model::TwoPole;
use serde::{Deserialize, Serialize};

/// The rod's inverse on a known motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Feedforward {
    damping_per_s: f64,
    stiffness_per_s2: f64,
    /// T²/12, or 0 without the correction.
    hold_s2: f64,
}

impl Feedforward {
    /// For a rod sampled every `tick_s`.
    pub fn new(rod: &TwoPole, tick_s: f64, hold_correction: bool) -> Self {
        Self {
            damping_per_s: rod.damping_per_s,
            stiffness_per_s2: rod.stiffness_per_s2,
            hold_s2: if hold_correction { tick_s * tick_s / 12.0 } else { 0.0 },
        }
    }

    /// Quasi-static displacement that moves the rod along the reference.
    pub fn displacement_m(&self, motion: &Motion) -> f64 {
        let demand = self.inverse(motion.position_m, motion.velocity_m_per_s, motion.acceleration_m_per_s2);
        let curvature = self.inverse(motion.acceleration_m_per_s2, motion.jerk_m_per_s3, motion.snap_m_per_s4);
        demand - self.hold_s2 * curvature
    }

    /// Its rate, without the hold's correction (which would need the sixth derivative and changes it by (ωT)²/12).
    pub fn rate_m_per_s(&self, motion: &Motion) -> f64 {
        self.inverse(
            motion.velocity_m_per_s,
            motion.acceleration_m_per_s2,
            motion.jerk_m_per_s3,
        )
    }

    fn inverse(&self, value: f64, first: f64, second: f64) -> f64 {
        value + (second + self.damping_per_s * first) / self.stiffness_per_s2
    }
}
