//! dH/dM = 1/F(H, M) from the state at t_k+1 to the magnetization demanded at t_k+2.
//!
//! F = dM/dH of the hysteresis with the estimated shape parameter; H field, M magnetization (A/m).
//! What the estimator knows holds at t_k; the field at t_k+1 is on its way already, so the state is first carried there with
//! the model, and the field decided now takes it from t_k+1 to t_k+2, which is what the demand is about.
//! Assumptions: parameters other than `a` are known; the amplifier adds no further ticks of delay.
//! Source: the paper's inverse compensator (section 1), started from the present state.

use crate::lead::Lead;
use crate::{InverseError, InverseSettings, Structure};
use anhyst_model::{AmplifierConstants, Hysteresis, MagneticState};
use serde::{Deserialize, Serialize};

/// Fields beyond this multiple of the limit, and shapes this many times larger or smaller than the material's, are no
/// knowledge: whoever says so is broken.
const CREDIBLE: f64 = 10.0;

/// What the estimator says about t_k and t_k+1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// Estimated shape parameter a, A/m.
    pub shape_a_per_m: f64,
    /// Field and magnetization at t_k.
    pub state: MagneticState,
    /// Field at t_k+1, A/m.
    pub next_field_a_per_m: f64,
}

/// What the controller wants at t_k+2.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wanted {
    /// Magnetization, A/m.
    pub magnetization_a_per_m: f64,
    /// Its rate, A/(m s).
    pub magnetization_rate_a_per_m_s: f64,
}

/// The answer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Command {
    /// Field wanted from the amplifier, A/m.
    pub field_a_per_m: f64,
    /// Field wanted in the coil at t_k+2, A/m.
    pub coil_field_a_per_m: f64,
    /// Magnetization at t_k+1, where the inversion started, A/m.
    pub start_magnetization_a_per_m: f64,
    /// Magnetization that the field in the coil will reach, A/m.
    pub reached_magnetization_a_per_m: f64,
    /// The demand needs more field than the limit.
    pub limited: bool,
}

/// The inverse compensator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inverse {
    structure: Structure,
    hysteresis: Hysteresis,
    /// M/H of the linear structure, no unit.
    susceptibility: f64,
    field_limit_a_per_m: f64,
    lead: Lead,
    last: Command,
    /// What the estimator said last that could be used; the material's own at first.
    shape_a_per_m: f64,
}

impl Inverse {
    /// A demagnetised material behind an amplifier at rest; `guard_limit_a_per_m` is the limit where the settings give none. The material's own `a` is used by [`Structure::Gain`] only.
    ///
    /// # Errors
    /// A setting or a constant that cannot be used.
    pub fn new(
        settings: &InverseSettings,
        hysteresis: Hysteresis,
        amplifier: &AmplifierConstants,
        guard_limit_a_per_m: f64,
    ) -> Result<Self, InverseError> {
        let field_limit_a_per_m = settings.field_limit_a_per_m.unwrap_or(guard_limit_a_per_m);
        settings.validate()?;
        hysteresis.validate()?;
        amplifier.validate()?;
        let initial = hysteresis.initial_susceptibility();
        let lag_s = if settings.compensate_amplifier {
            amplifier.lag_s()
        } else {
            0.0
        };
        Ok(Self {
            structure: settings.structure,
            hysteresis,
            susceptibility: initial / (1.0 - hysteresis.coupling * initial),
            field_limit_a_per_m,
            lead: Lead::new(lag_s, field_limit_a_per_m),
            last: Command::default(),
            shape_a_per_m: hysteresis.shape_a_per_m,
        })
    }

