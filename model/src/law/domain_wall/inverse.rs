//! H from the present state to a magnetization: dH/dM = 1/F(H, M), on the body of `phases.rs`.
//!
//! While δ̂ = 0:  H = a·curve⁻¹((M − (1 − c)·Mirr)/(c·Ms)) − αM − b₃M³;  δ̂ switches at M* = Mirr, H* (as forward).
//! Then a second-order step of dH/dM predicts the field, and one correction by the *forward* step's end, its slope and the bend of the
//! cubic H(M) through both ends finds it. It is not confirmed by another forward step: `advance(state, field)` returns the demanded
//! magnetization to 1e-12 Ms (1.1e-13 along a drive at 20 kHz, `tests/accuracy.rs`), a thousandth of the forward step's own error.
//! The inverse has no memory of its own: an open-loop memory drifts away from the plant.

use super::coefficients::{Coefficients, Point};
use super::phases::{Goal, integrate};
use super::single::{Way, WholeSubsteps};
use super::{Hysteresis, MagneticState, on_kernel};
use crate::kernel::{Curve, Fraction, Kernel};

/// Answer to a demanded magnetization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inversion {
    /// Where the material ends. A demand that is met is its magnetization, and `advance(state, this field)` gives it to 1e-12 Ms; else
    /// the state is exactly `advance(state, this field)`.
    pub state: MagneticState,
    /// The demand needs more field than the limit (or is not a number); the state is at the limit.
    pub limited: bool,
    /// dM/dH at the end, in the direction taken; to 1e-5 of itself where the demand is met.
    pub slope: f64,
}

/// A correction is the last one if its square over the whole change, times the cube of what the slope changes by, is at most so much, in
/// Ms: the cubic through both ends then errs by far less.
const SURE: f64 = 2e-13;
/// What a slope may change by within a step that ends as it began.
const BENT: f64 = 0.05;

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
        let met = |field_a_per_m: f64, slope: f64| Inversion {
            state: MagneticState {
                field_a_per_m,
                magnetization_a_per_m: target,
            },
            limited: false,
            slope,
        };
        let (start, _) = if way.is_frozen {
            let irreversible = coefficients.irreversible(&way.present, from);
            let before_switch = (irreversible - target) * direction >= 0.0;
            if before_switch && self.reversibility > 0.0 {
                let (end, slope) = self.bending_to(&coefficients, &way.present, from, target);
                // Rounding may put the answer a hair behind the present field: then nothing has to move.
                return if (end - limit_field) * direction >= 0.0 {
                    ended(self.advance(state, limit_field), true)
                } else if (end - state.field_a_per_m) * direction > 0.0 {
                    met(end, slope)
                } else {
                    ended(state, false)
                };
            }
            let switch = self.switch_of(irreversible);
            if (switch.field - limit_field) * direction >= 0.0 {
                return ended(self.advance(state, limit_field), true);
            }
            if before_switch {
                let moves = (switch.field - state.field_a_per_m) * direction > 0.0;
                let end = if moves {
                    self.advance(state, switch.field)
                } else {
                    state
                };
                return ended(end, false);
            }
            way.after(switch)
        } else {
            way.here()
        };
        let mut search = Search {
            coefficients: &coefficients,
            substeps: WholeSubsteps { direction },
            target,
            tolerance: 1e-13 * self.saturation_magnetization_a_per_m,
            sure: SURE * self.saturation_magnetization_a_per_m,
            answer: None,
        };
        let longest = self.longest_substep_a_per_m();
        let (at_limit, _) = integrate(&coefficients, start, limit_field, longest, &mut search);
        match search.answer {
            // A hair past the switch the forward model may still call the walls frozen: take its word for it.
            Some(found) if way.is_frozen => ended(self.advance(state, found.field), false),
            Some(found) => met(found.field, found.slope),
            None => {
                let end = MagneticState {
                    field_a_per_m: limit_field,
                    magnetization_a_per_m: at_limit,
                };
                ended(end, true)
            }
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

    /// Closed form of the phase with δ̂ = 0: field and slope; ±∞ where wall bending alone cannot reach the target.
    #[inline(always)]
    fn bending_to<C: Curve<f64>, const CUBIC: bool>(
        &self,
        coefficients: &Coefficients<f64, C, CUBIC>,
        present: &Fraction<f64>,
        from: f64,
        target: f64,
    ) -> (f64, f64) {
        // c·Man has to change by what M does.
        let change = (target - from) / (self.reversibility * self.saturation_magnetization_a_per_m);
        let (argument, rise) = self.argument_near::<C>(present, change);
        let bending = coefficients.reversible_gain * rise;
        (
            self.shape_a_per_m * argument - coefficients.coupling_field(target),
            bending / (1.0 - coefficients.tangent(target) * bending),
        )
    }

    /// The x of a value of the curve that differs by `change` from a near one, and the curve's slope there: Newton from the near x, with
    /// the bend that two slopes show.
    #[inline(always)]
    fn argument_near<C: Curve<f64>>(&self, near: &Fraction<f64>, change: f64) -> (f64, f64) {
        let rise = |at: &Fraction<f64>| at.derivative / (at.denominator * at.denominator);
        let value = near.x * near.numerator / near.denominator + change;
        let mut before = (near.x, rise(near));
        let mut x = near.x + change * (near.denominator * near.denominator) / near.derivative;
        for _ in 0..4 {
            if x.is_nan() || x.abs() >= 20.0 {
                break;
            }
            if x == before.0 {
                return before;
            }
            let fraction = C::fraction(x);
            let slope = rise(&fraction);
            let moved = x - before.0;
            let bend = (slope - before.1) / moved;
            let missing = value * fraction.denominator - fraction.x * fraction.numerator;
            let step = missing * fraction.denominator / fraction.derivative;
            before = (x, slope);
            x += step * (1.0 - 0.5 * step * bend / slope);
            // What the bend, known from the last move, leaves out.
            if step * step * moved.abs() <= 1e-12 {
                return (x, slope + bend * step);
            }
        }
        let x = self.anhysteretic.inverse(value);
        (x, self.anhysteretic.derivative(x))
    }
}

