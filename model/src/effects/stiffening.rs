//! ü + k̂ u̇ + ĉ u (1 + β u²) = w M + f F: the spring stiffens (β > 0) or softens as it is pressed.
//!
//! u displacement (m), β (1/m²): at 50 μm, β = 1e8 adds a quarter. Other symbols as in [`crate::TwoPole`].
//! Softening holds up to where the slope of the force vanishes, u = 1/√(−3β); beyond, the force is kept there.
//! Source: cubic (Duffing) stiffness of disc springs and flexures.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Rod,
    needs_time: false,
    summary: "the load's spring force has a part in u³",
    signature: "odd harmonics growing with the cube of the displacement; static, without a loop of its own",
    source: "disc springs and flexures (Duffing)",
    confused_with: &["quadratic_magnetostriction", "parameter_a", "parameter_Ms"],
    parameters: &[ParameterSpec::size("cubic_stiffness_per_m2", "1/m²", [-1e7, 1e11], 1e5)],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stiffening {
    cubic: f64,
    /// Square of the largest displacement that the law is used at, m².
    most_square: f64,
}

impl Stiffening {
    pub fn new(values: &[f64]) -> Self {
        let cubic = values[0];
        Stiffening {
            cubic,
            most_square: if cubic < 0.0 { -1.0 / (3.0 * cubic) } else { f64::MAX },
        }
    }

    /// β u³ (m) and its slope in u.
    #[inline]
    pub fn excess(&self, displacement_m: f64) -> (f64, f64) {
        let square = displacement_m * displacement_m;
        if square < self.most_square {
            (self.cubic * square * displacement_m, 3.0 * self.cubic * square)
        } else {
            // The slope of u(1 + βu²) is 0 here and stays so.
            let most = libm::sqrt(self.most_square).copysign(displacement_m);
            (2.0 / 3.0 * most - displacement_m, -1.0)
        }
    }
}
