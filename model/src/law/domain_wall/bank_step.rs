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
use crate::curve::{IsingEverywhere, LangevinEverywhere, LangevinToEight, LangevinToFour};
use crate::kernel::{Curve, Fraction};
use crate::number::Number;
use crate::number::lanes::Lanes;

/// Members that are worked on together on the kernels that most banks run on: chains of operations of four AVX-512 vectors overlap.
const WIDE: usize = 32;
/// The same on the others, where registers would not do for more, and for what is left over.
pub(crate) const NARROW: usize = 16;

/// One number per member, padded to [`NARROW`] with copies of the last member.
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
        (Anhysteretic::Langevin, false) if argument <= 4.0 => {
            dispatch::<LangevinToFour, false, WIDE>(base, lanes, step, with);
        }
        (Anhysteretic::Langevin, false) if argument <= 8.0 => {
            dispatch::<LangevinToEight, false, WIDE>(base, lanes, step, with);
        }
        (Anhysteretic::Langevin, false) => dispatch::<LangevinEverywhere, false, NARROW>(base, lanes, step, with),
        (Anhysteretic::Langevin, true) => dispatch::<LangevinEverywhere, true, NARROW>(base, lanes, step, with),
        (Anhysteretic::Ising, false) => dispatch::<IsingEverywhere, false, NARROW>(base, lanes, step, with),
        (Anhysteretic::Ising, true) => dispatch::<IsingEverywhere, true, NARROW>(base, lanes, step, with),
    }
}

/// A kernel for members worked on together in both numbers.
trait Wide<const WIDTH: usize>: Curve<Lanes<WIDTH>> + Curve<Lanes<NARROW>> {}
impl<const WIDTH: usize, C: Curve<Lanes<WIDTH>> + Curve<Lanes<NARROW>>> Wide<WIDTH> for C {}

fn dispatch<C: Wide<WIDTH>, const CUBIC: bool, const WIDTH: usize>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
    with: Instructions,
) {
    match with.0 {
        Set::Plain => run::<C, CUBIC, WIDTH>(base, lanes, step),
        // SAFETY: `Instructions::available` names a variant only where the processor has it.
        #[cfg(target_arch = "x86_64")]
        Set::Avx2 => unsafe { run_avx2::<C, CUBIC, WIDTH>(base, lanes, step) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Set::Avx512 => unsafe { run_avx512::<C, CUBIC, WIDTH>(base, lanes, step) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<C: Wide<WIDTH>, const CUBIC: bool, const WIDTH: usize>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
) {
    run::<C, CUBIC, WIDTH>(base, lanes, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<C: Wide<WIDTH>, const CUBIC: bool, const WIDTH: usize>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
) {
    run::<C, CUBIC, WIDTH>(base, lanes, step);
}

#[inline(always)]
fn run<C: Wide<WIDTH>, const CUBIC: bool, const WIDTH: usize>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
) {
    let mut index = 0;
    if const { WIDTH > NARROW } {
        while index + WIDTH <= lanes.shape.len() {
            run_block::<C, CUBIC, WIDTH>(base, lanes, step, index);
            index += WIDTH;
        }
    }
    while index < lanes.shape.len() {
        run_block::<C, CUBIC, NARROW>(base, lanes, step, index);
        index += NARROW;
    }
}

#[inline(always)]
fn run_block<C: Curve<Lanes<WIDTH>>, const CUBIC: bool, const WIDTH: usize>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
    index: usize,
) {
    let load = |values: &[f64]| Lanes::<WIDTH>::load(&values[index..]);
    let (shape, inverse_shape) = (load(&lanes.shape), load(&lanes.inverse_shape));
    let coefficients = Coefficients::<_, C, CUBIC>::of_members(base, shape, inverse_shape, step.direction);
    let magnetization = load(&lanes.magnetization);
    if step.reversed {
        let (irreversible, switch_field) = after_reversal(&coefficients, magnetization, step);
        irreversible.store(&mut lanes.irreversible[index..]);
        switch_field.store(&mut lanes.switch_field[index..]);
    }
    let members = Members {
        coefficients: &coefficients,
        step,
        magnetization,
        irreversible: load(&lanes.irreversible),
        switch_field: load(&lanes.switch_field),
    };
    let (end, _) = phases::advance(&coefficients, &members, [step.from, step.to], step.longest);
    end.store(&mut lanes.magnetization[index..]);
}

impl<C: Curve<Lanes<WIDTH>>, const CUBIC: bool, const WIDTH: usize> Coefficients<Lanes<WIDTH>, C, CUBIC> {
    /// Of members that differ in their shape only; what they share is worked out once.
    #[inline(always)]
    fn of_members(base: &Hysteresis, shape: Lanes<WIDTH>, inverse_shape: Lanes<WIDTH>, direction: f64) -> Self {
        let c = base.reversibility;
        Coefficients {
            saturation: Lanes::splat(base.saturation_magnetization_a_per_m),
            shape,
            inverse_shape,
            coupling: Lanes::splat(base.coupling),
            coupling_hat: Lanes::splat(base.coupling / (1.0 - c)),
            triple_cubic: Lanes::splat(3.0 * base.cubic_coupling_m2_per_a2),
            pinning: Lanes::splat(base.pinning_a_per_m * direction),
            reversibility: Lanes::splat(c),
            rest: Lanes::splat(1.0 - c),
            reversible_gain: Lanes::splat(c * base.saturation_magnetization_a_per_m) * inverse_shape,
            curve: PhantomData,
        }
    }
}

/// Mirr, and H* where δ̂ is 0 or else the present field.
#[inline(always)]
fn after_reversal<C: Curve<Lanes<WIDTH>>, const CUBIC: bool, const WIDTH: usize>(
    coefficients: &Coefficients<Lanes<WIDTH>, C, CUBIC>,
    magnetization: Lanes<WIDTH>,
    step: FieldStep,
) -> (Lanes<WIDTH>, Lanes<WIDTH>) {
    let field = Lanes::splat(step.from);
    let fraction = coefficients.curve(field, magnetization);
    let irreversible = coefficients.irreversible(&fraction, magnetization);
    let argument = C::inverse(irreversible / coefficients.saturation);
    let switch_field = coefficients.switch_field(argument, irreversible);
    let ahead = coefficients.lag(&fraction, magnetization) * Lanes::splat(step.direction);
    (
        irreversible,
        Lanes::splat(0.0).where_greater(ahead, switch_field, field),
    )
}

/// Members on their way, with what is stored of their frozen parts.
struct Members<'a, C, const CUBIC: bool, const WIDTH: usize> {
    coefficients: &'a Coefficients<Lanes<WIDTH>, C, CUBIC>,
    step: FieldStep,
    magnetization: Lanes<WIDTH>,
    irreversible: Lanes<WIDTH>,
    switch_field: Lanes<WIDTH>,
}

impl<C: Curve<Lanes<WIDTH>>, const CUBIC: bool, const WIDTH: usize> Members<'_, C, CUBIC, WIDTH> {
    /// By how much the switch lies ahead of a field.
    #[inline(always)]
    fn ahead_of(&self, field: f64) -> Lanes<WIDTH> {
        (self.switch_field - Lanes::splat(field)) * Lanes::splat(self.step.direction)
    }
}

