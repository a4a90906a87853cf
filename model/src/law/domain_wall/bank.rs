//! N copies of one material over a grid of the shape `a`, all driven by one field.
//!
//! Each member follows `mod.rs`; only `a` differs. The bank carries what a function of the whole input history,
//! f(u, a), needs: the paper's (15) is then exact for any input. Fields, magnetizations and shapes in A/m.
//! Members run side by side in lanes without branches; which instructions run them is chosen when the program runs,
//! and all choices give the same bits (`bank_step.rs`).

use serde::{Deserialize, Serialize};

pub use super::bank_step::Instructions;
use super::bank_step::{self, BankLanes, FieldStep, NARROW};
use crate::error::require_positive;
use crate::{Hysteresis, ModelError};

/// A bank of hysteresis models; starts demagnetised at zero field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "BankSnapshot", try_from = "BankSnapshot")]
pub struct Bank {
    base: Hysteresis,
    members: usize,
    field: f64,
    /// +1, −1, or 0 before the field has moved.
    direction: f64,
    longest_substep: f64,
    smallest_shape: f64,
    lanes: BankLanes,
}

/// What is stored of a bank: nothing derived, nothing padded.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BankSnapshot {
    base: Hysteresis,
    shapes_a_per_m: Vec<f64>,
    field_a_per_m: f64,
    direction: f64,
    magnetizations_a_per_m: Vec<f64>,
    irreversible_a_per_m: Vec<f64>,
    switch_fields_a_per_m: Vec<f64>,
}

fn padded(values: &[f64]) -> Vec<f64> {
    let mut lanes = values.to_vec();
    let last = values.last().copied().unwrap_or(0.0);
    lanes.resize(values.len().next_multiple_of(NARROW), last);
    lanes
}

impl Bank {
    /// One member per shape (A/m, any order); refuses an empty grid and every invalid member.
    pub fn new(base: Hysteresis, shapes_a_per_m: &[f64]) -> Result<Self, ModelError> {
        if shapes_a_per_m.is_empty() {
            return Err(ModelError::TooFew {
                what: "a bank's grid of shapes",
                least: 1,
                given: 0,
            });
        }
        let mut longest_substep = f64::INFINITY;
        let mut smallest_shape = f64::INFINITY;
        for &shape in shapes_a_per_m {
            require_positive(shape, "shape a of a bank member", "A/m")?;
            let member = base.with_shape(shape);
            member.validate()?;
            longest_substep = longest_substep.min(member.longest_substep_a_per_m());
            smallest_shape = smallest_shape.min(shape);
        }
        let shape = padded(shapes_a_per_m);
        let inverse_shape = shape.iter().map(|shape| 1.0 / shape).collect();
        let zeros = vec![0.0; shape.len()];
        Ok(Bank {
            base,
            members: shapes_a_per_m.len(),
            field: 0.0,
            direction: 0.0,
            longest_substep,
            smallest_shape,
            lanes: BankLanes {
                shape,
                inverse_shape,
                magnetization: zeros.clone(),
                irreversible: zeros.clone(),
                switch_field: zeros,
            },
        })
    }

    /// Moves the field monotonically to `field_to_a_per_m` in every member. Allocates nothing.
    pub fn advance(&mut self, field_to_a_per_m: f64) {
        self.advance_by(field_to_a_per_m, 1.0, Instructions::best());
    }

    /// The same while the pinning is so many times as strong, not weaker.
    pub fn advance_pinned(&mut self, field_to_a_per_m: f64, factor: f64) {
        self.advance_by(field_to_a_per_m, factor, Instructions::best());
    }

    /// The same on chosen instructions: the same bits.
    pub fn advance_with(&mut self, field_to_a_per_m: f64, instructions: Instructions) {
        self.advance_by(field_to_a_per_m, 1.0, instructions);
    }

    fn advance_by(&mut self, field_to_a_per_m: f64, pinning_factor: f64, instructions: Instructions) {
        let to = field_to_a_per_m;
        let from = self.field;
        let change = to - from;
        if change == 0.0 {
            return;
        }
        self.field = to;
        if !change.is_finite() {
            self.lanes.magnetization.fill(f64::NAN);
            return;
        }
        let direction = if change > 0.0 { 1.0 } else { -1.0 };
        let step = FieldStep {
            from,
            to,
            direction,
            reversed: direction != self.direction,
            longest: self.longest_substep,
        };
        let base = self.base.pinned(pinning_factor);
        let coupled = (base.coupling * base.saturation_magnetization_a_per_m).abs();
        let argument = (from.abs().max(to.abs()) + coupled) / self.smallest_shape;
        bank_step::advance(&base, &mut self.lanes, step, argument, instructions);
        self.direction = direction;
    }

    /// The grid, A/m, in the order given.
    pub fn shapes(&self) -> &[f64] {
        &self.lanes.shape[..self.members]
    }

    /// M of each member, A/m, in the grid's order.
    pub fn magnetizations(&self) -> &[f64] {
        &self.lanes.magnetization[..self.members]
    }

    /// The field that all members see, A/m.
    pub fn field_a_per_m(&self) -> f64 {
        self.field
    }

    /// The material that the members share, except for their shape.
    pub fn base(&self) -> &Hysteresis {
        &self.base
    }
}

impl From<Bank> for BankSnapshot {
    fn from(bank: Bank) -> Self {
        let members = |lanes: &[f64]| lanes[..bank.members].to_vec();
        BankSnapshot {
            base: bank.base,
            shapes_a_per_m: members(&bank.lanes.shape),
            field_a_per_m: bank.field,
            direction: bank.direction,
            magnetizations_a_per_m: members(&bank.lanes.magnetization),
            irreversible_a_per_m: members(&bank.lanes.irreversible),
            switch_fields_a_per_m: members(&bank.lanes.switch_field),
        }
    }
}

impl TryFrom<BankSnapshot> for Bank {
    type Error = ModelError;

    fn try_from(snapshot: BankSnapshot) -> Result<Self, ModelError> {
        let mut bank = Bank::new(snapshot.base, &snapshot.shapes_a_per_m)?;
        bank.field = snapshot.field_a_per_m;
        bank.direction = snapshot.direction;
        let lanes = &mut bank.lanes;
        for (lane, stored) in [
            (&mut lanes.magnetization, &snapshot.magnetizations_a_per_m),
            (&mut lanes.irreversible, &snapshot.irreversible_a_per_m),
            (&mut lanes.switch_field, &snapshot.switch_fields_a_per_m),
        ] {
            if stored.len() != bank.members {
                return Err(ModelError::TooFew {
                    what: "a stored bank's list of member states",
                    least: bank.members,
                    given: stored.len(),
                });
            }
            *lane = padded(stored);
        }
        Ok(bank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Anhysteretic;

    /// Guards "same bits everywhere": every instruction set this machine has, on every kernel, along reversals and jumps.
    #[test]
    fn all_instruction_sets_give_identical_bits() {
        let choices: Vec<Instructions> = Instructions::available().collect();
        println!("compared: {choices:?}");
        // Those worked on in wide, those in narrow blocks, and one that is padded.
        let shapes: Vec<f64> = (0..49).map(|member| 6300.0 + 20.0 * f64::from(member)).collect();
        for (anhysteretic, coupling, amplitude) in [
            (Anhysteretic::Langevin, -0.01, 8e3),
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
                    bank.advance_with(field, instructions);
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
