//! An open-loop drive in the place of the inverse: H(t_k+2), whatever is demanded.
//!
//! For experiments that tell explanations of a measured gap apart: the signal goes through guard and amplifier as any
//! command does, and plant, sensors and recording are those of the loop.

use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, Invalid, NodeId, Now, Previous, SafeField};
use anhyst_model::DriveSignal;
use serde::{Deserialize, Serialize};

/// A command is for the instant two ticks later.
const TICKS_AHEAD: u64 = 2;

/// Sends a drive signal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    signal: DriveSignal,
    tick_s: f64,
    field_limit_a_per_m: f64,
}

impl Drive {
    /// The signal within ± the limit, at ticks of `tick_s`.
    ///
    /// # Errors
    /// A signal that cannot be used.
    pub fn new(signal: DriveSignal, tick_s: f64, field_limit_a_per_m: f64) -> Result<Self, Invalid> {
        validate(&signal)?;
        Ok(Self {
            signal,
            tick_s,
            field_limit_a_per_m,
        })
    }

    fn field_a_per_m(&self, tick: u64) -> f64 {
        let limit = self.field_limit_a_per_m;
        let wanted = self.signal.field_a_per_m((tick + TICKS_AHEAD) as f64 * self.tick_s);
        wanted.clamp(-limit, limit)
    }
}

/// Refuses a signal that cannot be sent.
pub(crate) fn validate(signal: &DriveSignal) -> Result<(), Invalid> {
    signal
        .validate()
        .map_err(|error| Invalid::new("drive", error.to_string()))
}

impl Block for Drive {
    const NODE: NodeId = NodeId::Inverse;
    type Inputs = (Now<Demand>, Now<Estimate>, Previous<SafeField>);
    type Outputs = (FieldCommand,);

    fn step(&mut self, tick: u64, _: Self::Inputs) -> Self::Outputs {
        let field = self.field_a_per_m(tick);
        (FieldCommand {
            field_a_per_m: field,
            coil_field_a_per_m: field,
            ..FieldCommand::default()
        },)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the instant a command is for, the limit, and the refusal of a broken signal.
    #[test]
    fn a_drive_is_two_ticks_ahead_and_within_the_limit() {
        let ramp = DriveSignal::Ramp {
            from_a_per_m: 0.0,
            to_a_per_m: 100.0,
            duration_s: 10.0,
        };
        let mut drive = Drive::new(ramp, 1.0, 50.0).unwrap();
        let inputs = (
            Now(Demand::default()),
            Now(Estimate::default()),
            Previous(SafeField::default()),
        );
        let sent = [0, 1, 6].map(|tick| drive.step(tick, inputs).0.field_a_per_m);
        assert_eq!(sent, [20.0, 30.0, 50.0]);
        let broken = DriveSignal::Tracking {
            amplitude_a_per_m: f64::NAN,
        };
        assert!(Drive::new(broken, 1.0, 50.0).is_err());
    }
}
