//! τ dH/dt = s(t) − H,  |ds/dt| ≤ slew limit,  s → clip(w(t), ±field limit),  τ = 1/(2π bandwidth)
//!
//! H coil field, s slew-limited target, w command after delay and hold (A/m), τ lag (s).
//! The command u_k comes at t_k. One sample of computing delay and a first-order hold: over (t_k, t_k+1] the
//! command w ramps from u_k-2-d to u_k-1-d, d extra ticks of delay, zero before the start. So the field at t_k+1
//! is known before u_k is: [`Amplifier::next_field_a_per_m`]. The lag is propagated exactly for a ramp:
//! H_k+1 = E H_k + (g − E) s_k + (1 − g) s_k+1,  E = e^(−T/τ),  g = (τ/T)(1 − E),  T the tick.
//! Assumptions: the current loop is a first-order lag; limits act on its target once a tick, so that s is a
//! straight line within a tick. Each part may be absent; without any, H(t_k+1) = u_k-1.
//! Source: current amplifiers of giant magnetostrictive actuators, 1-5 kHz small signal, slew rate V/L.

use core::f64::consts::PI;
use serde::{Deserialize, Serialize};

use crate::ModelError;
use crate::effects::lag::Lag;
use crate::error::require_positive;

/// Longest extra delay in ticks.
pub const MAX_DELAY_TICKS: u32 = 63;

/// What an amplifier is; the default passes commands on after one tick, without lag or limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AmplifierConstants {
    /// Frequency at which a small signal has fallen to 1/√2, Hz; none: no lag.
    pub bandwidth_hz: Option<f64>,
    /// Largest field either way, A/m.
    pub field_limit_a_per_m: Option<f64>,
    /// Fastest change of the field either way, A/(m s): supply voltage over coil inductance, as a field.
    pub slew_limit_a_per_m_s: Option<f64>,
    /// Delay in ticks beyond the one that every loop has.
    pub delay_ticks: u32,
}

impl AmplifierConstants {
    /// Checks every part that is present.
    ///
    /// # Errors
    /// The first quantity that is not finite and positive, or too long a delay.
    pub fn validate(&self) -> Result<(), ModelError> {
        let parts = [
            (self.bandwidth_hz, "the amplifier's bandwidth", "Hz"),
            (self.field_limit_a_per_m, "the amplifier's field limit", "A/m"),
            (self.slew_limit_a_per_m_s, "the amplifier's slew limit", "A/(m s)"),
        ];
        for (part, quantity, unit) in parts {
            if let Some(value) = part {
                require_positive(value, quantity, unit)?;
            }
        }
        if self.delay_ticks > MAX_DELAY_TICKS {
            return Err(ModelError::OutOfRange {
                quantity: "the amplifier's delay",
                value: f64::from(self.delay_ticks),
                unit: "ticks",
                requirement: "at most 63 ticks",
            });
        }
        Ok(())
    }

    /// τ in s; 0 without a lag. A compensator commands u = H + τ dH/dt.
    pub fn lag_s(&self) -> f64 {
        self.bandwidth_hz
            .map_or(0.0, |bandwidth_hz| 1.0 / (2.0 * PI * bandwidth_hz))
    }
}

/// What one tick gave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AmplifierOutput {
    /// Field in the coil at the end of the tick, A/m.
    pub field_a_per_m: f64,
    /// The command that this tick acted on was beyond the field limit.
    pub amplitude_limited: bool,
    /// The target could not follow that command.
    pub slew_limited: bool,
}

/// The amplifier in motion, from rest at zero field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Amplifier {
    constants: AmplifierConstants,
    tick_s: f64,
    /// From the target to the field.
    lag: Lag,
    /// The last 64 commands, newest at `newest`; eight by eight because serde knows arrays up to 32.
    commands_a_per_m: [[f64; 8]; 8],
    newest: u32,
}

