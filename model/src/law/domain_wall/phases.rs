//! M from the present state to a field, with the switch of δ̂ placed exactly.
//!
//! While δ̂ = 0 the irreversible part is frozen and M solves M = (1 − c)·Mirr + c·Man(H + αM).
//! The switch is where Man = Mirr = M:  H* = a·curve⁻¹(Mirr/Ms) − α·Mirr,  M* = Mirr.
//! So a reversal costs no integration until H*, and no step of the integration straddles the kink;
//! δ̂ cannot switch again before the next reversal. From (3) and (5) of the paper.

use super::coefficients::Coefficients;
use super::{Hysteresis, MagneticState};
use crate::Anhysteretic;
use crate::curve::{Curve, Fraction, IsingEverywhere, LangevinByRange};
use crate::number::lanes::Single;

/// More substeps than this are not taken in one call; the rest of the way, far in saturation, follows Man.
pub(crate) const MOST_SUBSTEPS: u32 = 100_000;

/// How much longer than [`Hysteresis::longest_substep_a_per_m`] substeps are where a displacement is all that counts:
/// sixteen times the error, 5 pm on the paper's rod.
pub(crate) const COARSE: f64 = 2.0;

/// Length of the stride (A/m) that starts where dM/dH is `slope`.
///
/// With positive coupling the effective field runs ahead of the field, dHe/dH = 1 + α·dM/dH, and near a steep flank
/// the fixed rule is too long (1e-5 Ms on the Ising reference curve with αMs/a = 1.09); this keeps the step in He.
#[inline(always)]
pub(crate) fn stride(longest: f64, coupling: f64, slope: f64) -> f64 {
    if coupling <= 0.0 {
        return longest;
    }
    let ahead = (1.0 + coupling * slope) * (1.0 / 1.5);
    if ahead > 1e3 {
        longest * 1e-3
    } else if ahead > 1.0 {
        longest / ahead
    } else {
        longest
    }
}

/// Mean of the cubic through two values with given rises, slope times width, at its ends.
#[inline(always)]
pub(crate) fn mean_of_cubic(from: f64, to: f64, rise_from: f64, rise_to: f64) -> f64 {
    0.5 * (from + to) + (rise_from - rise_to) * (1.0 / 12.0)
}

/// The frozen part of a phase with δ̂ = 0.
#[derive(Clone, Copy)]
pub(super) struct Bending {
    pub irreversible: f64,
    pub switch_field: f64,
}

impl Hysteresis {
    /// The state after the field has moved monotonically to `field_to_a_per_m`.
    ///
    /// Fourth order with substeps of at most [`Hysteresis::longest_substep_a_per_m`]: error of the order
    /// 1e-9 Ms over a loop. The result is continuous in the end field. A field that is not finite gives a
    /// magnetization that is not a number: nothing is guessed.
    pub fn advance(&self, state: MagneticState, field_to_a_per_m: f64) -> MagneticState {
        let longest = self.longest_substep_a_per_m();
        match self.anhysteretic {
            Anhysteretic::Langevin => self.advance_on::<LangevinByRange>(state, field_to_a_per_m, longest).0,
            Anhysteretic::Ising => self.advance_on::<IsingEverywhere>(state, field_to_a_per_m, longest).0,
        }
    }

    /// As [`Hysteresis::advance`], and the bulge: mean M on the way, the field going straight, less the mean of its ends (A/m). It is what a
    /// rod between samples feels beyond a straight line.
    pub fn advance_with_bulge(&self, state: MagneticState, field_to_a_per_m: f64) -> (MagneticState, f64) {
        let longest = self.longest_substep_a_per_m();
        let (end, mean) = match self.anhysteretic {
            Anhysteretic::Langevin => self.advance_on::<LangevinByRange>(state, field_to_a_per_m, longest),
            Anhysteretic::Ising => self.advance_on::<IsingEverywhere>(state, field_to_a_per_m, longest),
        };
        let ends = 0.5 * (state.magnetization_a_per_m + end.magnetization_a_per_m);
        (end, mean - ends)
    }

