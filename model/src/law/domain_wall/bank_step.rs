//! One field step of a bank, in lanes: `hysteresis/advance.rs` with selects in place of branches.
//!
//! One body, compiled for AVX-512, for AVX2 and for the plain target. None of them fuses a multiply with an add,
//! and every lane does the same operations in the same order, so all three give identical bits.
//! After a reversal Mirr and the switch field H* of every member are stored; they stay valid until the next reversal.

use crate::Anhysteretic;
use crate::curve::{Curve, IsingEverywhere, LangevinEverywhere, LangevinToEight};
use crate::law::domain_wall::bank::Bank;
use crate::law::domain_wall::coefficients::Coefficients;
use crate::law::domain_wall::phases::{MOST_SUBSTEPS, stride};
use crate::number::lanes::{Lanes, Number};

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
    match bank.base.anhysteretic {
        Anhysteretic::Langevin if argument <= 8.0 => dispatch::<LangevinToEight>(bank, step, instructions),
        Anhysteretic::Langevin => dispatch::<LangevinEverywhere>(bank, step, instructions),
        Anhysteretic::Ising => dispatch::<IsingEverywhere>(bank, step, instructions),
    }
    bank.field = field_to;
    bank.direction = direction;
}

fn dispatch<C: Curve<Vector>>(bank: &mut Bank, step: FieldStep, instructions: Instructions) {
    match instructions {
        Instructions::Plain => run::<C>(bank, step),
        // SAFETY: `Instructions::available` names a variant only where the processor has it.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2 => unsafe { run_avx2::<C>(bank, step) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512 => unsafe { run_avx512::<C>(bank, step) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<C: Curve<Vector>>(bank: &mut Bank, step: FieldStep) {
    run::<C>(bank, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<C: Curve<Vector>>(bank: &mut Bank, step: FieldStep) {
    run::<C>(bank, step);
}

#[inline(always)]
fn run<C: Curve<Vector>>(bank: &mut Bank, step: FieldStep) {
    let base = bank.base;
    let lanes = &mut bank.lanes;
    let gain = Vector::splat(base.reversibility * base.saturation_magnetization_a_per_m);
    let mut index = 0;
    while index < lanes.shape.len() {
        let inverse_shape = Vector::load(&lanes.inverse_shape[index..]);
        let coefficients = Coefficients {
            saturation: Vector::splat(base.saturation_magnetization_a_per_m),
            inverse_shape,
            coupling: Vector::splat(base.coupling),
            coupling_hat: Vector::splat(base.coupling / (1.0 - base.reversibility)),
            pinning: Vector::splat(base.pinning_a_per_m * step.direction),
            reversible_gain: gain * inverse_shape,
        };
        let magnetization = Vector::load(&lanes.magnetization[index..]);
        if step.reversed {
            let shape = Vector::load(&lanes.shape[index..]);
            let (irreversible, switch_field) =
                after_reversal::<C>(&coefficients, base.reversibility, shape, magnetization, step);
            irreversible.store(&mut lanes.irreversible[index..]);
            switch_field.store(&mut lanes.switch_field[index..]);
        }
        let irreversible = Vector::load(&lanes.irreversible[index..]);
        let switch_field = Vector::load(&lanes.switch_field[index..]);
        let result = step_vector::<C>(
            &coefficients,
            base.reversibility,
            magnetization,
            irreversible,
            switch_field,
            step,
        );
        result.store(&mut lanes.magnetization[index..]);
        index += WIDTH;
    }
}

/// Mirr, and H* where δ̂ is 0 or else the present field.
#[inline(always)]
fn after_reversal<C: Curve<Vector>>(
    coefficients: &Coefficients<Vector>,
    reversibility: f64,
    shape: Vector,
    magnetization: Vector,
    step: FieldStep,
) -> (Vector, Vector) {
    let field = Vector::splat(step.from);
    let fraction = coefficients.curve::<C>(field, magnetization);
    let man = coefficients.saturation * (fraction.x * fraction.numerator) / fraction.denominator;
    let irreversible = (magnetization - Vector::splat(reversibility) * man) / Vector::splat(1.0 - reversibility);
    let switch_field =
        shape * C::inverse(irreversible / coefficients.saturation) - coefficients.coupling * irreversible;
    let ahead = coefficients.lag(&fraction, magnetization) * Vector::splat(step.direction);
    (
        irreversible,
        Vector::splat(0.0).where_greater(ahead, switch_field, field),
    )
}

#[inline(always)]
fn step_vector<C: Curve<Vector>>(
    coefficients: &Coefficients<Vector>,
    reversibility: f64,
    magnetization: Vector,
    irreversible: Vector,
    switch_field: Vector,
    step: FieldStep,
) -> Vector {
    let zero = Vector::splat(0.0);
    let (from, to) = (Vector::splat(step.from), Vector::splat(step.to));
    let direction = Vector::splat(step.direction);
    // Positive: the lane starts, or ends, before its switch.
    let starts_before = (switch_field - from) * direction;
    let ends_before = (switch_field - to) * direction;
    let mut result = magnetization;
    if (zero - ends_before).largest() > 0.0 {
        let field = starts_before.where_greater(zero, switch_field, from);
        let start = starts_before.where_greater(zero, irreversible, magnetization);
        result = integrate::<C>(coefficients, field, start, step);
    }
    if ends_before.largest() >= 0.0 {
        let bent = bend::<C>(coefficients, reversibility, magnetization, irreversible, to);
        result = zero.where_greater(ends_before, result, bent);
    }
    result
}

/// δ̂ = 1 from each lane's start to the common end: all lanes cover equal parts of their own way.
#[inline(always)]
fn integrate<C: Curve<Vector>>(
    coefficients: &Coefficients<Vector>,
    start: Vector,
    magnetization: Vector,
    step: FieldStep,
) -> Vector {
    let to = Vector::splat(step.to);
    let way = to - start;
    let longest_way = way.abs().largest().min((step.to - step.from).abs());
    let coupling = coefficients.coupling.0[0];
    let (mut field, mut magnetization, mut left) = (start, magnetization, longest_way);
    for _ in 0..MOST_SUBSTEPS {
        let first = coefficients.slope::<C>(field, magnetization);
        let steepest = if coupling > 0.0 { first.largest() } else { 0.0 };
        let stride = stride(step.longest, coupling, steepest);
        let last = left <= stride;
        let part = if last {
            to - field
        } else {
            way * Vector::splat(stride / longest_way)
        };
        // One call in the loop's body: inlined twice, it would double the time that this file takes to compile.
        magnetization = coefficients.step_from::<C>(field, magnetization, part, first);
        if last {
            return magnetization;
        }
        field = field + part;
        left -= stride;
    }
    let fraction = coefficients.curve::<C>(to, magnetization);
    coefficients.saturation * (fraction.x * fraction.numerator) / fraction.denominator
}

/// M = (1 − c)·Mirr + c·Man(H + αM) by Newton, kept within ±c·Ms of the frozen part.
#[inline(always)]
fn bend<C: Curve<Vector>>(
    coefficients: &Coefficients<Vector>,
    reversibility: f64,
    start: Vector,
    irreversible: Vector,
    field: Vector,
) -> Vector {
    let c = Vector::splat(reversibility);
    let frozen = Vector::splat(1.0 - reversibility) * irreversible;
    let spread = c * coefficients.saturation;
    let mut magnetization = start;
    for _ in 0..12 {
        let fraction = coefficients.curve::<C>(field, magnetization);
        let q = fraction.denominator;
        let q_squared = q * q;
        let excess = (magnetization - frozen) * q_squared - spread * (fraction.x * fraction.numerator) * q;
        let steepness = q_squared - coefficients.coupling * coefficients.reversible_gain * fraction.derivative;
        let next = (magnetization - excess / steepness)
            .min(frozen + spread)
            .max(frozen - spread);
        let moved = (next - magnetization).abs() - Vector::splat(1e-9) * spread;
        magnetization = next;
        // Quadratic convergence: after a move below 1e-9 the next is below rounding.
        if moved.largest() <= 0.0 {
            break;
        }
    }
    magnetization
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