impl Amplifier {
    /// At rest, for ticks of `tick_s`.
    ///
    /// # Errors
    /// As [`AmplifierConstants::validate`], or a tick that is not finite and positive.
    pub fn new(constants: AmplifierConstants, tick_s: f64) -> Result<Self, ModelError> {
        constants.validate()?;
        require_positive(tick_s, "the tick", "s")?;
        Ok(Amplifier {
            constants,
            tick_s,
            lag: Lag::new(constants.lag_s(), tick_s),
            commands_a_per_m: [[0.0; 8]; 8],
            newest: 0,
        })
    }

    /// What it is made of.
    pub fn constants(&self) -> &AmplifierConstants {
        &self.constants
    }

    /// τ in s; 0 without a lag.
    pub fn lag_s(&self) -> f64 {
        self.constants.lag_s()
    }

    /// The field after the last step, A/m.
    pub fn field_a_per_m(&self) -> f64 {
        self.lag.output()
    }

    /// The field that the next step will return whatever its command, A/m.
    pub fn next_field_a_per_m(&self) -> f64 {
        self.preview().0.field_a_per_m
    }

    /// Takes u_k and returns the field at t_k+1, on which u_k has no influence yet. A command that is not a number
    /// is taken as the one before it: no field that a coil could not have ever comes out.
    pub fn step(&mut self, command_a_per_m: f64) -> AmplifierOutput {
        let (output, target_a_per_m) = self.preview();
        self.lag.step(target_a_per_m);
        let accepted = if command_a_per_m.is_finite() {
            command_a_per_m
        } else {
            self.command(0)
        };
        self.newest = (self.newest + 1) % 64;
        let newest = self.newest as usize % 64;
        self.commands_a_per_m[newest / 8][newest % 8] = accepted;
        output
    }

    /// The command of `age` ticks before the newest.
    fn command(&self, age: u32) -> f64 {
        let at = (self.newest % 64 + 64 - age % 64) as usize % 64;
        self.commands_a_per_m[at / 8][at % 8]
    }