    /// The command for t_k+2. Where the estimate or the demand cannot be used, or the answer is not finite, the last command
    /// stays; nothing that is not finite or beyond the limit ever comes out.
    pub fn step(&mut self, wanted: Wanted, known: Known) -> Command {
        let numbers = wanted.magnetization_a_per_m.is_finite() && wanted.magnetization_rate_a_per_m_s.is_finite();
        if numbers && (self.structure == Structure::Gain || self.credible(&known)) {
            if self.structure != Structure::Gain {
                self.shape_a_per_m = known.shape_a_per_m;
            }
            let command = match self.structure {
                Structure::FromEstimate => {
                    let model = self.hysteresis.with_shape(known.shape_a_per_m);
                    self.invert(&model, model.advance(known.state, known.next_field_a_per_m), wanted)
                }
                Structure::OwnMemory => self.invert_from_memory(wanted),
                Structure::Gain => self.divide(wanted),
            };
            if command.reached_magnetization_a_per_m.is_finite() && command.field_a_per_m.is_finite() {
                self.last = command;
            }
        }
        self.last
    }

    /// The command for t_k+2 where the estimator is silent: from where the last command leads, with the last shape that the
    /// estimator said, the material's own if it never said any.
    pub fn step_uninformed(&mut self, wanted: Wanted) -> Command {
        if wanted.magnetization_a_per_m.is_finite() && wanted.magnetization_rate_a_per_m_s.is_finite() {
            let command = match self.structure {
                Structure::FromEstimate | Structure::OwnMemory => self.invert_from_memory(wanted),
                Structure::Gain => self.divide(wanted),
            };
            if command.reached_magnetization_a_per_m.is_finite() && command.field_a_per_m.is_finite() {
                self.last = command;
            }
        }
        self.last
    }

    fn invert_from_memory(&self, wanted: Wanted) -> Command {
        let start = MagneticState {
            field_a_per_m: self.last.coil_field_a_per_m,
            magnetization_a_per_m: self.last.reached_magnetization_a_per_m,
        };
        self.invert(&self.hysteresis.with_shape(self.shape_a_per_m), start, wanted)
    }

    fn credible(&self, known: &Known) -> bool {
        let far = CREDIBLE * self.field_limit_a_per_m;
        let nominal = self.hysteresis.shape_a_per_m;
        known.state.field_a_per_m.abs() <= far
            && known.next_field_a_per_m.abs() <= far
            && known.state.magnetization_a_per_m.abs() <= CREDIBLE * self.hysteresis.saturation_magnetization_a_per_m
            && (nominal / CREDIBLE..=nominal * CREDIBLE).contains(&known.shape_a_per_m)
    }

    fn invert(&self, model: &Hysteresis, start: MagneticState, wanted: Wanted) -> Command {
        let limit = self.field_limit_a_per_m;
        let end = model.advance_to_magnetization(start, wanted.magnetization_a_per_m, limit);
        let coil_field = end.state.field_a_per_m;
        let lead = if end.limited {
            0.0
        } else {
            self.lead.field_a_per_m(wanted.magnetization_rate_a_per_m_s, end.slope)
        };
        Command {
            field_a_per_m: (coil_field + lead).clamp(-limit, limit),
            coil_field_a_per_m: coil_field,
            start_magnetization_a_per_m: start.magnetization_a_per_m,
            reached_magnetization_a_per_m: end.state.magnetization_a_per_m,
            limited: end.limited,
        }
    }

    fn divide(&self, wanted: Wanted) -> Command {
        let limit = self.field_limit_a_per_m;
        let asked = wanted.magnetization_a_per_m / self.susceptibility;
        let coil_field = asked.clamp(-limit, limit);
        let lead = self
            .lead
            .field_a_per_m(wanted.magnetization_rate_a_per_m_s, self.susceptibility);
        Command {
            field_a_per_m: (coil_field + lead).clamp(-limit, limit),
            coil_field_a_per_m: coil_field,
            start_magnetization_a_per_m: self.last.reached_magnetization_a_per_m,
            reached_magnetization_a_per_m: self.susceptibility * coil_field,
            limited: asked != coil_field,
        }
    }
}

#[cfg(test)]
#[path = "inverse_tests.rs"]
mod tests;
