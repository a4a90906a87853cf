//! ü + k̂ u̇ + ĉ u = w M + f F − ĉ d n,  dn = (tanh(u̇/v₀) − n) |du|/z₀: dry friction in a guide or joint works against the motion.
//!
//! u displacement (m), d friction as the displacement that its force would hold against the stiffness (m), n how much of it is borne, v₀ speed over
//! which it turns round (m/s), 1 mm/s unless told, z₀ way over which it does (m), none unless told: before, what sticks bends like a spring. v₀ → 0
//! is Dahl's law, z₀ → 0 friction without memory. Other symbols as in [`crate::TwoPole`].
//! Assumption: kinetic friction without Stribeck's dip; at rest it creeps instead of sticking where z₀ is small.
//! Source: regularised Coulomb friction; Dahl 1968.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use crate::Anhysteretic;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Rod,
    summary: "dry friction works against the motion of the tip",
    signature: "a step at reversals with the sign of the rate; size independent of amplitude, so the relative gap falls with it",
    source: "regularised Coulomb friction, Dahl's presliding",
    confused_with: &["backlash", "parameter_k", "excess_loss"],
    parameters: &[
        ParameterSpec::size("friction_m", "m", [0.0, 1e-4], 5e-9).by_ratio(),
        ParameterSpec::fixed("speed_m_per_s", "m/s", [1e-5, 1.0], 1e-3)
            .by_ratio()
            .believed(0.8),
        ParameterSpec::fixed("presliding_m", "m", [FINEST_M, 1e-4], FINEST_M)
            .by_ratio()
            .believed(4.0),
    ],
    ..Description::USUAL
};

/// A shorter way to slide is none.
const FINEST_M: f64 = 1e-9;
/// Beyond this argument tanh is 1 to the last bit.
const SATURATED: f64 = 19.5;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Friction {
    /// ĉ d, m/s².
    level: f64,
    per_speed: f64,
    /// z₀, or 0.
    presliding_m: f64,
    /// n.
    borne: f64,
}

impl Friction {
    /// `size`: of the motion, in those of a rod of Terfenol-D.
    pub fn new(values: &[f64], stiffness_per_s2: f64, size: f64) -> Self {
        Friction {
            level: stiffness_per_s2 * values[0],
            per_speed: 1.0 / values[1],
            presliding_m: if values[2] > FINEST_M * size { values[2] } else { 0.0 },
            borne: 0.0,
        }
    }

    /// v₀.
    pub fn speed_m_per_s(&self) -> f64 {
        1.0 / self.per_speed
    }

    /// z₀, or 0.
    pub fn presliding_m(&self) -> f64 {
        self.presliding_m
    }

    /// Nothing is borne.
    pub fn release(&mut self) {
        self.borne = 0.0;
    }

    /// The tip has moved on by so much and has this speed.
    pub fn slide(&mut self, way_m: f64, velocity_m_per_s: f64) {
        (self.borne, _, _) = self.borne_after(way_m, velocity_m_per_s);
    }

    /// Acceleration (m/s²) after a way, and its slopes in the way (1/s²) and the velocity (1/s).
    #[inline]
    pub fn acceleration(&self, way_m: f64, velocity_m_per_s: f64) -> (f64, f64, f64) {
        let (borne, by_way, by_velocity) = self.borne_after(way_m, velocity_m_per_s);
        (-self.level * borne, -self.level * by_way, -self.level * by_velocity)
    }

    /// n, and its slopes in the way and the velocity.
    #[inline]
    fn borne_after(&self, way_m: f64, velocity_m_per_s: f64) -> (f64, f64, f64) {
        let ratio = velocity_m_per_s * self.per_speed;
        let (wanted, slope) = if ratio.abs() > SATURATED {
            (1.0_f64.copysign(ratio), 0.0)
        } else {
            // Ising's curve is tanh, without an exponential.
            Anhysteretic::Ising.value_and_derivative(ratio)
        };
        if self.presliding_m == 0.0 {
            return (wanted, 0.0, slope * self.per_speed);
        }
        let per_way = 1.0 / self.presliding_m;
        let kept = libm::exp(-way_m.abs() * per_way);
        let rest = (self.borne - wanted) * kept;
        // Where it is let go the slope is negative; Newton's search does without.
        let by_way = (-rest * per_way * 1.0_f64.copysign(way_m)).max(0.0);
        (wanted + rest, by_way, slope * self.per_speed * (1.0 - kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the second law: whatever the speed, the force takes energy out, at most at its Coulomb level.
    #[test]
    fn it_never_gives_energy() {
        let friction = Friction::new(&[1.5e-6, 1e-3, 1e-9], 6.4e7, 1.0);
        for index in -400..=400 {
            let velocity = 1e-4 * f64::from(index);
            let (acceleration, _, slope) = friction.acceleration(1e-4 * velocity, velocity);
            assert!(acceleration * velocity <= 0.0 && slope <= 0.0);
            assert!(acceleration.abs() <= 96.0 * (1.0 + 1e-14));
        }
    }

    /// Guards Dahl's law: from rest n = 1 − e^(−x/z₀); turned round, it is borne to the other side over twice ln 2 of z₀.
    #[test]
    fn what_sticks_bends_like_a_spring() {
        let (way_m, presliding_m) = (1e-8, 4e-7);
        let mut friction = Friction::new(&[1e-6, 1e-5, presliding_m], 6.4e7, 1.0);
        for step in 1..=400 {
            friction.slide(way_m, 1.0);
            let dahl = 1.0 - libm::exp(-way_m * f64::from(step) / presliding_m);
            assert!((friction.borne - dahl).abs() < 1e-12);
        }
        let back_m = presliding_m * libm::log(1.0 + friction.borne);
        friction.slide(-back_m, -1.0);
        assert!(friction.borne.abs() < 1e-12, "{}", friction.borne);
    }
}
