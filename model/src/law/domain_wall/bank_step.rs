//! One field step of a bank: `phases.rs` in lanes, with selects in place of branches.
//!
//! One body, compiled for AVX-512, for AVX2 and for the plain target. None of them fuses a multiply with an add,
//! and every lane does the same operations in the same order, so all three give identical bits.
//! After a reversal Mirr and the switch field H* of every member are stored; they stay valid until the next reversal.

use std::marker::PhantomData;

use super::Hysteresis;
use super::bank::Bank;
use super::coefficients::Coefficients;
use super::phases::{self, Branch, Goal, Point, Reversible};
use crate::Anhysteretic;
use crate::curve::{Curve, Fraction, IsingEverywhere, LangevinEverywhere, LangevinToEight};
use crate::number::Number;
use crate::number::lanes::Lanes;

/// Members per vector.
pub(crate) const WIDTH: usize = 16;
type Vector = Lanes<WIDTH>;

/// Which instructions run the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Instructions {
    Plain,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Instructions {
    /// All that this processor can run.
    pub fn available() -> impl Iterator<Item = Instructions> {
        #[cfg(target_arch = "x86_64")]
        let wide = [
            is_x86_feature_detected!("avx512f").then_some(Instructions::Avx512),
            is_x86_feature_detected!("avx2").then_some(Instructions::Avx2),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wide = [];
        wide.into_iter().flatten().chain([Instructions::Plain])
    }

    pub fn best() -> Instructions {
        Self::available().next().unwrap_or(Instructions::Plain)
    }
}

/// The field step that all members share.
#[derive(Clone, Copy)]
struct FieldStep {
    from: f64,
    to: f64,
    direction: f64,
    reversed: bool,
    longest: f64,
}

pub(crate) fn advance(bank: &mut Bank, field_to: f64, instructions: Instructions) {
    let from = bank.field;
    let change = field_to - from;
    if change == 0.0 {
        return;
    }
    if !change.is_finite() {
        bank.lanes.magnetization.fill(f64::NAN);
        bank.field = field_to;
        return;
    }
    let direction = if change > 0.0 { 1.0 } else { -1.0 };
    let step = FieldStep {
        from,
        to: field_to,
        direction,
        reversed: direction != bank.direction,
        longest: bank.longest_substep,
    };
    // The cheapest kernel that holds for every argument of this step.
    let farthest =
        from.abs().max(field_to.abs()) + (bank.base.coupling * bank.base.saturation_magnetization_a_per_m).abs();
    let argument = farthest / bank.smallest_shape;
    match (bank.base.anhysteretic, bank.base.cubic_coupling_m2_per_a2 != 0.0) {
        (Anhysteretic::Langevin, false) if argument <= 8.0 => {
            dispatch::<LangevinToEight, false>(bank, step, instructions);
        }
        (Anhysteretic::Langevin, false) => dispatch::<LangevinEverywhere, false>(bank, step, instructions),
        (Anhysteretic::Langevin, true) => dispatch::<LangevinEverywhere, true>(bank, step, instructions),
        (Anhysteretic::Ising, false) => dispatch::<IsingEverywhere, false>(bank, step, instructions),
        (Anhysteretic::Ising, true) => dispatch::<IsingEverywhere, true>(bank, step, instructions),
    }
    bank.field = field_to;
    bank.direction = direction;
}

fn dispatch<C: Curve<Vector>, const CUBIC: bool>(bank: &mut Bank, step: FieldStep, instructions: Instructions) {
    match instructions {
        Instructions::Plain => run::<C, CUBIC>(bank, step),
        // SAFETY: `Instructions::available` names a variant only where the processor has it.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { run_avx2::<C, CUBIC>(bank, step) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { run_avx512::<C, CUBIC>(bank, step) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<C: Curve<Vector>, const CUBIC: bool>(bank: &mut Bank, step: FieldStep) {
    run::<C, CUBIC>(bank, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<C: Curve<Vector>, const CUBIC: bool>(bank: &mut Bank, step: FieldStep) {
    run::<C, CUBIC>(bank, step);
}

#[inline(always)]
fn run<C: Curve<Vector>, const CUBIC: bool>(bank: &mut Bank, step: FieldStep) {
    let base = bank.base;
    let lanes = &mut bank.lanes;
    let mut index = 0;
    while index < lanes.shape.len() {
        let shape = Vector::load(&lanes.shape[index..]);
        let inverse_shape = Vector::load(&lanes.inverse_shape[index..]);
        let coefficients = Coefficients::<Vector, C, CUBIC>::of_members(&base, shape, inverse_shape, step.direction);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Hysteresis;

    /// Guards "same bits everywhere": every instruction set this machine has, on every kernel, along reversals and jumps.
    #[test]
    fn all_instruction_sets_give_identical_bits() {
        let choices: Vec<Instructions> = Instructions::available().collect();
        println!("compared: {choices:?}");
        let shapes: Vec<f64> = (0..33).map(|member| 6300.0 + 31.25 * f64::from(member)).collect();
        for (anhysteretic, coupling, amplitude) in [
            (Anhysteretic::Langevin, -0.01, 15e3),
            (Anhysteretic::Langevin, 0.01, 15e3),
            (Anhysteretic::Langevin, -0.01, 300e3),
            (Anhysteretic::Ising, -0.01, 15e3),
            (Anhysteretic::Ising, -0.01, 70e3),
            (Anhysteretic::Ising, -0.01, 300e3),
        ] {
            let base = Hysteresis {
                anhysteretic,
                coupling,
                ..Hysteresis::terfenol_d()
            };
            let bank = Bank::new(base, &shapes).expect("valid");
            let mut banks = vec![bank; choices.len()];
            for step in 1..2000 {
                let phase = f64::from(step) * 0.05;
                let field = amplitude * libm::sin(phase) * (1.0 + 0.3 * libm::sin(7.3 * phase));
                for (bank, &instructions) in banks.iter_mut().zip(&choices) {
                    advance(bank, field, instructions);
                }
                for (bank, instructions) in banks.iter().zip(&choices).skip(1) {
                    for (one, other) in banks[0].magnetizations().iter().zip(bank.magnetizations()) {
                        assert!(one.is_finite());
                        assert_eq!(one.to_bits(), other.to_bits(), "{instructions:?} at step {step}");
                    }
                }
            }
        }
    }
}
