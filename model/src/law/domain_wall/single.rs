//! One material on a way of the field, with or without derivatives: its frozen part is worked out only where it is needed.

use super::coefficients::{Coefficients, Point};
use super::phases::{self, Branch, Goal, Reversible, mean_of_cubic};
use super::{Hysteresis, MagneticState};
use crate::kernel::{Fraction, Kernel};
use crate::number::single::Single;

/// A monotone way from a state, in the direction of its coefficients.
pub(super) struct Way<'a, N: Single, C: Kernel, const CUBIC: bool> {
    law: &'a Hysteresis,
    coefficients: &'a Coefficients<N, N::Of<C>, CUBIC>,
    from: MagneticState,
    /// That of `from`, with what it carries.
    magnetization: N,
    pub present: Fraction<N>,
    direction: f64,
    to: f64,
    /// δ̂ = 0 where it begins.
    pub is_frozen: bool,
}

/// Where δ̂ becomes 1.
#[derive(Clone, Copy)]
pub(super) struct Switch {
    pub field: f64,
    /// Mirr, and M there.
    pub irreversible: f64,
}

/// Substeps as long as they may be, and then the rest.
pub(super) struct WholeSubsteps {
    pub direction: f64,
}

impl<N: Single> Goal<N> for WholeSubsteps {
    #[inline(always)]
    fn substep(&mut self, rest: N, longest: f64) -> (N, bool) {
        let last = rest.value().abs() <= longest;
        (if last { rest } else { N::splat(self.direction * longest) }, last)
    }
}

impl Hysteresis {
    /// M at a field, from a state with what its magnetization carries, and the mean of M on the way there.
    #[inline(always)]
    pub(super) fn travel<N: Single, C: Kernel, const CUBIC: bool>(
        &self,
        parameters: [N; 5],
        from: MagneticState,
        magnetization: N,
        to: f64,
        longest: f64,
    ) -> (N, N) {
        let change = to - from.field_a_per_m;
        if change == 0.0 {
            return (magnetization, magnetization);
        }
        if !change.is_finite() {
            let broken = magnetization * N::splat(f64::NAN);
            return (broken, broken);
        }
        let direction = if change > 0.0 { 1.0 } else { -1.0 };
        let coefficients = Coefficients::of_parameters(parameters, self.cubic_coupling_m2_per_a2, direction);
        let way = Way::<N, C, CUBIC>::new(self, &coefficients, from, magnetization, direction, to);
        phases::advance(&coefficients, &way, [from.field_a_per_m, to], longest)
    }

    pub(super) fn switch(&self, state: MagneticState) -> Switch {
        self.switch_of(self.irreversible(state))
    }

    pub(super) fn switch_of(&self, irreversible: f64) -> Switch {
        let relative = irreversible / self.saturation_magnetization_a_per_m;
        Switch {
            field: self.shape_a_per_m * self.anhysteretic.inverse(relative) - self.coupling_field(irreversible),
            irreversible,
        }
    }
}

impl<'a, N: Single, C: Kernel, const CUBIC: bool> Way<'a, N, C, CUBIC> {
    #[inline(always)]
    pub fn new(
        law: &'a Hysteresis,
        coefficients: &'a Coefficients<N, N::Of<C>, CUBIC>,
        from: MagneticState,
        magnetization: N,
        direction: f64,
        to: f64,
    ) -> Self {
        let present = coefficients.curve(N::splat(from.field_a_per_m), magnetization);
        let is_frozen = coefficients.lag(&present, magnetization).value() * direction < 0.0;
        Way {
            law,
            coefficients,
            from,
            magnetization,
            present,
            direction,
            to,
            is_frozen,
        }
    }

    /// The present state, where integration starts unless walls are frozen.
    #[inline(always)]
    pub fn here(&self) -> (Point<N>, N) {
        let here = Point {
            field: N::splat(self.from.field_a_per_m),
            magnetization: self.magnetization,
            slope: self.coefficients.slope_from(&self.present, self.magnetization),
        };
        (here, N::splat(0.0))
    }