/// Integration towards a magnetization, in the forward model's own substeps.
struct Search<'a, C, const CUBIC: bool> {
    coefficients: &'a Coefficients<f64, C, CUBIC>,
    substeps: WholeSubsteps,
    target: f64,
    /// Accepted residual of the magnetization, A/m.
    tolerance: f64,
    /// [`SURE`] in A/m.
    sure: f64,
    answer: Option<Found>,
}

/// Where the target is met.
struct Found {
    field: f64,
    /// dM/dH there.
    slope: f64,
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
    /// Predictor dH/dM, corrected by the forward step; false (nothing found) if that leaves the substep.
    fn newton(&mut self, from: Point<f64>, reach: f64) -> bool {
        let direction = self.substeps.direction;
        let mut distance = self.predict(from) * direction;
        for _ in 0..8 {
            if !(distance > 0.0 && distance <= reach) {
                return false;
            }
            let (end, magnetization) = self.at_distance(from, distance);
            let missing = self.target - magnetization;
            if missing.abs() <= self.tolerance {
                self.found(end, magnetization);
                return true;
            }
            let moved = magnetization - from.magnetization;
            let gained = 1.0 / moved;
            let [rise, run] = self.coefficients.ratio(end, magnetization);
            let [first, last] = [1.0 / from.slope, run / rise];
            let bend = (2.0 * first + 4.0 * last - 6.0 * (end - from.field) * gained) * gained;
            let change = missing * (last + 0.5 * bend * missing) * direction;
            let bent = BENT + (rise / run * first - 1.0).abs();
            let is_last = missing.abs() <= 0.1 * moved.abs()
                && missing * missing * (bent * bent * bent) <= self.sure * moved.abs();
            distance += change;
            if is_last && distance > 0.0 && distance <= reach {
                self.answer = Some(Found {
                    field: from.field + direction * distance,
                    slope: 1.0 / (last + bend * missing),
                });
                return true;
            }
        }
        false
    }

    fn found(&mut self, field: f64, magnetization: f64) {
        self.answer = Some(Found {
            field,
            slope: self.coefficients.slope(field, magnetization),
        });
    }

    /// One second-order step of dH/dM = 1/F; the field change.
    fn predict(&self, from: Point<f64>) -> f64 {
        let change = self.target - from.magnetization;
        let half = 0.5 * change;
        let middle = from.field + half / from.slope;
        let [rise, run] = self.coefficients.ratio(middle, from.magnetization + half);
        change * run / rise
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
        self.found(best.0, best.1);
    }
}
