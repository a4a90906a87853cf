//! H(t_k) and H(t_k+1): best knowledge of the field in the coil now and one tick ahead.
//!
//! `Commanded`: the safe field of tick k−1 goes into the amplifier's model, which answers with the field at t_k; the field
//! at t_k+1 is on its way already. `Measured`: the measured field at t_k through a play; the change to t_k+1 is taken from
//! the amplifier's model. Fields in A/m. At tick 0 the commanded field is 0: nothing has been commanded.
//! Assumption: the amplifier's constants are known. Source: a play operator; what each costs in the loop is in docs/scenarios.md.

use crate::FieldSource;
use anhyst_model::{Amplifier, AmplifierConstants, ModelError, Play};
use serde::{Deserialize, Serialize};

/// The field in the coil at t_k and t_k+1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldKnowledge {
    /// At t_k, A/m.
    pub now_a_per_m: f64,
    /// At t_k+1, A/m.
    pub next_a_per_m: f64,
}

/// Follows the field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoilFieldModel {
    amplifier: Amplifier,
    commanded_a_per_m: f64,
    play: Option<Play>,
}

/// Beyond this no coil of an actuator goes: whoever says so is broken. Believing it would also cost: a model needs steps in
/// proportion to the way.
const MAX_A_PER_M: f64 = 1e7;

/// The field, or no number.
fn believable(field_a_per_m: f64) -> f64 {
    if field_a_per_m.abs() <= MAX_A_PER_M {
        field_a_per_m
    } else {
        f64::NAN
    }
}

impl CoilFieldModel {
    /// An amplifier at rest.
    ///
    /// # Errors
    /// If the amplifier's constants or the play cannot be used.
    pub fn new(source: FieldSource, constants: AmplifierConstants, tick_s: f64) -> Result<Self, ModelError> {
        let play = match source {
            FieldSource::Commanded => None,
            FieldSource::Measured { play_a_per_m } => Some(Play::new(play_a_per_m)?),
        };
        Ok(Self {
            amplifier: Amplifier::new(constants, tick_s)?,
            commanded_a_per_m: 0.0,
            play,
        })
    }

    /// Knowledge at t_k. A command that is not a number is taken as the last one; an unusable measurement leaves the play
    /// where it is.
    pub fn follow(&mut self, tick: u64, last_safe_field_a_per_m: f64, measured_a_per_m: f64) -> FieldKnowledge {
        let measured_a_per_m = believable(measured_a_per_m);
        if tick > 0 {
            let command_a_per_m = believable(last_safe_field_a_per_m);
            self.commanded_a_per_m = self.amplifier.step(command_a_per_m).field_a_per_m;
        }
        let commanded = self.commanded_a_per_m;
        let coming = self.amplifier.next_field_a_per_m();
        let Some(play) = &mut self.play else {
            return FieldKnowledge {
                now_a_per_m: commanded,
                next_a_per_m: coming,
            };
        };
        if measured_a_per_m.is_finite() {
            play.follow(measured_a_per_m);
        }
        let now_a_per_m = play.output();
        // The play itself will carry only what exceeds its width; the model must start where the play really will be.
        let mut ahead = *play;
        let measured = if measured_a_per_m.is_finite() {
            measured_a_per_m
        } else {
            now_a_per_m
        };
        let next_a_per_m = ahead.follow(measured + (coming - commanded));
        FieldKnowledge {
            now_a_per_m,
            next_a_per_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 5e-5;

    fn commands(k: u64) -> f64 {
        1000.0 * triangle(k)
    }

    fn triangle(k: u64) -> f64 {
        let phase = (k % 400) as f64 / 100.0;
        if phase < 1.0 {
            phase
        } else if phase < 3.0 {
            2.0 - phase
        } else {
            phase - 4.0
        }
    }

    // Guards the timing of the loop: knowledge at t_k equals what an amplifier fed with the same commands gave for t_k.
    #[test]
    fn commanded_field_is_the_amplifiers() {
        let constants = AmplifierConstants {
            bandwidth_hz: Some(2000.0),
            ..AmplifierConstants::default()
        };
        let mut real = Amplifier::new(constants, TICK_S).unwrap();
        let mut model = CoilFieldModel::new(FieldSource::Commanded, constants, TICK_S).unwrap();
        let (mut in_coil, mut last_command) = (0.0, 0.0);
        for k in 0..1000 {
            let known = model.follow(k, last_command, f64::NAN);
            assert_eq!(known.now_a_per_m, in_coil);
            last_command = commands(k);
            in_coil = real.step(last_command).field_a_per_m;
            assert_eq!(
                known.next_a_per_m, in_coil,
                "the next field does not depend on this tick's command"
            );
        }
    }

    // Guards the play: noise within its width must not move the model's field at all.
    #[test]
    fn noise_within_the_play_is_no_reversal() {
        let source = FieldSource::Measured { play_a_per_m: 3.0 };
        let mut model = CoilFieldModel::new(source, AmplifierConstants::default(), TICK_S).unwrap();
        for k in 0..10 {
            model.follow(k, 0.0, 100.0);
        }
        for (k, noise) in [(10, 2.9), (11, -2.9), (12, 1.0), (13, f64::NAN), (14, f64::INFINITY)] {
            assert_eq!(model.follow(k, 0.0, 100.0 + noise - 3.0).now_a_per_m, 97.0);
        }
    }
}
