//! One field step of a bank: `phases.rs` in lanes, with selects in place of branches.
//!
//! One body, compiled for AVX-512, for AVX2 and for the plain target. None of them fuses a multiply with an add,
//! and every lane does the same operations in the same order, so all three give identical bits.
//! After a reversal Mirr and the switch field H* of every member are stored; they stay valid until the next reversal.

use std::marker::PhantomData;

use super::Hysteresis;
use super::coefficients::{Coefficients, Point};
use super::phases::{self, Branch, Goal, Reversible};
use crate::Anhysteretic;
use crate::curve::{IsingEverywhere, LangevinEverywhere, LangevinToEight};
use crate::kernel::{Curve, Fraction};
use crate::number::Number;
use crate::number::lanes::Lanes;

/// Members per vector.
pub(crate) const WIDTH: usize = 16;
type Vector = Lanes<WIDTH>;

/// One number per member, padded to whole vectors with copies of the last member.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BankLanes {
    pub shape: Vec<f64>,
    pub inverse_shape: Vec<f64>,
    pub magnetization: Vec<f64>,
    pub irreversible: Vec<f64>,
    /// Field at which δ̂ becomes 1; not ahead of the field once it is 1.
    pub switch_field: Vec<f64>,
}

/// Instructions that a bank can run on; this processor has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instructions(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Instructions {
    /// All that this processor can run, the widest first.
    pub fn available() -> impl Iterator<Item = Instructions> {
        #[cfg(target_arch = "x86_64")]
        let wide = [
            is_x86_feature_detected!("avx512f").then_some(Set::Avx512),
            is_x86_feature_detected!("avx2").then_some(Set::Avx2),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wide: [Option<Set>; 0] = [];
        wide.into_iter().flatten().chain([Set::Plain]).map(Instructions)
    }

    /// Those that a bank takes.
    pub fn best() -> Instructions {
        Self::available().next().unwrap_or(Instructions(Set::Plain))
    }

    /// Their name.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Plain => "plain",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "AVX-512",
        }
    }
}

/// The field step that all members share.
#[derive(Clone, Copy)]
pub(super) struct FieldStep {
    pub from: f64,
    pub to: f64,
    pub direction: f64,
    pub reversed: bool,
    pub longest: f64,
}

/// `argument` is the largest |x| on the way: it chooses the cheapest kernel that holds there.
pub(super) fn advance(base: &Hysteresis, lanes: &mut BankLanes, step: FieldStep, argument: f64, with: Instructions) {
    match (base.anhysteretic, base.cubic_coupling_m2_per_a2 != 0.0) {
        (Anhysteretic::Langevin, false) if argument <= 8.0 => {
            dispatch::<LangevinToEight, false>(base, lanes, step, with);
        }
        (Anhysteretic::Langevin, false) => dispatch::<LangevinEverywhere, false>(base, lanes, step, with),
        (Anhysteretic::Langevin, true) => dispatch::<LangevinEverywhere, true>(base, lanes, step, with),
        (Anhysteretic::Ising, false) => dispatch::<IsingEverywhere, false>(base, lanes, step, with),
        (Anhysteretic::Ising, true) => dispatch::<IsingEverywhere, true>(base, lanes, step, with),
    }
}