    /// The coming tick: its outcome and the target at its end.
    fn preview(&self) -> (AmplifierOutput, f64) {
        let command = self.command(self.constants.delay_ticks);
        let clipped = match self.constants.field_limit_a_per_m {
            Some(limit) => command.clamp(-limit, limit),
            None => command,
        };
        let from = self.lag.input();
        let target = match self.constants.slew_limit_a_per_m_s {
            Some(limit) => clipped.clamp(from - limit * self.tick_s, from + limit * self.tick_s),
            None => clipped,
        };
        let (rest, weight) = self.lag.response();
        let output = AmplifierOutput {
            field_a_per_m: rest + weight * target,
            amplitude_limited: clipped != command,
            slew_limited: target != clipped,
        };
        (output, target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 5e-5;

    fn amplifier(constants: AmplifierConstants) -> Amplifier {
        Amplifier::new(constants, TICK_S).unwrap()
    }

    /// Guards the loop's timing: with everything off the field at t_k+1 is u_k-1, bit for bit; with d, u_k-1-d.
    #[test]
    fn passes_commands_on_after_their_delay() {
        for delay_ticks in [0, 1, 5, MAX_DELAY_TICKS] {
            let mut amplifier = amplifier(AmplifierConstants {
                delay_ticks,
                ..Default::default()
            });
            let command = |k: i64| if k < 0 { 0.0 } else { 100.0 + 0.1 * k as f64 };
            for k in 0..300 {
                let output = amplifier.step(command(k));
                assert_eq!(
                    output.field_a_per_m,
                    command(k - 1 - i64::from(delay_ticks)),
                    "tick {k}"
                );
                assert!(!output.amplitude_limited && !output.slew_limited);
            }
        }
    }

    /// Guards the estimator, which predicts with `next_field_a_per_m`.
    #[test]
    fn the_next_field_is_known_whatever_the_command() {
        let mut amplifier = amplifier(AmplifierConstants {
            bandwidth_hz: Some(2000.0),
            field_limit_a_per_m: Some(900.0),
            slew_limit_a_per_m_s: Some(5e6),
            delay_ticks: 2,
        });
        for k in 0..500 {
            let expected = amplifier.next_field_a_per_m();
            let mut other = amplifier;
            let output = amplifier.step(1000.0 * libm::sin(0.05 * f64::from(k)));
            assert_eq!(output.field_a_per_m.to_bits(), expected.to_bits());
            assert_eq!(other.step(-1e9).field_a_per_m.to_bits(), expected.to_bits());
        }
    }

    /// Guards the propagation: a ramp r·t through the lag is r(t − τ(1 − e^(−t/τ))), also where τ is 1e5 ticks.
    #[test]
    fn a_ramp_through_the_lag_is_exact() {
        for bandwidth_hz in [0.03, 50.0, 2000.0, 1e6] {
            let mut amplifier = amplifier(AmplifierConstants {
                bandwidth_hz: Some(bandwidth_hz),
                ..Default::default()
            });
            let lag_s = amplifier.lag_s();
            let rate = 1e6;
            for k in 0..2000 {
                let field = amplifier.step(rate * TICK_S * f64::from(k)).field_a_per_m;
                // The command of tick k is reached at t_k+2, so the ramp begins at t_2.
                let t = TICK_S * f64::from(k - 1);
                let expected = if t > 0.0 {
                    rate * (t + lag_s * libm::expm1(-t / lag_s))
                } else {
                    0.0
                };
                assert!(
                    (field - expected).abs() <= 1e-9 * rate * t.abs().max(TICK_S),
                    "{bandwidth_hz} Hz, tick {k}"
                );
            }
        }
    }

    /// Guards both limits, their flags and their order: clip first, then slew.
    #[test]
    fn limits_hold_and_are_reported() {
        let mut amplifier = amplifier(AmplifierConstants {
            field_limit_a_per_m: Some(1000.0),
            slew_limit_a_per_m_s: Some(4e6),
            ..Default::default()
        });
        let outputs: Vec<_> = (0..9).map(|_| amplifier.step(5000.0)).collect();
        let fields: Vec<_> = outputs.iter().map(|output| output.field_a_per_m).collect();
        let expected = [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0, 1000.0, 1000.0, 1000.0];
        for (field, expected) in fields.iter().zip(expected) {
            assert!((field - expected).abs() < 1e-9, "{fields:?}");
        }
        assert_eq!(outputs.iter().filter(|output| output.slew_limited).count(), 4);
        assert_eq!(outputs.iter().filter(|output| output.amplitude_limited).count(), 8);
    }

    /// Guards the coil: no command, however broken, makes the field other than finite.
    #[test]
    fn a_command_that_is_no_number_holds_the_last() {
        let mut amplifier = amplifier(AmplifierConstants::default());
        for command in [10.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 20.0] {
            amplifier.step(command);
        }
        assert_eq!(amplifier.field_a_per_m(), 10.0);
        assert_eq!(amplifier.next_field_a_per_m(), 20.0);
    }

    /// Guards snapshots: through JSON and on, the same bits.
    #[test]
    fn a_snapshot_continues_with_the_same_bits() {
        let constants = AmplifierConstants {
            bandwidth_hz: Some(1500.0),
            delay_ticks: 7,
            ..Default::default()
        };
        let mut original = amplifier(constants);
        for k in 0..100 {
            original.step(f64::from(k * k % 37));
        }
        let mut copy: Amplifier = serde_json::from_str(&serde_json::to_string(&original).unwrap()).unwrap();
        assert_eq!(copy, original);
        for k in 0..100 {
            assert_eq!(original.step(f64::from(k % 11)), copy.step(f64::from(k % 11)));
        }
    }

    /// Guards the loading of scenarios: each refusal names its quantity.
    #[test]
    fn refuses_what_no_amplifier_can_be() {
        let base = AmplifierConstants::default();
        let wrong = [
            AmplifierConstants {
                bandwidth_hz: Some(0.0),
                ..base
            },
            AmplifierConstants {
                field_limit_a_per_m: Some(-1.0),
                ..base
            },
            AmplifierConstants {
                slew_limit_a_per_m_s: Some(f64::NAN),
                ..base
            },
            AmplifierConstants {
                delay_ticks: 64,
                ..base
            },
        ];
        for constants in wrong {
            assert!(Amplifier::new(constants, TICK_S).is_err(), "{constants:?}");
        }
        assert!(Amplifier::new(base, 0.0).is_err());
    }
}
