//! dH/dM = 1/F(H, M) from the state at t_k+1 to the magnetization demanded at t_k+2.
//!
//! F = dM/dH of the hysteresis with the estimated parameters; H field, M magnetization (A/m).
//! What the estimator knows holds at t_k; the field at t_k+1 is on its way already, so the state is first carried there with
//! the model, and the field decided now takes it from t_k+1 to t_k+2, which is what the demand is about.
//! Assumptions: parameters that are not estimated are known; the amplifier adds no further ticks of delay.
//! Known effects of the actuator are turned round one by one: creep by solving its affine step for M, a constant field by
//! taking it off, lags behind the command by leads, a warm coil by asking for more. Then all fields but the command are those in the material.
//! Source: the paper's inverse compensator (section 1), started from the present state.

use crate::lead::Lead;
use crate::nominal::Nominal;
use crate::{InverseError, InverseSettings, Structure};
use anhyst_model::{AmplifierConstants, CoilGain, Creep, Effect, EffectKind, Hysteresis, MagneticState, PinningGrowth};
use serde::{Deserialize, Serialize};

/// Fields beyond this multiple of the limit, and shapes this many times larger or smaller than the material's, are no
/// knowledge: whoever says so is broken.
const CREDIBLE: f64 = 10.0;

/// Inversions where the pinning depends on the change that is sought: each leaves at most half of the error of the one before, mostly a tenth.
const ROUNDS: usize = 4;

/// What the estimator says about t_k and t_k+1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StateEstimate {
    /// Estimated shape parameter a, A/m.
    pub shape_a_per_m: f64,
    /// The other parameters; none: the material's own.
    pub others: Option<OtherParameters>,
    /// Field and magnetization at t_k.
    pub state: MagneticState,
    /// Field at t_k+1, A/m.
    pub next_field_a_per_m: f64,
}

/// Estimated parameters of the hysteresis beside `a`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherParameters {
    /// Ms, A/m.
    pub saturation_magnetization_a_per_m: f64,
    /// k, A/m.
    pub pinning_a_per_m: f64,
    /// α, no unit.
    pub coupling: f64,
    /// c, no unit.
    pub reversibility: f64,
}

