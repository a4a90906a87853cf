//! H from the present state to a magnetization: dH/dM = 1/F(H, M), the inverse of `advance.rs`.
//!
//! While δ̂ = 0:  H = a·curve⁻¹((M − (1 − c)·Mirr)/(c·Ms)) − α·M;  δ̂ switches at M* = Mirr, H* (as forward).
//! Then one fourth-order step of dH/dM predicts the field, and Newton on the *forward* step corrects it, so that
//! `advance(state, field)` returns the demanded magnetization to about 1e-15 Ms and the very same bits as the result here.
//! The inverse has no memory of its own: an open-loop memory drifts away from the plant.

use super::coefficients::Coefficients;
use super::phases::{MOST_SUBSTEPS, stride};
use super::{Hysteresis, MagneticState};
use crate::Anhysteretic;
use crate::curve::{Curve, IsingEverywhere, LangevinByRange};

/// Answer to a demanded magnetization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inversion {
    /// Where the material ends: exactly `advance(state, this field)`.
    pub state: MagneticState,
    /// The demand needs more field than the limit (or is not a number); the state is at the limit.
    pub limited: bool,
    /// dM/dH at the end, in the direction taken.
    pub slope: f64,
}

/// One stretch of integration with δ̂ = 1, towards a magnetization.
struct Search<'a> {
    coefficients: &'a Coefficients<f64>,
    direction: f64,
    target: f64,
    /// Accepted residual of the magnetization, A/m.
    tolerance: f64,
    field: f64,
    magnetization: f64,
}

enum Outcome {
    Met,
    AtLimit,
    /// The limit is further away than the model marches.
    GaveUp,
}

impl Hysteresis {
    /// Moves the field monotonically until the magnetization is `magnetization_to_a_per_m`, but not past
    /// ±`field_limit_a_per_m` (its magnitude is used). A demand for the present magnetization stays where it is.
    /// A demand that is not a number moves nothing and reports `limited`. Finite input gives finite output.
    pub fn advance_to_magnetization(
        &self,
        state: MagneticState,
        magnetization_to_a_per_m: f64,
        field_limit_a_per_m: f64,
    ) -> Inversion {
        let (target, limit) = (magnetization_to_a_per_m, field_limit_a_per_m.abs());
        let inversion = match self.anhysteretic {
            Anhysteretic::Langevin => self.invert_on::<LangevinByRange>(state, target, limit),
            Anhysteretic::Ising => self.invert_on::<IsingEverywhere>(state, target, limit),
        };
        if inversion.state.field_a_per_m.abs() > limit {
            // The state was beyond the limit and the demand does not bring it back.
            return self.at_limit(state, limit);
        }
        inversion
    }

    fn invert_on<C: Curve<f64>>(&self, state: MagneticState, target: f64, limit: f64) -> Inversion {
        let rising = target > state.magnetization_a_per_m;
        let falling = target < state.magnetization_a_per_m;
        if !rising && !falling {
            // Equal, or not a number.
            return Inversion {
                state,
                limited: target.is_nan(),
                slope: self.slope(state, true),
            };
        }
        let direction = if rising { 1.0 } else { -1.0 };
        let limit_field = direction * limit;
        let ended = |state: MagneticState, limited: bool| Inversion {
            state,
            limited,
            slope: self.slope(state, rising),
        };
        if (limit_field - state.field_a_per_m) * direction <= 0.0 {
            return self.at_limit(state, limit);
        }
        let coefficients = Coefficients::of(self, direction);
        let (mut field, mut magnetization) = (state.field_a_per_m, state.magnetization_a_per_m);
        let mut switched = false;
        let mut fraction = coefficients.curve::<C>(field, magnetization);
        if coefficients.lag(&fraction, magnetization) * direction < 0.0 {
            let bending = self.frozen(state);
            let before_switch = (bending.irreversible - target) * direction >= 0.0;
            let end = if before_switch && self.reversibility > 0.0 {
                self.bent_field(bending.irreversible, target)
            } else {
                bending.switch_field
            };
            if (end - limit_field) * direction >= 0.0 {
                return ended(self.advance(state, limit_field), true);
            }
            if before_switch {
                // Rounding may put the answer a hair behind the present field: then nothing has to move.
                let moves = (end - state.field_a_per_m) * direction > 0.0;
                return ended(if moves { self.advance(state, end) } else { state }, false);
            }
            (field, magnetization) = bending.switch_from(field, magnetization, direction);
            fraction = coefficients.curve::<C>(field, magnetization);
            switched = true;
        }
        let tolerance = 4.0 * f64::EPSILON * self.saturation_magnetization_a_per_m;
        let mut search = Search {
            coefficients: &coefficients,
            direction,
            target,
            tolerance,
            field,
            magnetization,
        };
        let first = coefficients.slope_from(&fraction, magnetization);
        let outcome = search.run::<C>(limit_field, self.longest_substep_a_per_m(), first);
        let end = MagneticState {
            field_a_per_m: search.field,
            magnetization_a_per_m: search.magnetization,
        };
        match outcome {
            // A hair past the switch the forward model may still call the walls frozen: take its word for it.
            Outcome::Met if switched => ended(self.advance(state, end.field_a_per_m), false),
            Outcome::Met => ended(end, false),
            Outcome::AtLimit => ended(end, true),
            Outcome::GaveUp => ended(self.advance(state, limit_field), true),
        }
    }

