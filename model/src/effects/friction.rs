//! ü + k̂ u̇ + ĉ u = w M + f F − ĉ d tanh(u̇/v₀): dry friction in a guide or joint works against the motion.
//!
//! u displacement (m), d friction as the displacement that its force would hold against the stiffness (m), v₀ speed over
//! which it turns round (m/s), 1 mm/s unless told. Other symbols as in [`crate::TwoPole`].
//! Assumption: kinetic friction without Stribeck's dip; at rest it creeps instead of sticking.
//! Source: regularised Coulomb friction.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use crate::Anhysteretic;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Rod,
    summary: "dry friction works against the motion of the tip",
    signature: "a step at reversals with the sign of the rate; size independent of amplitude, so the relative gap falls with it",
    source: "regularised Coulomb friction",
    confused_with: &["backlash", "parameter_k", "excess_loss"],
    parameters: &[
        ParameterSpec::size("friction_m", "m", [0.0, 1e-4], 5e-9).by_ratio(),
        ParameterSpec::fixed("speed_m_per_s", "m/s", [1e-5, 1.0], 1e-3)
            .by_ratio()
            .believed(0.8),
    ],
    ..Description::USUAL
};

/// Beyond this argument tanh is 1 to the last bit.
const SATURATED: f64 = 19.5;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Friction {
    /// ĉ d, m/s².
    level: f64,
    per_speed: f64,
}

impl Friction {
    pub fn new(values: &[f64], stiffness_per_s2: f64) -> Self {
        Friction {
            level: stiffness_per_s2 * values[0],
            per_speed: 1.0 / values[1],
        }
    }

    /// v₀.
    pub fn speed_m_per_s(&self) -> f64 {
        1.0 / self.per_speed
    }

    /// Acceleration (m/s²) and its slope in the velocity (1/s).
    #[inline]
    pub fn acceleration(&self, velocity_m_per_s: f64) -> (f64, f64) {
        let ratio = velocity_m_per_s * self.per_speed;
        if ratio.abs() > SATURATED {
            return (-self.level.copysign(ratio), 0.0);
        }
        // Ising's curve is tanh, without an exponential.
        let (value, derivative) = Anhysteretic::Ising.value_and_derivative(ratio);
        (-self.level * value, -self.level * self.per_speed * derivative)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the second law: whatever the speed, the force takes energy out, at most at its Coulomb level.
    #[test]
    fn it_never_gives_energy() {
        let friction = Friction::new(&[1.5e-6, 1e-3], 6.4e7);
        for index in -400..=400 {
            let velocity = 1e-4 * f64::from(index);
            let (acceleration, slope) = friction.acceleration(velocity);
            assert!(acceleration * velocity <= 0.0 && slope <= 0.0);
            assert!(acceleration.abs() <= 96.0 * (1.0 + 1e-14));
        }
    }
}
