//! M and ∂M/∂θ, θ = [Ms, a, k, α, c], advanced together: `advance.rs` in dual numbers.
//!
//! δ̂ = 1: the very same Runge-Kutta steps; their lengths are held as real numbers, only the last one, from the last
//! field to the end, carries the derivative of where the march began.
//! δ̂ = 0: M solves R(M, θ) = M − (1 − c)Mirr − c·Man(H + αM) = 0, so ∂M/∂θ = −(∂R/∂θ)/(∂R/∂M): one Newton correction
//! in dual numbers from the solution in real ones.
//! Switch: H* = a·x* − α·Mirr with x* = curve⁻¹(Mirr/Ms), so ∂x* = ∂(Mirr/Ms)/curve′(x*). M is continuous across it and
//! across reversals, and so is ∂M/∂θ.
//! The derivatives are exact for the steps taken, to rounding; of the 1e-9 Ms by which those miss the equation they say
//! nothing. M in A/m; ∂M/∂Ms no unit, ∂M/∂a and ∂M/∂k no unit, ∂M/∂α and ∂M/∂c A/m. The field H(t) does not depend on
//! θ.

use super::coefficients::Coefficients;
use super::parameter::HysteresisParameter;
use super::phases::Bending;
use super::{Hysteresis, MagneticState};
use crate::Anhysteretic;
use crate::curve::{Curve, Fraction, IsingEverywhere, LangevinByRange};
use crate::number::dual::{Chained, Dual};
use crate::number::lanes::{Number, Single};
use serde::{Deserialize, Serialize};

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
    pub bulge_a_per_m: f64,
    /// Its derivatives, like those of M.
    #[serde(default)]
    pub bulge_derivatives: [f64; COUNT],
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

    fn at(field_a_per_m: f64, magnetization: Carried) -> Self {
        SensitiveState {
            field_a_per_m,
            magnetization_a_per_m: magnetization.value(),
            bulge_a_per_m: 0.0,
            bulge_derivatives: [0.0; COUNT],
            derivatives: magnetization.derivatives(),
        }
    }

    /// At the end of a way from one magnetization to another, with the mean on it.
    fn after(field_a_per_m: f64, [from, to, mean]: [Carried; 3]) -> Self {
        let bulge = mean - Carried::splat(0.5) * (from + to);
        SensitiveState {
            bulge_a_per_m: bulge.value(),
            bulge_derivatives: bulge.derivatives(),
            ..Self::at(field_a_per_m, to)
        }
    }
}

/// `mean_of_cubic` of `advance.rs`: mean over a way of length `way` between two values with their slopes.
fn mean_of_cubic(way: Carried, [from, to]: [Carried; 2], [slope_from, slope_to]: [Carried; 2]) -> Carried {
    Carried::splat(0.5) * (from + to) + way * (slope_from - slope_to) * Carried::splat(1.0 / 12.0)
}

impl From<MagneticState> for SensitiveState {
    /// A state that does not depend on the parameters: one that is known from elsewhere.
    fn from(state: MagneticState) -> Self {
        SensitiveState {
            field_a_per_m: state.field_a_per_m,
            magnetization_a_per_m: state.magnetization_a_per_m,
            bulge_a_per_m: 0.0,
            bulge_derivatives: [0.0; COUNT],
            derivatives: [0.0; COUNT],
        }
    }
}

impl Hysteresis {
    /// [`Hysteresis::advance`] with the derivatives of the magnetization by all five parameters: the same steps, and to
    /// the last bit the same magnetization.
    pub fn advance_with_sensitivities(&self, state: SensitiveState, field_to_a_per_m: f64) -> SensitiveState {
        match self.anhysteretic {
            Anhysteretic::Langevin => self.sensitive_on::<LangevinByRange>(state, field_to_a_per_m),
            Anhysteretic::Ising => self.sensitive_on::<IsingEverywhere>(state, field_to_a_per_m),
        }
    }