impl<C: Curve<Lanes<WIDTH>>, const CUBIC: bool, const WIDTH: usize> Branch<Lanes<WIDTH>>
    for Members<'_, C, CUBIC, WIDTH>
{
    #[inline(always)]
    fn reversible(&self) -> Option<Reversible<Lanes<WIDTH>>> {
        let before_switch = self.ahead_of(self.step.to);
        if before_switch.largest() < 0.0 {
            return None;
        }
        let coefficients = self.coefficients;
        let to = Lanes::splat(self.step.to);
        let spread = coefficients.reversibility * coefficients.saturation;
        let bent =
            |fraction: &Fraction<Lanes<WIDTH>>| spread * (fraction.x * fraction.numerator) * fraction.denominator;
        let solution = coefficients.solve_reversible(to, self.irreversible, self.magnetization, bent);
        Some(Reversible {
            magnetization: solution.magnetization,
            // A bank's mean is not asked for.
            mean: solution.magnetization,
            before_switch,
        })
    }

    #[inline(always)]
    fn start(&self) -> (Point<Lanes<WIDTH>>, Lanes<WIDTH>) {
        let zero = Lanes::splat(0.0);
        let ahead = self.ahead_of(self.step.from);
        let field = ahead.where_greater(zero, self.switch_field, Lanes::splat(self.step.from));
        let magnetization = ahead.where_greater(zero, self.irreversible, self.magnetization);
        let start = Point {
            field,
            magnetization,
            slope: self.coefficients.slope(field, magnetization),
        };
        (start, zero)
    }

    #[inline(always)]
    fn goal(&self, field: Lanes<WIDTH>) -> impl Goal<Lanes<WIDTH>> {
        let way = Lanes::splat(self.step.to) - field;
        let longest_way = way.abs().largest().min((self.step.to - self.step.from).abs());
        EqualParts {
            way,
            longest_way,
            left: longest_way,
        }
    }
}

/// All lanes cover equal parts of their own way, so that they end together.
struct EqualParts<const WIDTH: usize> {
    way: Lanes<WIDTH>,
    longest_way: f64,
    left: f64,
}

impl<const WIDTH: usize> Goal<Lanes<WIDTH>> for EqualParts<WIDTH> {
    #[inline(always)]
    fn substep(&mut self, rest: Lanes<WIDTH>, longest: f64) -> (Lanes<WIDTH>, bool) {
        if self.left <= longest {
            return (rest, true);
        }
        self.left -= longest;
        (self.way * Lanes::splat(longest / self.longest_way), false)
    }
}
