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
#[cfg(target_arch = "x86_64")]
use crate::number::lanes::{Avx2, Avx512, Eight, Four, Two};
use crate::number::lanes::{Lanes, Sixteen, ThirtyTwo};

/// A bank is padded to a multiple of it.
pub(crate) const NARROW: usize = Sixteen::<f64>::WIDTH;

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
    // SAFETY: `Instructions::available` names a variant only where the processor has it.
    unsafe {
        match with.0 {
            Set::Plain => on_kernel::<Plain>(base, lanes, step, argument),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => on_kernel::<WithAvx2>(base, lanes, step, argument),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => on_kernel::<WithAvx512>(base, lanes, step, argument),
        }
    }
}

/// Thirty-two members are worked on together on the kernels that most banks run on: chains of operations of four AVX-512 vectors overlap.
/// Sixteen on the others, where registers would not do for more, and for what is left over.
///
/// # Safety
/// The processor has these instructions.
unsafe fn on_kernel<M: Machine>(base: &Hysteresis, lanes: &mut BankLanes, step: FieldStep, argument: f64) {
    // SAFETY: of the caller.
    unsafe {
        match (base.anhysteretic, base.cubic_coupling_m2_per_a2 != 0.0) {
            (Anhysteretic::Langevin, false) if argument <= 4.0 => {
                M::run::<LangevinToFour, false, true>(base, lanes, step);
            }
            (Anhysteretic::Langevin, false) if argument <= 8.0 => {
                M::run::<LangevinToEight, false, true>(base, lanes, step);
            }
            (Anhysteretic::Langevin, false) => M::run::<LangevinEverywhere, false, false>(base, lanes, step),
            (Anhysteretic::Langevin, true) => M::run::<LangevinEverywhere, true, false>(base, lanes, step),
            (Anhysteretic::Ising, false) => M::run::<IsingEverywhere, false, false>(base, lanes, step),
            (Anhysteretic::Ising, true) => M::run::<IsingEverywhere, true, false>(base, lanes, step),
        }
    }
}

/// What thirty-two and sixteen numbers are on a processor.
trait Machine {
    type Wide: Lanes;
    type Narrow: Lanes;
    /// # Safety
    /// The processor has these instructions.
    unsafe fn run<C: Curve<Self::Wide> + Curve<Self::Narrow>, const CUBIC: bool, const WIDE: bool>(
        base: &Hysteresis,
        lanes: &mut BankLanes,
        step: FieldStep,
    );
}