    fn sensitive_on<C: Curve<f64> + Curve<Dual<1>>>(&self, state: SensitiveState, field_to: f64) -> SensitiveState {
        let change = field_to - state.field_a_per_m;
        if change == 0.0 {
            return SensitiveState {
                bulge_a_per_m: 0.0,
                bulge_derivatives: [0.0; COUNT],
                ..state
            };
        }
        if !change.is_finite() {
            return SensitiveState {
                field_a_per_m: field_to,
                magnetization_a_per_m: f64::NAN,
                bulge_a_per_m: f64::NAN,
                bulge_derivatives: [f64::NAN; COUNT],
                derivatives: [f64::NAN; COUNT],
            };
        }
        let direction = if change > 0.0 { 1.0 } else { -1.0 };
        let phase = Phase::of(self, direction);
        let mut field = Carried::splat(state.field_a_per_m);
        let mut magnetization = Carried::new(state.magnetization_a_per_m, state.derivatives);
        let mut fraction = phase.coefficients.curve::<Chained<C>>(field, magnetization);
        let start = magnetization;
        // Of M over H.
        let mut integral = Carried::splat(0.0);
        if phase.coefficients.lag(&fraction, magnetization).value() * direction < 0.0 {
            let real = Coefficients::of(self, direction);
            let present = real.curve::<C>(state.field_a_per_m, state.magnetization_a_per_m);
            let (from, tangent) = (magnetization, phase.coefficients.bending_slope(&fraction));
            let slope = |field: Carried, magnetization: Carried| {
                let there = phase.coefficients.curve::<Chained<C>>(field, magnetization);
                phase.coefficients.bending_slope(&there)
            };
            let (bent, still_frozen, _) = self.bend::<C>(&real, &present, state.magnetic(), field_to);
            let frozen = magnetization - phase.reversibility * phase.anhysteretic(&fraction);
            if still_frozen {
                let to = phase.bent::<C>(frozen, bent, field_to);
                let slopes = [tangent, slope(Carried::splat(field_to), to)];
                let mean = mean_of_cubic(Carried::splat(change), [from, to], slopes);
                return SensitiveState::after(field_to, [from, to, mean]);
            }
            let bending = self.frozen(state.magnetic());
            if (bending.switch_field - state.field_a_per_m) * direction > 0.0 {
                (field, magnetization) = self.switch(&phase, frozen, bending);
            }
            fraction = phase.coefficients.curve::<Chained<C>>(field, magnetization);
            let way = field - Carried::splat(state.field_a_per_m);
            let slopes = [tangent, slope(field, magnetization)];
            integral = way * mean_of_cubic(way, [from, magnetization], slopes);
        }
        let longest = self.longest_substep_a_per_m();
        let (end, marched) =
            self.march::<Carried, Chained<C>>(&phase.coefficients, &fraction, field, magnetization, field_to, longest);
        let mean = (integral + marched) * Carried::splat(1.0 / change);
        SensitiveState::after(field_to, [start, end, mean])
    }

    /// Field and magnetization where δ̂ becomes 1; the values are those of `bending`.
    fn switch(&self, phase: &Phase, frozen: Carried, bending: Bending) -> (Carried, Carried) {
        let irreversible = (frozen / (Carried::splat(1.0) - phase.reversibility)).with_value(bending.irreversible);
        let relative = irreversible / phase.coefficients.saturation;
        let argument = self.anhysteretic.inverse(relative.value());
        let steepness = self.anhysteretic.derivative(argument);
        // Only rounding can bring a material to where the curve is flat; the switch is then out of reach.
        let slope = if steepness > 0.0 { 1.0 / steepness } else { 0.0 };
        let argument = relative.chain(argument, slope);
        let field = phase.shape * argument - phase.coefficients.coupling * irreversible;
        (field.with_value(bending.switch_field), irreversible)
    }
}

/// The parameters as dual numbers, for one direction of the field.
struct Phase {
    coefficients: Coefficients<Carried>,
    shape: Carried,
    reversibility: Carried,
}

impl Phase {
    #[inline(always)]
    fn of(hysteresis: &Hysteresis, direction: f64) -> Self {
        let values = hysteresis.parameters();
        let parameters: [Carried; COUNT] = std::array::from_fn(|index| Carried::variable(values[index], index));
        Phase {
            coefficients: Coefficients::of_parameters(parameters, direction),
            shape: parameters[HysteresisParameter::Shape.index()],
            reversibility: parameters[HysteresisParameter::Reversibility.index()],
        }
    }

    #[inline(always)]
    fn anhysteretic(&self, fraction: &Fraction<Carried>) -> Carried {
        self.coefficients.saturation * (fraction.x * fraction.numerator) / fraction.denominator
    }

    /// Gives the solution `bent` of the phase with δ̂ = 0 its derivatives; `frozen` is (1 − c)·Mirr.
    #[inline(always)]
    fn bent<C: Curve<Dual<1>>>(&self, frozen: Carried, bent: f64, field_to: f64) -> Carried {
        let magnetization = Carried::splat(bent);
        let fraction = self
            .coefficients
            .curve::<Chained<C>>(Carried::splat(field_to), magnetization);
        let residual = magnetization - frozen - self.reversibility * self.anhysteretic(&fraction);
        let q = fraction.denominator.value();
        let bending = self.coefficients.reversible_gain.value() * fraction.derivative.value();
        let steepness = 1.0 - self.coefficients.coupling.value() * bending / (q * q);
        residual.chain(bent, -1.0 / steepness)
    }
}
