//! The guard in the loop: the only file here that knows messages.

use crate::watch::Heard;
use crate::{Event, Guard, State};
use anhyst_ipc::{Block, FieldCommand, FieldKind, Measurement, Message, NodeId, Now, SafeField};

const AMPLITUDE: u64 = 1;
const SLEW: u64 = 2;
const RAMPING: u64 = 4;
const SAFE: u64 = 8;

impl Block for Guard {
    const NODE: NodeId = NodeId::Guard;
    type Inputs = (Now<FieldCommand>, Now<Measurement>);
    type Outputs = (SafeField,);

    fn step(&mut self, tick: u64, (Now(command), Now(measurement)): Self::Inputs) -> Self::Outputs {
        let given = self.give(&Heard {
            command_a_per_m: command.field_a_per_m,
            command_finite: finite(&command),
            command_age_ticks: tick.abs_diff(command.tick),
            displacement_m: measurement.displacement_m,
            measurement_finite: finite(&measurement),
            measurement_age_ticks: tick.abs_diff(measurement.tick),
        });
        let bits = [
            (given.amplitude_limited, AMPLITUDE),
            (given.slew_limited, SLEW),
            (self.state() == State::Ramping, RAMPING),
            (self.state() == State::Safe, SAFE),
        ];
        (SafeField {
            field_a_per_m: given.field_a_per_m,
            status: bits
                .into_iter()
                .filter(|(set, _)| *set)
                .fold(0, |status, (_, bit)| status | bit),
            event: given.event.map_or(0, Event::number),
            ..SafeField::default()
        },)
    }
}

/// Every number of the token is finite: a sender that computes nonsense in one field is not trusted in another.
fn finite<M: Message>(token: &M) -> bool {
    let mut words = [0; 24];
    token.write_words(&mut words);
    M::FIELDS
        .iter()
        .zip(words)
        .all(|(field, word)| field.kind != FieldKind::F64 || f64::from_bits(word).is_finite())
}
