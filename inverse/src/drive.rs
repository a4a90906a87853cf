//! An open-loop drive in the place of the inverse: H(t_k+2), whatever is demanded.
//!
//! For experiments that tell explanations of a measured gap apart: the signal goes through guard and amplifier as any
//! command does, and plant, sensors and recording are those of the loop.

use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, Invalid, NodeId, Now, Previous, SafeField};
use anhyst_model::DriveSignal;
use serde::{Deserialize, Serialize};

/// A command is for the instant two ticks later.
const TICKS_AHEAD: u64 = 2;

/// Sends drive signals, one after the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Each with the instant, in ticks, at which it ends; the last one does not.
    parts: Vec<(DriveSignal, u64)>,
    tick_s: f64,
    field_limit_a_per_m: f64,
}

impl Drive {
    /// The signals, each for so many seconds, within ± the limit, at ticks of `tick_s`.
    ///
    /// # Errors
    /// A signal that cannot be used.
    pub fn new(signals: &[(DriveSignal, f64)], tick_s: f64, field_limit_a_per_m: f64) -> Result<Self, Invalid> {
        validate(signals)?;
        let mut end_s = 0.0;
        let ends = signals.iter().map(|(signal, duration_s)| {
            end_s += duration_s;
            (*signal, (end_s / tick_s).round() as u64)
        });
        Ok(Self {
            parts: ends.collect(),
            tick_s,
            field_limit_a_per_m,
        })
    }

    fn field_a_per_m(&self, tick: u64) -> f64 {
        let limit = self.field_limit_a_per_m;
        let instant = tick + TICKS_AHEAD;
        let part = self.parts.partition_point(|(_, end)| *end <= instant);
        let part = part.min(self.parts.len().saturating_sub(1));
        let Some((signal, _)) = self.parts.get(part) else {
            return 0.0;
        };
        let begin = part.checked_sub(1).map_or(0, |before| self.parts[before].1);
        let wanted = signal.field_a_per_m((instant - begin) as f64 * self.tick_s);
        wanted.clamp(-limit, limit)
    }
}

/// Refuses what cannot be sent.
pub(crate) fn validate(signals: &[(DriveSignal, f64)]) -> Result<(), Invalid> {
    signals.iter().try_for_each(|(signal, duration_s)| {
        signal
            .validate()
            .map_err(|error| Invalid::new("drive", error.to_string()))?;
        if *duration_s > 0.0 {
            return Ok(());
        }
        Err(Invalid::new(
            "drives",
            format!("a drive of {duration_s} s is none: give a time above 0 s"),
        ))
    })
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

    // Guards the instant a command is for, the limit, the order of several, and the refusal of a broken signal.
    #[test]
    fn a_drive_is_two_ticks_ahead_and_within_the_limit() {
        let ramp = DriveSignal::Ramp {
            from_a_per_m: 0.0,
            to_a_per_m: 100.0,
            duration_s: 10.0,
        };
        let mut drive = Drive::new(&[(ramp, f64::INFINITY)], 1.0, 50.0).unwrap();
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
        assert!(Drive::new(&[(broken, 1.0)], 1.0, 50.0).is_err());
        assert!(Drive::new(&[(ramp, 0.0)], 1.0, 50.0).is_err());
        // One after the other, each from its own beginning; the last one goes on.
        let mut several = Drive::new(&[(ramp, 3.0), (ramp, 2.0)], 1.0, 50.0).unwrap();
        let sent = [0, 1, 2, 3, 9].map(|tick| several.step(tick, inputs).0.field_a_per_m);
        assert_eq!(sent, [20.0, 0.0, 10.0, 20.0, 50.0]);
    }
}
