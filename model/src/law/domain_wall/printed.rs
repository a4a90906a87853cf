//! The paper's (7) exactly as printed, kept only to show what its sign costs.
//!
//! dM/dH = [ δ̂ (Man − M)/(kδ − α̂(Man − M)) + c ∂Man/∂H ] / (1 **+** cα ∂Man/∂H).
//! Differentiating (5) with He = H + αM gives **minus**; nothing in the project but the erratum's test uses this form.

use super::{Hysteresis, MagneticState};

impl Hysteresis {
    /// dM/dH by the printed (7), with the plus sign in the denominator. Wrong: for comparison only.
    pub fn slope_as_printed(&self, state: MagneticState, rising: bool) -> f64 {
        let direction = if rising { 1.0 } else { -1.0 };
        let saturation = self.saturation_magnetization_a_per_m;
        let (value, derivative) = self.anhysteretic.value_and_derivative(self.argument(state));
        let distance = saturation * value - state.magnetization_a_per_m;
        let susceptibility = saturation * derivative / self.shape_a_per_m;
        let coupling_hat = self.coupling / (1.0 - self.reversibility);
        let wall = if distance * direction < 0.0 {
            0.0
        } else {
            distance / (self.pinning_a_per_m * direction - coupling_hat * distance)
        };
        (wall + self.reversibility * susceptibility) / (1.0 + self.reversibility * self.coupling * susceptibility)
    }
}
