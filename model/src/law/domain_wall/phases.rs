//! M along a monotone way of the field, with the switch of δ̂ placed exactly: the one body that a single model, its
//! derivatives, a bank and the inverse run, generic over the number that is carried.
//!
//! While δ̂ = 0 the irreversible part is frozen and M solves M = (1 − c)·Mirr + c·Man(H + αM + b₃M³).
//! The switch is where Man = Mirr = M:  H* = a·curve⁻¹(Mirr/Ms) − αMirr − b₃Mirr³,  M* = Mirr.
//! So a reversal costs no integration until H*, and no step of the integration straddles the kink;
//! δ̂ cannot switch again before the next reversal. From (3) and (5) of the paper.
//! What must differ is a [`Branch`]: one material works out its frozen part when it is needed, a bank stores it at reversals;
//! and a [`Goal`]: whole substeps or equal parts of each lane's way, to a field or to a magnetization.

use super::coefficients::{Coefficients, Point};
use crate::kernel::{Curve, Fraction};
use crate::number::Number;

/// More substeps than this are not taken in one call; the rest of the way, far in saturation, follows Man.
const MAX_SUBSTEPS: u32 = 100_000;
/// What Newton's rule may leave out of M while δ̂ = 0, in Ms: a thousandth of a step's error.
const MAX_LEFT: f64 = 3e-13;

/// Where the reversible phase ends.
pub(super) struct Reversible<N> {
    pub magnetization: N,
    /// Mean of M over the way.
    pub mean: N,
    /// Below 0 where δ̂ has become 1 before the end.
    pub before_switch: N,
}

/// A way of the field from where it is, and what is known of the frozen part.
pub(super) trait Branch<N: Number> {
    /// The reversible phase up to the way's end; none where δ̂ is 1 by then in any case.
    fn reversible(&self) -> Option<Reversible<N>>;
    /// Where integration starts, and ∫ M dH up to there.
    fn start(&self) -> (Point<N>, N);
    /// How to get from the field there to the end.
    fn goal(&self, field: N) -> impl Goal<N>;
}

/// What an integration is made for.
pub(super) trait Goal<N> {
    /// The next substep, of at most so many A/m, and whether it is the last one.
    fn substep(&mut self, rest: N, longest: f64) -> (N, bool);
    /// The substep need not be made: its inside already answers.
    #[inline(always)]
    fn is_inside(&mut self, _from: Point<N>, _step: N) -> bool {
        false
    }
    /// As that, from the magnetization that the substep leads to.
    #[inline(always)]
    fn is_passed(&mut self, _from: Point<N>, _step: N, _reached: N) -> bool {
        false
    }
}

/// M at the end of a way to the field `to`, and its mean over the way.
#[inline(always)]
pub(super) fn advance<N: Number, C: Curve<N>, const CUBIC: bool>(
    coefficients: &Coefficients<N, C, CUBIC>,
    branch: &impl Branch<N>,
    [from, to]: [f64; 2],
    longest: f64,
) -> (N, N) {
    let zero = N::splat(0.0);
    let reversible = branch.reversible();
    if let Some(reversible) = &reversible {
        let switched = (zero - reversible.before_switch).largest() > 0.0;
        if !switched {
            return (reversible.magnetization, reversible.mean);
        }
    }
    let (start, before) = branch.start();
    let mut goal = branch.goal(start.field);
    let (end, integral) = integrate(coefficients, start, to, longest, &mut goal);
    let end = match reversible {
        Some(reversible) => zero.where_greater(reversible.before_switch, end, reversible.magnetization),
        None => end,
    };
    (end, (before + integral) / N::splat(to - from))
}