    /// The switch with ∫ M dH up to it, or the present state if rounding puts the switch behind us.
    #[inline(always)]
    pub fn after(&self, switch: Switch) -> (Point<N>, N) {
        if (switch.field - self.from.field_a_per_m) * self.direction <= 0.0 {
            return self.here();
        }
        let coefficients = self.coefficients;
        let magnetization = N::carrying(switch.irreversible, || {
            coefficients.irreversible(&self.present, self.magnetization)
        });
        let field = N::carrying(switch.field, || {
            let relative = magnetization / coefficients.saturation;
            let argument = self.law.anhysteretic.inverse(relative.value());
            let steepness = self.law.anhysteretic.derivative(argument);
            // Only rounding can bring a material to where the curve is flat; the switch is then out of reach.
            let slope = if steepness > 0.0 { 1.0 / steepness } else { 0.0 };
            let argument = N::carrying(argument, || relative * N::splat(slope));
            coefficients.switch_field(argument, magnetization)
        });
        let fraction = coefficients.curve(field, magnetization);
        let way = field - N::splat(self.from.field_a_per_m);
        let slopes = [
            coefficients.reversible_slope(&self.present, self.magnetization),
            coefficients.reversible_slope(&fraction, magnetization),
        ];
        let rises = slopes.map(|slope| way * slope);
        let switch = Point {
            field,
            magnetization,
            slope: coefficients.slope_from(&fraction, magnetization),
        };
        (switch, way * mean_of_cubic([self.magnetization, magnetization], rises))
    }
}

impl<N: Single, C: Kernel, const CUBIC: bool> Branch<N> for Way<'_, N, C, CUBIC> {
    /// Newton from the tangent. What M carries then follows from R = M − (1 − c)·Mirr − c·Man(M) = 0 by one correction more.
    #[inline(always)]
    fn reversible(&self) -> Option<Reversible<N>> {
        if !self.is_frozen {
            return None;
        }
        let coefficients = self.coefficients;
        let values = Coefficients::<f64, C, CUBIC>::of(self.law, self.direction);
        let from = self.from.magnetization_a_per_m;
        let frozen = from - values.reversibility * values.anhysteretic(&self.present.values());
        let tangent = coefficients.reversible_slope(&self.present, self.magnetization);
        let change = self.to - self.from.field_a_per_m;
        let guess = from + tangent.value() * change;
        let solution = values.solve_reversible(self.to, frozen, guess, |fraction| {
            values.reversibility * (values.saturation * (fraction.x * fraction.numerator) * fraction.denominator)
        });
        let before_switch = (frozen / values.rest - solution.anhysteretic) * self.direction;
        // The end is then reached by integration from the switch, and nothing of this is used.
        if before_switch < 0.0 || before_switch.is_nan() {
            return None;
        }
        let there = |magnetization: N| coefficients.curve(N::splat(self.to), magnetization);
        let magnetization = N::carrying(solution.magnetization, || {
            let magnetization = N::splat(solution.magnetization);
            let fraction = there(magnetization);
            let anhysteretic =
                |fraction: &Fraction<N>| coefficients.reversibility * coefficients.anhysteretic(fraction);
            let frozen = self.magnetization - anhysteretic(&self.present);
            let residual = magnetization - frozen - anhysteretic(&fraction);
            let q = fraction.denominator.value();
            let bending = values.reversible_gain * fraction.derivative.value();
            let steepness = 1.0 - values.tangent(solution.magnetization) * bending / (q * q);
            residual * N::splat(-1.0 / steepness)
        });
        let slope = N::carrying(solution.slope, || {
            coefficients.reversible_slope(&there(magnetization), magnetization)
        });
        let change = N::splat(change);
        Some(Reversible {
            magnetization,
            mean: mean_of_cubic([self.magnetization, magnetization], [change * tangent, change * slope]),
            before_switch: N::splat(before_switch),
        })
    }

    #[inline(always)]
    fn start(&self) -> (Point<N>, N) {
        if self.is_frozen {
            // Only now is the switch field worth its inverse curve.
            self.after(self.law.switch(self.from))
        } else {
            self.here()
        }
    }

    #[inline(always)]
    fn goal(&self, _: N) -> impl Goal<N> {
        WholeSubsteps {
            direction: self.direction,
        }
    }
}
