//! H from the present state to a magnetization: dH/dM = 1/F(H, M), on the body of `phases.rs`.
//!
//! While δ̂ = 0:  H = a·curve⁻¹((M − (1 − c)·Mirr)/(c·Ms)) − αM − b₃M³;  δ̂ switches at M* = Mirr, H* (as forward).
//! Then one fourth-order step of dH/dM predicts the field, and Newton on the *forward* step corrects it, so that
//! `advance(state, field)` returns the demanded magnetization to about 1e-15 Ms and the very same bits as the result here.
//! The inverse has no memory of its own: an open-loop memory drifts away from the plant.

use super::coefficients::{Coefficients, Point};
use super::phases::{Goal, integrate};
use super::single::{Way, WholeSubsteps};
use super::{Hysteresis, MagneticState, on_kernel};
use crate::kernel::{Curve, Kernel};

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
        let inversion = on_kernel!(self.invert(state, target, limit));
        if inversion.state.field_a_per_m.abs() > limit {
            // The state was beyond the limit and the demand does not bring it back.
            return self.at_limit(state, limit);
        }
        inversion
    }

    fn invert<C: Kernel, const CUBIC: bool>(&self, state: MagneticState, target: f64, limit: f64) -> Inversion {
        let rising = target > state.magnetization_a_per_m;
        let falling = target < state.magnetization_a_per_m;
        if !rising && !falling {
            // Equal, or not a number.
            return Inversion {
                state,
                limited: target.is_nan(),
                slope: self.slope_on::<C, CUBIC>(state, true),
            };
        }
        let direction = if rising { 1.0 } else { -1.0 };
        let limit_field = direction * limit;
        let ended = |state: MagneticState, limited: bool| Inversion {
            state,
            limited,
            slope: self.slope_on::<C, CUBIC>(state, rising),
        };
        if (limit_field - state.field_a_per_m) * direction <= 0.0 {
            return self.at_limit(state, limit);
        }
        let coefficients = Coefficients::<f64, C, CUBIC>::of(self, direction);
        let from = state.magnetization_a_per_m;
        let way = Way::<f64, C, CUBIC>::new(self, &coefficients, state, from, direction, limit_field);
        let (start, _) = if way.is_frozen {
            let switch = self.switch(state);
            let before_switch = (switch.irreversible - target) * direction >= 0.0;
            let end = if before_switch && self.reversibility > 0.0 {
                self.reversible_field(switch.irreversible, target)
            } else {
                switch.field
            };
            if (end - limit_field) * direction >= 0.0 {
                return ended(self.advance(state, limit_field), true);
            }
            if before_switch {
                // Rounding may put the answer a hair behind the present field: then nothing has to move.
                let moves = (end - state.field_a_per_m) * direction > 0.0;
                return ended(if moves { self.advance(state, end) } else { state }, false);
            }
            way.after(switch)
        } else {
            way.here()
        };
        let mut search = Search {
            coefficients: &coefficients,
            substeps: WholeSubsteps { direction },
            target,
            tolerance: 4.0 * f64::EPSILON * self.saturation_magnetization_a_per_m,
            answer: None,
        };
        let longest = self.longest_substep_a_per_m();
        let (at_limit, _) = integrate(&coefficients, start, limit_field, longest, &mut search);
        let (field_a_per_m, magnetization_a_per_m) = search.answer.unwrap_or((limit_field, at_limit));
        // A hair past the switch the forward model may still call the walls frozen: take its word for it.
        let end = if way.is_frozen && search.answer.is_some() {
            self.advance(state, field_a_per_m)
        } else {
            MagneticState {
                field_a_per_m,
                magnetization_a_per_m,
            }
        };
        ended(end, search.answer.is_none())
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
    fn reversible_field(&self, irreversible: f64, target: f64) -> f64 {
        let c = self.reversibility;
        let relative = (target - (1.0 - c) * irreversible) / (c * self.saturation_magnetization_a_per_m);
        self.shape_a_per_m * self.anhysteretic.inverse(relative) - self.coupling_field(target)
    }
}

/// Integration towards a magnetization, in the forward model's own substeps.
struct Search<'a, C, const CUBIC: bool> {
    coefficients: &'a Coefficients<f64, C, CUBIC>,
    substeps: WholeSubsteps,
    target: f64,
    /// Accepted residual of the magnetization, A/m.
    tolerance: f64,
    /// Field and magnetization, once they are found.
    answer: Option<(f64, f64)>,
}

impl<C: Curve<f64>, const CUBIC: bool> Goal<f64> for Search<'_, C, CUBIC> {
    #[inline(always)]
    fn substep(&mut self, rest: f64, longest: f64) -> (f64, bool) {
        self.substeps.substep(rest, longest)
    }

    #[inline(always)]
    fn is_inside(&mut self, from: Point<f64>, step: f64) -> bool {
        let straight = (self.target - from.magnetization) / from.slope * self.substeps.direction;
        straight < 2.0 * step.abs() && self.newton(from, step.abs())
    }

    #[inline(always)]
    fn is_passed(&mut self, from: Point<f64>, step: f64, reached: f64) -> bool {
        let passed = (reached - self.target) * self.substeps.direction >= 0.0;
        if passed {
            self.bisect(from, step.abs());
        }
        passed
    }
}

impl<C: Curve<f64>, const CUBIC: bool> Search<'_, C, CUBIC> {
    /// Predictor dH/dM and Newton on the forward step; false (nothing found) if that leaves the substep.
    fn newton(&mut self, from: Point<f64>, reach: f64) -> bool {
        let direction = self.substeps.direction;
        let mut distance = self.predict(from) * direction;
        for _ in 0..8 {
            if !(distance > 0.0 && distance <= reach) {
                return false;
            }
            let (end, magnetization) = self.at_distance(from, distance);
            let excess = (magnetization - self.target) * direction;
            if excess.abs() <= self.tolerance {
                self.answer = Some((end, magnetization));
                return true;
            }
            distance -= excess / self.coefficients.slope(end, magnetization);
        }
        false
    }

    /// One fourth-order step of dH/dM = 1/F; the field change.
    fn predict(&self, from: Point<f64>) -> f64 {
        let (h, m) = (from.field, from.magnetization);
        let change = self.target - m;
        let half = 0.5 * change;
        let inverse = |field, magnetization| 1.0 / self.coefficients.slope(field, magnetization);
        let one = 1.0 / from.slope;
        let two = inverse(h + half * one, m + half);
        let three = inverse(h + half * two, m + half);
        let four = inverse(h + change * three, m + change);
        change * (1.0 / 6.0) * ((one + four) + 2.0 * (two + three))
    }

    /// End field and magnetization as `advance` will compute them for that end field.
    #[inline(always)]
    fn at_distance(&self, from: Point<f64>, distance: f64) -> (f64, f64) {
        let end = from.field + self.substeps.direction * distance;
        (end, self.coefficients.step(from, end - from.field).0)
    }

    /// The target is known to lie within `reach`: halve (slow, but sure) until rounding.
    fn bisect(&mut self, from: Point<f64>, reach: f64) {
        let (mut low, mut high) = (0.0, reach);
        let mut best = self.at_distance(from, reach);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            let trial = self.at_distance(from, middle);
            let excess = (trial.1 - self.target) * self.substeps.direction;
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
        self.answer = Some(best);
    }
}