macro_rules! machine {
    ($name:ident, $wide:ty, $narrow:ty $(, #[$feature:meta])?) => {
        struct $name;

        impl Machine for $name {
            type Wide = $wide;
            type Narrow = $narrow;
            $(#[$feature])?
            unsafe fn run<C: Curve<Self::Wide> + Curve<Self::Narrow>, const CUBIC: bool, const WIDE: bool>(
                base: &Hysteresis,
                lanes: &mut BankLanes,
                step: FieldStep,
            ) {
                run::<C, CUBIC, WIDE, Self::Wide, Self::Narrow>(base, lanes, step);
            }
        }
    };
}
machine!(Plain, ThirtyTwo<f64>, Sixteen<f64>);
#[cfg(target_arch = "x86_64")]
machine!(WithAvx2, Eight<Avx2>, Four<Avx2>, #[target_feature(enable = "avx2")]);
#[cfg(target_arch = "x86_64")]
machine!(WithAvx512, Four<Avx512>, Two<Avx512>, #[target_feature(enable = "avx512f")]);

/// Wide blocks as far as they go, the rest in narrow ones.
#[inline(always)]
fn run<C: Curve<W> + Curve<N>, const CUBIC: bool, const WIDE: bool, W: Lanes, N: Lanes>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
) {
    let mut index = 0;
    if WIDE {
        while index + W::WIDTH <= lanes.shape.len() {
            run_block::<C, CUBIC, W>(base, lanes, step, index);
            index += W::WIDTH;
        }
    }
    while index < lanes.shape.len() {
        run_block::<C, CUBIC, N>(base, lanes, step, index);
        index += N::WIDTH;
    }
}

#[inline(always)]
fn run_block<C: Curve<L>, const CUBIC: bool, L: Lanes>(
    base: &Hysteresis,
    lanes: &mut BankLanes,
    step: FieldStep,
    index: usize,
) {
    let (shape, inverse_shape) = (L::load(&lanes.shape[index..]), L::load(&lanes.inverse_shape[index..]));
    let coefficients = Coefficients::<_, C, CUBIC>::of_members(base, shape, inverse_shape, step.direction);
    let magnetization = L::load(&lanes.magnetization[index..]);
    if step.reversed {
        let (irreversible, switch_field) = after_reversal(&coefficients, magnetization, step);
        irreversible.store(&mut lanes.irreversible[index..]);
        switch_field.store(&mut lanes.switch_field[index..]);
    }
    let members = Members {
        coefficients: &coefficients,
        step,
        magnetization,
        irreversible: L::load(&lanes.irreversible[index..]),
        switch_field: L::load(&lanes.switch_field[index..]),
    };
    let (end, _) = phases::advance(&coefficients, &members, [step.from, step.to], step.longest);
    end.store(&mut lanes.magnetization[index..]);
}

impl<C: Curve<L>, const CUBIC: bool, L: Lanes> Coefficients<L, C, CUBIC> {
    /// Of members that differ in their shape only; what they share is worked out once.
    #[inline(always)]
    fn of_members(base: &Hysteresis, shape: L, inverse_shape: L, direction: f64) -> Self {
        let c = base.reversibility;
        Coefficients {
            saturation: L::splat(base.saturation_magnetization_a_per_m),
            shape,
            inverse_shape,
            coupling: L::splat(base.coupling),
            coupling_hat: L::splat(base.coupling / (1.0 - c)),
            triple_cubic: L::splat(3.0 * base.cubic_coupling_m2_per_a2),
            pinning: L::splat(base.pinning_a_per_m * direction),
            reversibility: L::splat(c),
            rest: L::splat(1.0 - c),
            reversible_gain: L::splat(c * base.saturation_magnetization_a_per_m) * inverse_shape,
            curve: PhantomData,
        }
    }
}

/// Mirr, and H* where δ̂ is 0 or else the present field.
#[inline(always)]
fn after_reversal<C: Curve<L>, const CUBIC: bool, L: Lanes>(
    coefficients: &Coefficients<L, C, CUBIC>,
    magnetization: L,
    step: FieldStep,
) -> (L, L) {
    let field = L::splat(step.from);
    let fraction = coefficients.curve(field, magnetization);
    let irreversible = coefficients.irreversible(&fraction, magnetization);
    let argument = C::inverse(irreversible / coefficients.saturation);
    let switch_field = coefficients.switch_field(argument, irreversible);
    let ahead = coefficients.lag(&fraction, magnetization) * L::splat(step.direction);
    (irreversible, L::splat(0.0).where_greater(ahead, switch_field, field))
}

/// Members on their way, with what is stored of their frozen parts.
struct Members<'a, C, const CUBIC: bool, L> {
    coefficients: &'a Coefficients<L, C, CUBIC>,
    step: FieldStep,
    magnetization: L,
    irreversible: L,
    switch_field: L,
}

impl<C: Curve<L>, const CUBIC: bool, L: Lanes> Members<'_, C, CUBIC, L> {
    /// By how much the switch lies ahead of a field.
    #[inline(always)]
    fn ahead_of(&self, field: f64) -> L {
        (self.switch_field - L::splat(field)) * L::splat(self.step.direction)
    }
}

impl<C: Curve<L>, const CUBIC: bool, L: Lanes> Branch<L> for Members<'_, C, CUBIC, L> {
    #[inline(always)]
    fn reversible(&self) -> Option<Reversible<L>> {
        let before_switch = self.ahead_of(self.step.to);
        if before_switch.largest() < 0.0 {
            return None;
        }
        let coefficients = self.coefficients;
        let to = L::splat(self.step.to);
        let spread = coefficients.reversibility * coefficients.saturation;
        let bent = |fraction: &Fraction<L>| spread * (fraction.x * fraction.numerator) * fraction.denominator;
        let frozen = coefficients.rest * self.irreversible;
        let solution = coefficients.solve_reversible(to, frozen, self.magnetization, bent);
        Some(Reversible {
            magnetization: solution.magnetization,
            // A bank's mean is not asked for.
            mean: solution.magnetization,
            before_switch,
        })
    }

    #[inline(always)]
    fn start(&self) -> (Point<L>, L) {
        let zero = L::splat(0.0);
        let ahead = self.ahead_of(self.step.from);
        let field = ahead.where_greater(zero, self.switch_field, L::splat(self.step.from));
        let magnetization = ahead.where_greater(zero, self.irreversible, self.magnetization);
        let start = Point {
            field,
            magnetization,
            slope: self.coefficients.slope(field, magnetization),
        };
        (start, zero)
    }

    #[inline(always)]
    fn goal(&self, field: L) -> impl Goal<L> {
        let way = L::splat(self.step.to) - field;
        let longest_way = way.abs().largest().min((self.step.to - self.step.from).abs());
        EqualParts {
            way,
            longest_way,
            left: longest_way,
        }
    }
}

/// All lanes cover equal parts of their own way, so that they end together.
struct EqualParts<L> {
    way: L,
    longest_way: f64,
    left: f64,
}

impl<L: Lanes> Goal<L> for EqualParts<L> {
    #[inline(always)]
    fn substep(&mut self, rest: L, longest: f64) -> (L, bool) {
        if self.left <= longest {
            return (rest, true);
        }
        self.left -= longest;
        (self.way * L::splat(longest / self.longest_way), false)
    }
}
