//! M and ∂M/∂θ, θ = [Ms, a, k, α, c], advanced together: `phases.rs` in dual numbers.
//!
//! δ̂ = 1: the very same Runge-Kutta steps; their lengths are held as real numbers, only the last one, from the last
//! field to the end, carries the derivative of where the integration began.
//! δ̂ = 0: M solves R(M, θ) = M − (1 − c)Mirr − c·Man(H + αM) = 0, so ∂M/∂θ = −(∂R/∂θ)/(∂R/∂M): one Newton correction
//! in dual numbers from the solution in real ones.
//! Switch: H* = a·x* − α·Mirr with x* = curve⁻¹(Mirr/Ms), so ∂x* = ∂(Mirr/Ms)/curve′(x*). M is continuous across it and
//! across reversals, and so is ∂M/∂θ.
//! The derivatives are exact for the steps taken, to rounding; of the 1e-9 Ms by which those miss the equation they say
//! nothing. M in A/m; ∂M/∂Ms no unit, ∂M/∂a and ∂M/∂k no unit, ∂M/∂α and ∂M/∂c A/m. The field H(t) does not depend on
//! θ, and b₃ is held.

use serde::{Deserialize, Serialize};

use super::parameter::HysteresisParameter;
use super::{Hysteresis, MagneticState, on_kernel};
use crate::kernel::Kernel;
use crate::number::Number;
use crate::number::dual::Dual;
use crate::number::single::Single;

const COUNT: usize = HysteresisParameter::COUNT;
type Carried = Dual<COUNT>;

/// Where the material is, and how that depends on the parameters. The default is demagnetised, whatever the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensitiveState {
    /// H, A/m.
    pub field_a_per_m: f64,
    /// M, A/m.
    pub magnetization_a_per_m: f64,
    /// Mean of M on the way here, the field going straight, less the mean of its ends, A/m: what a straight line between samples leaves out.
    #[serde(default)]
    pub mean_excess_a_per_m: f64,
    /// Its derivatives, like those of M.
    #[serde(default)]
    pub mean_excess_derivatives: [f64; COUNT],
    /// ∂M/∂θ in the order of [`HysteresisParameter::ALL`].
    pub derivatives: [f64; COUNT],
}

impl SensitiveState {
    /// The state without its derivatives.
    pub fn magnetic(&self) -> MagneticState {
        MagneticState {
            field_a_per_m: self.field_a_per_m,
            magnetization_a_per_m: self.magnetization_a_per_m,
        }
    }
}

impl From<MagneticState> for SensitiveState {
    /// A state that does not depend on the parameters: one that is known from elsewhere.
    fn from(state: MagneticState) -> Self {
        SensitiveState {
            field_a_per_m: state.field_a_per_m,
            magnetization_a_per_m: state.magnetization_a_per_m,
            ..Self::default()
        }
    }
}

impl Hysteresis {
    /// [`Hysteresis::advance`] with the derivatives of the magnetization by all five parameters: the same steps, and to
    /// the last bit the same magnetization.
    pub fn advance_with_sensitivities(&self, state: SensitiveState, field_to_a_per_m: f64) -> SensitiveState {
        on_kernel!(self.sensitive(state, field_to_a_per_m))
    }

    fn sensitive<C: Kernel, const CUBIC: bool>(&self, state: SensitiveState, field_to: f64) -> SensitiveState {
        let values = self.parameters();
        let parameters: [Carried; COUNT] = std::array::from_fn(|index| Carried::variable(values[index], index));
        let from = Carried::new(state.magnetization_a_per_m, state.derivatives);
        let longest = self.longest_substep_a_per_m();
        let (to, mean) = self.travel::<Carried, C, CUBIC>(parameters, state.magnetic(), from, field_to, longest);
        let mean_excess = mean - Carried::splat(0.5) * (from + to);
        SensitiveState {
            field_a_per_m: field_to,
            magnetization_a_per_m: to.value(),
            mean_excess_a_per_m: mean_excess.value(),
            mean_excess_derivatives: mean_excess.derivatives(),
            derivatives: to.derivatives(),
        }
    }
}