/// What the controller wants at t_k+2.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MagnetizationDemand {
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inverse {
    structure: Structure,
    hysteresis: Hysteresis,
    /// M/H of the linear structure, no unit.
    susceptibility: f64,
    field_limit_a_per_m: f64,
    lead: Lead,
    /// Field in the material without one in the coil, A/m.
    bias_a_per_m: f64,
    creep: Option<Creep>,
    coil: Option<CoilGain>,
    pinning: Option<PinningGrowth>,
    /// By how much the field was to change in the tick before, A/m.
    last_change_a_per_m: f64,
    /// Command over field in the coil, no unit.
    coil_gain: f64,
    /// The answer before.
    pub(crate) last: Command,
    /// None: nothing to fall back to. Apart, because it is taken out in every step.
    #[serde(default)]
    nominal: Option<Box<Nominal>>,
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
        Self::with_effects(settings, hysteresis, amplifier, guard_limit_a_per_m, &[], 1.0)
    }

    /// The same for an actuator that has these effects, at ticks of `tick_s`. Turned round are creep, a constant field, a warm coil, excess loss,
    /// and the lags of eddy currents and amplifier; other effects are others' business or nobody's.
    ///
    /// # Errors
    /// A setting, a constant or an effect that cannot be used.
    pub fn with_effects(
        settings: &InverseSettings,
        hysteresis: Hysteresis,
        amplifier: &AmplifierConstants,
        guard_limit_a_per_m: f64,
        effects: &[Effect],
        tick_s: f64,
    ) -> Result<Self, InverseError> {
        let field_limit_a_per_m = settings.field_limit_a_per_m.unwrap_or(guard_limit_a_per_m);
        settings.validate()?;
        hysteresis.validate()?;
        amplifier.validate()?;
        let initial = hysteresis.initial_susceptibility();
        let size = |kind: EffectKind| {
            let known = effects.iter().find(|effect| effect.kind() == kind);
            known.and_then(|effect| effect.values().first().copied()).unwrap_or(0.0)
        };
        // Two lags of the amplifier, its nominal one and its effect, are led as one of their sum.
        let amplifier_lag_s = if settings.compensate_amplifier {
            amplifier.lag_s() + size(EffectKind::AmplifierBandwidth)
        } else {
            0.0
        };
        let lags_s = [amplifier_lag_s, size(EffectKind::EddyCurrent)];
        let followed = |kind: EffectKind| settings.compensate_amplifier || kind != EffectKind::AmplifierBandwidth;
        let led: Vec<Effect> = effects
            .iter()
            .filter(|effect| followed(effect.kind()))
            .copied()
            .collect();
        Ok(Self {
            structure: settings.structure,
            hysteresis,
            susceptibility: initial / (1.0 - hysteresis.coupling * initial),
            field_limit_a_per_m,
            lead: Lead::series(lags_s, field_limit_a_per_m, tick_s).of_second_order(&led),
            bias_a_per_m: size(EffectKind::BiasShift),
            creep: Creep::new(effects, tick_s)?,
            coil: CoilGain::new(effects, tick_s),
            pinning: PinningGrowth::new(effects, tick_s),
            last_change_a_per_m: 0.0,
            coil_gain: 1.0,
            last: Command::default(),
            nominal: None,
        })
    }

    /// Gives it something to fall back to: the nominal material behind this amplifier, for ticks of `tick_s`.
    ///
    /// # Errors
    /// If the amplifier's constants or the tick cannot be used.
    pub fn with_fall_back(mut self, amplifier: &AmplifierConstants, tick_s: f64) -> Result<Self, InverseError> {
        self.nominal = Some(Box::new(Nominal::new(amplifier, tick_s)?));
        Ok(self)
    }

    /// As [`Inverse::step`], but `fall_back` leaves the estimate alone; `given_a_per_m` is the safe field of the tick before.
    pub(crate) fn step_guarded(
        &mut self,
        tick: u64,
        wanted: MagnetizationDemand,
        known: StateEstimate,
        fall_back: bool,
        given_a_per_m: f64,
    ) -> Command {
        let Some(mut nominal) = self.nominal.take() else {
            return self.step(wanted, known);
        };
        let credible = given_a_per_m.abs() <= CREDIBLE * self.field_limit_a_per_m;
        let given_a_per_m = if credible {
            given_a_per_m
        } else {
            self.last.field_a_per_m
        };
        nominal.follow(tick, given_a_per_m, &self.hysteresis);
        let without_estimate = fall_back && self.structure != Structure::Gain;
        let turns = nominal.turns(fall_back);
        if turns {
            let reached = self.reached_by(given_a_per_m, without_estimate.then_some(nominal.state), &known);
            nominal.begin(reached.map_or(0.0, |reached| reached - wanted.magnetization_a_per_m));
        }
        let mut asked = wanted;
        let ahead = nominal.magnetization_a_per_m();
        if ahead != 0.0 {
            asked.magnetization_a_per_m += ahead;
        }
        let mut command = if without_estimate {
            self.step_nominal(asked, nominal.state)
        } else {
            self.step(asked, known)
        };
        if turns {
            nominal.begin_field(given_a_per_m - command.field_a_per_m);
        }
        let distance = nominal.take_field_a_per_m();
        // Not added when it is 0: that would turn -0 into 0.
        if distance != 0.0 {
            let limit = self.field_limit_a_per_m;
            command.field_a_per_m = (command.field_a_per_m + distance).clamp(-limit, limit);
            command.coil_field_a_per_m = (command.coil_field_a_per_m + distance).clamp(-limit, limit);
        }
        self.nominal = Some(nominal);
        command
    }

    /// Magnetization at t_k+2 if this field is given again, where the new way starts from a state that follows the field.
    fn reached_by(&self, given_a_per_m: f64, nominal: Option<MagneticState>, known: &StateEstimate) -> Option<f64> {
        let (model, start) = match nominal {
            Some(state) => (self.hysteresis, state),
            None if self.structure == Structure::FromEstimate && self.credible(known) => {
                let model = self.model(known);
                (model, model.advance(known.state, known.next_field_a_per_m))
            }
            None => return None,
        };
        let field_a_per_m = given_a_per_m / self.coil_gain + self.bias_a_per_m;
        Some(model.advance(start, field_a_per_m).magnetization_a_per_m)
    }

    fn step_nominal(&mut self, wanted: MagnetizationDemand, start: MagneticState) -> Command {
        if wanted.magnetization_a_per_m.is_finite() && wanted.magnetization_rate_a_per_m_s.is_finite() {
            let model = self.hysteresis;
            let command = self.invert(&model, start, wanted);
            if command.reached_magnetization_a_per_m.is_finite() && command.field_a_per_m.is_finite() {
                self.last = command;
            }
        }
        self.last
    }

    /// The command for t_k+2. Where the estimate or the demand cannot be used, or the answer is not finite, the last command
    /// stays; nothing that is not finite or beyond the limit ever comes out.
    pub fn step(&mut self, wanted: MagnetizationDemand, known: StateEstimate) -> Command {
        let numbers = wanted.magnetization_a_per_m.is_finite() && wanted.magnetization_rate_a_per_m_s.is_finite();
        if numbers && (self.structure == Structure::Gain || self.credible(&known)) {
            if let Some(coil) = self.coil.as_mut().filter(|_| known.next_field_a_per_m.is_finite()) {
                self.coil_gain = coil.step(known.next_field_a_per_m);
            }
            let command = match self.structure {
                Structure::FromEstimate => {
                    let model = self.model(&known);
                    let change = known.next_field_a_per_m - known.state.field_a_per_m;
                    let start = self.held(&model, change).advance(known.state, known.next_field_a_per_m);
                    self.invert(&model, start, wanted)
                }
                Structure::OwnMemory => {
                    let start = MagneticState {
                        field_a_per_m: self.last.coil_field_a_per_m,
                        magnetization_a_per_m: self.last.reached_magnetization_a_per_m,
                    };
                    self.invert(&self.model(&known), start, wanted)
                }
                Structure::Gain => self.divide(wanted),
            };
            if command.reached_magnetization_a_per_m.is_finite() && command.field_a_per_m.is_finite() {
                self.last = command;
            }
        }
        self.last
    }

    /// The material as it is estimated.
    fn model(&self, known: &StateEstimate) -> Hysteresis {
        let material = self.hysteresis.with_shape(known.shape_a_per_m);
        known.others.map_or(material, |others| Hysteresis {
            saturation_magnetization_a_per_m: others.saturation_magnetization_a_per_m,
            pinning_a_per_m: others.pinning_a_per_m,
            coupling: others.coupling,
            reversibility: others.reversibility,
            ..material
        })
    }

    fn credible(&self, known: &StateEstimate) -> bool {
        let far = CREDIBLE * self.field_limit_a_per_m;
        let nominal = self.hysteresis.shape_a_per_m;
        known.state.field_a_per_m.abs() <= far
            && known.next_field_a_per_m.abs() <= far
            && known.state.magnetization_a_per_m.abs() <= CREDIBLE * self.hysteresis.saturation_magnetization_a_per_m
            && (nominal / CREDIBLE..=nominal * CREDIBLE).contains(&known.shape_a_per_m)
            && known.others.is_none_or(|others| self.credible_material(&others, known))
    }

    /// Others than `a` do not change by themselves: far from the material's they are no knowledge either.
    fn credible_material(&self, others: &OtherParameters, known: &StateEstimate) -> bool {
        let near = |own: f64, nominal: f64| (nominal / CREDIBLE..=nominal * CREDIBLE).contains(&own);
        let nominal = &self.hysteresis;
        near(
            others.saturation_magnetization_a_per_m,
            nominal.saturation_magnetization_a_per_m,
        ) && near(others.pinning_a_per_m, nominal.pinning_a_per_m)
            && self.model(known).validate().is_ok()
    }

    /// The material while its field changes by this much in a tick, A/m.
    fn held(&self, model: &Hysteresis, change_a_per_m: f64) -> Hysteresis {
        self.pinning
            .map_or(*model, |pinning| model.pinned(pinning.factor(change_a_per_m)))
    }

    fn invert(&mut self, model: &Hysteresis, start: MagneticState, wanted: MagnetizationDemand) -> Command {
        let limit = self.field_limit_a_per_m;
        let bare = self.without_creep(start.magnetization_a_per_m, wanted.magnetization_a_per_m);
        let mut end = self
            .held(model, self.last_change_a_per_m)
            .advance_to_magnetization(start, bare, limit);
        if self.pinning.is_some() {
            for _ in 1..ROUNDS {
                let change = end.state.field_a_per_m - start.field_a_per_m;
                end = self.held(model, change).advance_to_magnetization(start, bare, limit);
            }
            self.last_change_a_per_m = end.state.field_a_per_m - start.field_a_per_m;
        }
        let coil_field = end.state.field_a_per_m;
        let lead = if end.limited {
            0.0
        } else {
            self.lead.step(wanted.magnetization_rate_a_per_m_s, end.slope)
        };
        Command {
            field_a_per_m: (self.coil_gain * (coil_field + lead - self.bias_a_per_m)).clamp(-limit, limit),
            coil_field_a_per_m: coil_field,
            start_magnetization_a_per_m: start.magnetization_a_per_m,
            reached_magnetization_a_per_m: end.state.magnetization_a_per_m,
            limited: end.limited,
        }
    }

    /// M at t_k+2 that makes the wanted one with its creep; `start` is M at t_k+1.
    fn without_creep(&mut self, start_a_per_m: f64, wanted_a_per_m: f64) -> f64 {
        let Some(creep) = &mut self.creep else {
            return wanted_a_per_m;
        };
        creep.step(start_a_per_m);
        creep.inverse(wanted_a_per_m)
    }

    fn divide(&mut self, wanted: MagnetizationDemand) -> Command {
        let limit = self.field_limit_a_per_m;
        let bare = self.without_creep(self.last.reached_magnetization_a_per_m, wanted.magnetization_a_per_m);
        let asked = bare / self.susceptibility;
        let coil_field = asked.clamp(-limit, limit);
        let lead = self.lead.step(wanted.magnetization_rate_a_per_m_s, self.susceptibility);
        Command {
            field_a_per_m: (self.coil_gain * (coil_field + lead - self.bias_a_per_m)).clamp(-limit, limit),
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
