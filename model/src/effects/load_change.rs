//! (1 + μ) ü + k̂ u̇ + ĉ (1 + κ) u = w M + f F: the load's mass or stiffness is another.
//!
//! u displacement (m), M magnetization (A/m), F force (N), μ mass change and κ stiffness change relative to the whole
//! modal mass and stiffness (no unit). Other symbols as in [`crate::TwoPole`].
//! Assumption: constant over the run, one mode. Source: the paper's (13); M_L and k_L of its (12).

use super::description::{Description, Stage};
use crate::TwoPole;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Rod,
    needs_time: false,
    summary: "mass or stiffness of the load differ from nominal",
    signature: "resonance and static gain move together, at every bias and amplitude alike: a shift of parameters",
    source: "the paper's (12) and (13)",
    confused_with: &["sensor_gain", "delta_e", "parameter_w"],
    parameters: &[
        ParameterSpec::size("relative_stiffness", "", [-0.9, 10.0], 3e-4),
        ParameterSpec::size("relative_mass", "", [-0.9, 10.0], 0.01),
    ],
    ..Description::USUAL
};

/// The rod with the other load.
pub(crate) fn loaded(rod: TwoPole, values: &[f64]) -> TwoPole {
    let (stiffer, heavier) = (1.0 + values[0], 1.0 + values[1]);
    TwoPole {
        gain: rod.gain / heavier,
        damping_per_s: rod.damping_per_s / heavier,
        stiffness_per_s2: rod.stiffness_per_s2 * stiffer / heavier,
        force_gain_per_kg: rod.force_gain_per_kg / heavier,
    }
}