fn dispatch<C: Curve<Vector>, const CUBIC: bool>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
    with: Instructions,
) {
    match with.0 {
        Set::Plain => run::<C, CUBIC>(base, lanes, step),
        // SAFETY: `Instructions::available` names a variant only where the processor has it.
        #[cfg(target_arch = "x86_64")]
        Set::Avx2 => unsafe { run_avx2::<C, CUBIC>(base, lanes, step) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Set::Avx512 => unsafe { run_avx512::<C, CUBIC>(base, lanes, step) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<C: Curve<Vector>, const CUBIC: bool>(base: &Hysteresis, lanes: &mut BankLanes, step: FieldStep) {
    run::<C, CUBIC>(base, lanes, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<C: Curve<Vector>, const CUBIC: bool>(base: &Hysteresis, lanes: &mut BankLanes, step: FieldStep) {
    run::<C, CUBIC>(base, lanes, step);
}

#[inline(always)]
fn run<C: Curve<Vector>, const CUBIC: bool>(base: &Hysteresis, lanes: &mut BankLanes, step: FieldStep) {
    let mut index = 0;
    while index < lanes.shape.len() {
        let shape = Vector::load(&lanes.shape[index..]);
        let inverse_shape = Vector::load(&lanes.inverse_shape[index..]);
        let coefficients = Coefficients::<Vector, C, CUBIC>::of_members(base, shape, inverse_shape, step.direction);
        let magnetization = Vector::load(&lanes.magnetization[index..]);
        if step.reversed {
            let (irreversible, switch_field) = after_reversal(&coefficients, magnetization, step);
            irreversible.store(&mut lanes.irreversible[index..]);
            switch_field.store(&mut lanes.switch_field[index..]);
        }
        let members = Members {
            coefficients: &coefficients,
            step,
            magnetization,
            irreversible: Vector::load(&lanes.irreversible[index..]),
            switch_field: Vector::load(&lanes.switch_field[index..]),
        };
        let (end, _) = phases::advance(&coefficients, &members, [step.from, step.to], step.longest);
        end.store(&mut lanes.magnetization[index..]);
        index += WIDTH;
    }
}

impl<C: Curve<Vector>, const CUBIC: bool> Coefficients<Vector, C, CUBIC> {
    /// Of members that differ in their shape only; what they share is worked out once.
    #[inline(always)]
    fn of_members(base: &Hysteresis, shape: Vector, inverse_shape: Vector, direction: f64) -> Self {
        let c = base.reversibility;
        Coefficients {
            saturation: Vector::splat(base.saturation_magnetization_a_per_m),
            shape,
            inverse_shape,
            coupling: Vector::splat(base.coupling),
            coupling_hat: Vector::splat(base.coupling / (1.0 - c)),
            triple_cubic: Vector::splat(3.0 * base.cubic_coupling_m2_per_a2),
            pinning: Vector::splat(base.pinning_a_per_m * direction),
            reversibility: Vector::splat(c),
            rest: Vector::splat(1.0 - c),
            reversible_gain: Vector::splat(c * base.saturation_magnetization_a_per_m) * inverse_shape,
            curve: PhantomData,
        }
    }
}

/// Mirr, and H* where δ̂ is 0 or else the present field.
#[inline(always)]
fn after_reversal<C: Curve<Vector>, const CUBIC: bool>(
    coefficients: &Coefficients<Vector, C, CUBIC>,
    magnetization: Vector,
    step: FieldStep,
) -> (Vector, Vector) {
    let field = Vector::splat(step.from);
    let fraction = coefficients.curve(field, magnetization);
    let irreversible = coefficients.irreversible(&fraction, magnetization);
    let argument = C::inverse(irreversible / coefficients.saturation);
    let switch_field = coefficients.switch_field(argument, irreversible);
    let ahead = coefficients.lag(&fraction, magnetization) * Vector::splat(step.direction);
    (
        irreversible,
        Vector::splat(0.0).where_greater(ahead, switch_field, field),
    )
}

/// Members on their way, with what is stored of their frozen parts.
struct Members<'a, C, const CUBIC: bool> {
    coefficients: &'a Coefficients<Vector, C, CUBIC>,
    step: FieldStep,
    magnetization: Vector,
    irreversible: Vector,
    switch_field: Vector,
}

impl<C: Curve<Vector>, const CUBIC: bool> Members<'_, C, CUBIC> {
    /// By how much the switch lies ahead of a field.
    #[inline(always)]
    fn ahead_of(&self, field: f64) -> Vector {
        (self.switch_field - Vector::splat(field)) * Vector::splat(self.step.direction)
    }
}

impl<C: Curve<Vector>, const CUBIC: bool> Branch<Vector> for Members<'_, C, CUBIC> {
    #[inline(always)]
    fn reversible(&self) -> Option<Reversible<Vector>> {
        let before_switch = self.ahead_of(self.step.to);
        if before_switch.largest() < 0.0 {
            return None;
        }
        let coefficients = self.coefficients;
        let to = Vector::splat(self.step.to);
        let spread = coefficients.reversibility * coefficients.saturation;
        let bent = |fraction: &Fraction<Vector>| spread * (fraction.x * fraction.numerator) * fraction.denominator;
        let solution = coefficients.solve_reversible(to, self.irreversible, self.magnetization, bent);
        Some(Reversible {
            magnetization: solution.magnetization,
            // A bank's mean is not asked for.
            mean: solution.magnetization,
            before_switch,
        })
    }

    #[inline(always)]
    fn start(&self) -> (Point<Vector>, Vector) {
        let zero = Vector::splat(0.0);
        let ahead = self.ahead_of(self.step.from);
        let field = ahead.where_greater(zero, self.switch_field, Vector::splat(self.step.from));
        let magnetization = ahead.where_greater(zero, self.irreversible, self.magnetization);
        let start = Point {
            field,
            magnetization,
            slope: self.coefficients.slope(field, magnetization),
        };
        (start, zero)
    }

    #[inline(always)]
    fn goal(&self, field: Vector) -> impl Goal<Vector> {
        let way = Vector::splat(self.step.to) - field;
        let longest_way = way.abs().largest().min((self.step.to - self.step.from).abs());
        EqualParts {
            way,
            longest_way,
            left: longest_way,
        }
    }
}

/// All lanes cover equal parts of their own way, so that they end together.
struct EqualParts {
    way: Vector,
    longest_way: f64,
    left: f64,
}

impl Goal<Vector> for EqualParts {
    #[inline(always)]
    fn substep(&mut self, rest: Vector, longest: f64) -> (Vector, bool) {
        if self.left <= longest {
            return (rest, true);
        }
        self.left -= longest;
        (self.way * Vector::splat(longest / self.longest_way), false)
    }
}