    /// As [`Hysteresis::advance`] to 1e-7 Ms, with longer substeps, and the mean magnetization (A/m) on the way: what a
    /// rod feels of a whole tick.
    #[inline]
    pub(crate) fn advance_with_mean(&self, state: MagneticState, field_to_a_per_m: f64) -> (MagneticState, f64) {
        let longest = COARSE * self.longest_substep_a_per_m();
        match self.anhysteretic {
            Anhysteretic::Langevin => self.advance_on::<LangevinByRange>(state, field_to_a_per_m, longest),
            Anhysteretic::Ising => self.advance_on::<IsingEverywhere>(state, field_to_a_per_m, longest),
        }
    }

    /// dM/dH at a state for a rising or a falling field: the derived form of (7), no unit.
    pub fn slope(&self, state: MagneticState, rising: bool) -> f64 {
        match self.anhysteretic {
            Anhysteretic::Langevin => self.slope_on::<LangevinByRange>(state, rising),
            Anhysteretic::Ising => self.slope_on::<IsingEverywhere>(state, rising),
        }
    }

    #[inline]
    fn slope_on<C: Curve<f64>>(&self, state: MagneticState, rising: bool) -> f64 {
        let direction = if rising { 1.0 } else { -1.0 };
        let coefficients = Coefficients::of(self, direction);
        let (field, magnetization) = (state.field_a_per_m, state.magnetization_a_per_m);
        let fraction = coefficients.curve::<C>(field, magnetization);
        if coefficients.lag(&fraction, magnetization) * direction < 0.0 {
            coefficients.bending_slope(&fraction)
        } else {
            coefficients.slope_from(&fraction, magnetization)
        }
    }

    #[inline(always)]
    fn advance_on<C: Curve<f64>>(&self, state: MagneticState, field_to: f64, longest: f64) -> (MagneticState, f64) {
        let change = field_to - state.field_a_per_m;
        if change == 0.0 {
            return (state, state.magnetization_a_per_m);
        }
        let at_end = |magnetization_a_per_m: f64| MagneticState {
            field_a_per_m: field_to,
            magnetization_a_per_m,
        };
        if !change.is_finite() {
            return (at_end(f64::NAN), f64::NAN);
        }
        let direction = if change > 0.0 { 1.0 } else { -1.0 };
        let coefficients = Coefficients::of(self, direction);
        let (mut field, mut magnetization) = (state.field_a_per_m, state.magnetization_a_per_m);
        let mut fraction = coefficients.curve::<C>(field, magnetization);
        // Of M over H.
        let mut integral = 0.0;
        if coefficients.lag(&fraction, magnetization) * direction < 0.0 {
            let tangent = coefficients.bending_slope(&fraction);
            let (bent, still_frozen, slope) = self.bend::<C>(&coefficients, &fraction, state, field_to);
            if still_frozen {
                return (
                    at_end(bent),
                    mean_of_cubic(magnetization, bent, change * tangent, change * slope),
                );
            }
            // Only now is the switch field worth its inverse curve.
            (field, magnetization) = self.frozen(state).switch_from(field, magnetization, direction);
            fraction = coefficients.curve::<C>(field, magnetization);
            let frozen = field - state.field_a_per_m;
            let slope = coefficients.bending_slope(&fraction);
            integral = frozen
                * mean_of_cubic(
                    state.magnetization_a_per_m,
                    magnetization,
                    frozen * tangent,
                    frozen * slope,
                );
        }
        let (magnetization, marched) =
            self.march::<f64, C>(&coefficients, &fraction, field, magnetization, field_to, longest);
        (at_end(magnetization), (integral + marched) / change)
    }