/// M at the field `to` with δ̂ = 1 all the way, and ∫ M dH on the way; of no meaning once the goal was met before.
#[inline(always)]
pub(super) fn integrate<N: Number, C: Curve<N>, const CUBIC: bool>(
    coefficients: &Coefficients<N, C, CUBIC>,
    mut at: Point<N>,
    to: f64,
    longest: f64,
    goal: &mut impl Goal<N>,
) -> (N, N) {
    let end = N::splat(to);
    let mut integral = N::splat(0.0);
    // Full substeps and then the rest, not equal parts: the result stays continuous in the end field.
    for _ in 0..MAX_SUBSTEPS {
        let coupling = coefficients.tangent(at.magnetization).largest();
        let slope = if coupling > 0.0 { at.slope.largest() } else { 0.0 };
        let (step, last) = goal.substep(end - at.field, substep(longest, coupling, slope));
        if goal.is_inside(at, step) {
            return (at.magnetization, integral);
        }
        let (reached, mean) = coefficients.step(at, step);
        if goal.is_passed(at, step, reached) {
            return (at.magnetization, integral);
        }
        integral = integral + step * mean;
        if last {
            return (reached, integral);
        }
        at.field = at.field + step;
        at.magnetization = reached;
        at.slope = coefficients.slope(at.field, at.magnetization);
    }
    let saturated = coefficients.anhysteretic(&coefficients.curve(end, at.magnetization));
    (saturated, integral + (end - at.field) * saturated)
}

/// Length of the substep (A/m) that starts where dM/dH is `slope`.
///
/// With positive coupling the effective field runs ahead of the field, dHe/dH = 1 + α·dM/dH, and near a steep flank
/// the fixed rule is too long (1e-5 Ms on the Ising reference curve with αMs/a = 1.09); this keeps the step in He.
#[inline(always)]
fn substep(longest: f64, coupling: f64, slope: f64) -> f64 {
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
pub(super) fn mean_of_cubic<N: Number>([from, to]: [N; 2], [rise_from, rise_to]: [N; 2]) -> N {
    N::splat(0.5) * (from + to) + (rise_from - rise_to) * N::splat(1.0 / 12.0)
}

/// The reversible phase at one field.
pub(super) struct Solution<N> {
    pub magnetization: N,
    /// Man there.
    pub anhysteretic: N,
    /// dM/dH there.
    pub slope: N,
}

impl<N: Number, C: Curve<N>, const CUBIC: bool> Coefficients<N, C, CUBIC> {
    /// Solves M = (1 − c)·Mirr + c·Man by Newton inside its bracket ±c·Ms; `frozen` is (1 − c)·Mirr, `bent` is c·Man·Q² as its caller
    /// rounds it.
    #[inline(always)]
    pub(super) fn solve_reversible(
        &self,
        field: N,
        frozen: N,
        guess: N,
        bent: impl Fn(&Fraction<N>) -> N,
    ) -> Solution<N> {
        let zero = N::splat(0.0);
        let spread = self.reversibility * self.saturation;
        let (mut low, mut high) = (frozen - spread, frozen + spread);
        let mut magnetization = guess.where_within(low, high, frozen);
        let mut solution;
        let mut iterations = 0;
        loop {
            let fraction = self.curve(field, magnetization);
            let q_squared = fraction.denominator * fraction.denominator;
            let tangent = self.tangent(magnetization);
            let bending = self.reversible_gain * fraction.derivative;
            let excess = ((magnetization - frozen) * q_squared - bent(&fraction)).alone();
            high = excess.where_greater(zero, magnetization, high);
            low = excess.where_greater(zero, low, magnetization);
            let steepness = (q_squared - tangent * self.reversible_gain * fraction.derivative).alone();
            let newton = magnetization - excess / steepness;
            let next = newton.where_within(low, high, N::splat(0.5) * (low + high));
            let moved = next - magnetization;
            let susceptibility = self.saturation * self.inverse_shape * fraction.derivative;
            let man = (self.saturation * (fraction.x * fraction.numerator) * fraction.denominator).alone();
            solution = Solution {
                magnetization: next,
                anhysteretic: (man + tangent * susceptibility * moved) / q_squared,
                slope: bending / steepness,
            };
            magnetization = next;
            iterations += 1;
            // What a Newton step leaves out is at most half the second derivative of the excess, of which |curve''| < 0.8 is a part, times
            // its square (`tests/accuracy.rs` holds the errors).
            let mut bend = N::splat(0.4) * (tangent * tangent) * self.inverse_shape;
            if CUBIC {
                bend = bend + (self.triple_cubic * magnetization).abs();
            }
            let left = self.reversible_gain * bend * (moved * moved) + (next - newton).abs();
            let beyond = left * q_squared - N::splat(MAX_LEFT) * self.saturation * steepness;
            if beyond.largest() <= 0.0 || iterations == 60 {
                return solution;
            }
        }
    }
}