    fn at_limit(&self, state: MagneticState, limit: f64) -> Inversion {
        let end = self.advance(state, limit.copysign(state.field_a_per_m));
        let rising = end.field_a_per_m > state.field_a_per_m;
        Inversion {
            state: end,
            limited: true,
            slope: self.slope(end, rising),
        }
    }

    /// Closed form of the phase with δ̂ = 0; ±∞ where wall bending alone cannot reach the target.
    fn bent_field(&self, irreversible: f64, target: f64) -> f64 {
        let c = self.reversibility;
        let relative = (target - (1.0 - c) * irreversible) / (c * self.saturation_magnetization_a_per_m);
        self.shape_a_per_m * self.anhysteretic.inverse(relative) - self.coupling * target
    }
}

impl Search<'_> {
    /// Marches with the forward model's own strides.
    fn run<C: Curve<f64>>(&mut self, limit_field: f64, longest: f64, mut first: f64) -> Outcome {
        for _ in 0..MOST_SUBSTEPS {
            let available = (limit_field - self.field) * self.direction;
            if available <= 0.0 {
                return Outcome::AtLimit;
            }
            let stride = stride(longest, self.coefficients.coupling, first);
            let reach = if available < stride { available } else { stride };
            let straight = (self.target - self.magnetization) / first * self.direction;
            if straight < 2.0 * reach && self.within_stride::<C>(first, reach) {
                return Outcome::Met;
            }
            let last = available <= stride;
            let step = if last {
                limit_field - self.field
            } else {
                self.direction * stride
            };
            let full = self
                .coefficients
                .step_from::<C>(self.field, self.magnetization, step, first);
            if (full - self.target) * self.direction >= 0.0 {
                self.bisect::<C>(first, reach);
                return Outcome::Met;
            }
            self.field = if last { limit_field } else { self.field + step };
            self.magnetization = full;
            first = self.coefficients.slope::<C>(self.field, self.magnetization);
        }
        Outcome::GaveUp
    }

    /// Predictor dH/dM and Newton on the forward step; false (nothing moved) if that leaves the stride.
    fn within_stride<C: Curve<f64>>(&mut self, first: f64, reach: f64) -> bool {
        let mut distance = self.predict::<C>(first) * self.direction;
        for _ in 0..8 {
            if !(distance > 0.0 && distance <= reach) {
                return false;
            }
            let (end, magnetization) = self.try_distance::<C>(first, distance);
            let excess = (magnetization - self.target) * self.direction;
            if excess.abs() <= self.tolerance {
                (self.field, self.magnetization) = (end, magnetization);
                return true;
            }
            distance -= excess / self.coefficients.slope::<C>(end, magnetization);
        }
        false
    }

    /// One fourth-order step of dH/dM = 1/F; the field change.
    fn predict<C: Curve<f64>>(&self, first: f64) -> f64 {
        let (h, m) = (self.field, self.magnetization);
        let change = self.target - m;
        let half = 0.5 * change;
        let inverse = |field, magnetization| 1.0 / self.coefficients.slope::<C>(field, magnetization);
        let one = 1.0 / first;
        let two = inverse(h + half * one, m + half);
        let three = inverse(h + half * two, m + half);
        let four = inverse(h + change * three, m + change);
        change * (1.0 / 6.0) * ((one + four) + 2.0 * (two + three))
    }

    /// End field and magnetization as `advance` will compute them for that end field.
    #[inline(always)]
    fn try_distance<C: Curve<f64>>(&self, first: f64, distance: f64) -> (f64, f64) {
        let end = self.field + self.direction * distance;
        let step = end - self.field;
        (
            end,
            self.coefficients
                .step_from::<C>(self.field, self.magnetization, step, first),
        )
    }

    /// The target is known to lie within `reach`: halve (slow, but sure) until rounding.
    fn bisect<C: Curve<f64>>(&mut self, first: f64, reach: f64) {
        let (mut low, mut high) = (0.0, reach);
        let mut best = self.try_distance::<C>(first, reach);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            let trial = self.try_distance::<C>(first, middle);
            let excess = (trial.1 - self.target) * self.direction;
            if excess.abs() < (best.1 - self.target).abs() {
                best = trial;
            }
            if excess.abs() <= self.tolerance {
                break;
            }
            if excess > 0.0 {
                high = middle;
            } else {
                low = middle;
            }
        }
        (self.field, self.magnetization) = best;
    }
}