    /// The magnetization at `field_to`, with δ̂ = 1 all the way, and ∫ M dH up to there. Carried numbers other than `f64` do not change
    /// the strides.
    #[inline(always)]
    pub(super) fn march<N: Single, C: Curve<N>>(
        &self,
        coefficients: &Coefficients<N>,
        present: &Fraction<N>,
        mut field: N,
        mut magnetization: N,
        field_to: f64,
        longest: f64,
    ) -> (N, N) {
        let end = N::splat(field_to);
        let direction = if coefficients.pinning.value() > 0.0 { 1.0 } else { -1.0 };
        let mut integral = N::splat(0.0);
        let mut first = coefficients.slope_from(present, magnetization);
        // Full strides and then the rest, not equal parts: the result stays continuous in the end field.
        for _ in 0..MOST_SUBSTEPS {
            let stride = stride(longest, self.coupling, first.value());
            let rest = end - field;
            let last = rest.value().abs() <= stride;
            let step = if last { rest } else { N::splat(direction * stride) };
            let (next, mean) = coefficients.step_with_mean::<C>(field, magnetization, step, first);
            magnetization = next;
            integral = integral + step * mean;
            if last {
                return (magnetization, integral);
            }
            field = field + step;
            first = coefficients.slope::<C>(field, magnetization);
        }
        let fraction = coefficients.curve::<C>(end, magnetization);
        let saturated = coefficients.saturation * (fraction.x * fraction.numerator) / fraction.denominator;
        (saturated, integral + (end - field) * saturated)
    }

    /// The frozen part of a state in which δ̂ = 0.
    pub(super) fn frozen(&self, state: MagneticState) -> Bending {
        let irreversible = self.irreversible(state);
        let relative = irreversible / self.saturation_magnetization_a_per_m;
        let switch_field = self.shape_a_per_m * self.anhysteretic.inverse(relative) - self.coupling * irreversible;
        Bending {
            irreversible,
            switch_field,
        }
    }

    /// Solves M = (1 − c)·Mirr + c·Man(H + αM) by Newton inside its bracket ±c·Ms, from the tangent at the present state;
    /// also says whether δ̂ is still 0 there, that is, whether Man has not passed Mirr, and dM/dH there if so.
    #[inline(always)]
    pub(super) fn bend<C: Curve<f64>>(
        &self,
        coefficients: &Coefficients<f64>,
        present: &Fraction<f64>,
        state: MagneticState,
        field: f64,
    ) -> (f64, bool, f64) {
        let c = self.reversibility;
        let saturation = self.saturation_magnetization_a_per_m;
        let direction = if field > state.field_a_per_m { 1.0 } else { -1.0 };
        let q = present.denominator;
        let man = saturation * (present.x * present.numerator) / q;
        let irreversible = (state.magnetization_a_per_m - c * man) / (1.0 - c);
        let frozen = (1.0 - c) * irreversible;
        let spread = c * saturation;
        let (mut low, mut high) = (frozen - spread, frozen + spread);
        let tangent = coefficients.bending_slope(present);
        let guess = state.magnetization_a_per_m + tangent * (field - state.field_a_per_m);
        let mut magnetization = if guess >= low && guess <= high { guess } else { frozen };
        let (mut man_there, mut slope) = (man, tangent);
        for _ in 0..60 {
            let fraction = coefficients.curve::<C>(field, magnetization);
            let q = fraction.denominator;
            let q_squared = q * q;
            let man = saturation * (fraction.x * fraction.numerator) * q;
            let excess = (magnetization - frozen) * q_squared - c * man;
            if excess > 0.0 {
                high = magnetization;
            } else {
                low = magnetization;
            }
            let steepness = q_squared - coefficients.coupling * coefficients.reversible_gain * fraction.derivative;
            let next = magnetization - excess / steepness;
            let next = if next >= low && next <= high {
                next
            } else {
                0.5 * (low + high)
            };
            let moved = (next - magnetization).abs();
            let susceptibility = saturation * coefficients.inverse_shape * fraction.derivative;
            man_there = (man + coefficients.coupling * susceptibility * (next - magnetization)) / q_squared;
            magnetization = next;
            slope = coefficients.reversible_gain * fraction.derivative / steepness;
            // Newton converges quadratically: after a move of 1e-9 the next one is below rounding.
            if moved <= 1e-9 * spread {
                break;
            }
        }
        (magnetization, (man_there - irreversible) * direction <= 0.0, slope)
    }
}

impl Bending {
    /// Where integration starts: at the switch, or here if rounding puts the switch behind us.
    #[inline(always)]
    pub(super) fn switch_from(&self, field: f64, magnetization: f64, direction: f64) -> (f64, f64) {
        if (self.switch_field - field) * direction > 0.0 {
            (self.switch_field, self.irreversible)
        } else {
            (field, magnetization)
        }
    }
}
