//! The guard in the loop: the only file here that knows messages.

use crate::guard::Given;
use crate::watch::{Observation, Quality};
use crate::{Event, Guard, State};
use anhyst_ipc::{
    Block, Demand, Estimate, FieldCommand, FieldKind, Measurement, Message, NodeId, Now, SafeField, status_word,
};

impl Block for Guard {
    const NODE: NodeId = NodeId::Guard;
    type Inputs = (Now<FieldCommand>, Now<Measurement>, Now<Demand>, Now<Estimate>);
    type Outputs = (SafeField,);

    fn step(&mut self, tick: u64, inputs: Self::Inputs) -> Self::Outputs {
        // By reference: taken apart in the arguments, the tokens are copied once more.
        let (Now(command), Now(measurement), Now(demand), Now(estimate)) = &inputs;
        let given = self.give(&Observation {
            tick,
            command: quality(tick, command),
            measurement: quality(tick, measurement),
            demand: quality(tick, demand),
            estimate: quality(tick, estimate),
            command_a_per_m: command.field_a_per_m,
            displacement_m: measurement.displacement_m,
            coil_field_a_per_m: measurement.coil_field_a_per_m,
            temperature_k: measurement.temperature_k,
            error_m: demand.error_m,
            shape_a_per_m: estimate.shape_a_per_m,
            informed: (estimate.status & Estimate::UNMEASURED == 0).then_some(estimate.status & Estimate::HELD == 0),
        });
        (self.token(&given),)
    }

    fn alone(&mut self, _tick: u64) -> Option<Self::Outputs> {
        let given = self.give_alone()?;
        Some((self.token(&given),))
    }
}

impl Guard {
    fn token(&self, given: &Given) -> SafeField {
        SafeField {
            field_a_per_m: given.field_a_per_m,
            status: status_word([
                (given.amplitude_limited, SafeField::AMPLITUDE_LIMITED),
                (given.slew_limited, SafeField::SLEW_LIMITED),
                (self.state() == State::Ramping, SafeField::RAMPING),
                (self.state() == State::Safe, SafeField::SAFE),
                (given.holding, SafeField::HOLDING),
                (self.fallen_back(), SafeField::FALL_BACK),
            ]),
            event: given.event.map_or(0, Event::number),
            ..SafeField::default()
        }
    }
}

/// Every number of the token is finite: a sender that computes nonsense in one field is not trusted in another.
fn quality<M: Message>(tick: u64, token: &M) -> Quality {
    Quality {
        finite: M::FIELDS
            .iter()
            .zip(token.field_words())
            .all(|(field, word)| field.kind != FieldKind::F64 || f64::from_bits(*word).is_finite()),
        tick: token.tick(),
        age_ticks: tick.abs_diff(token.tick()),
    }
}
