//! The inverse of another hysteresis law than the domain wall's: the input at t_k+2 for which its output is the demanded one.
//!
//! It keeps the law's state itself, for a state of many plays or cells is in no token: the input that was really given (the safe
//! field through the amplifier, as the estimator says; the safe field alone where it must not be believed) brings it to t_k+1, a tick
//! passes for its creep, and [`HysteresisLaw::input_for`] finds the input. Its weights come one a tick from the estimator and are
//! approached within some milliseconds, so that neither a new weight nor a fall back to the material's own makes a jump.
//! Demand and output count from rest. Source: `anhyst_model::law`; the lead of `lead.rs`.

use crate::lead::Lead;
use crate::{Command, InverseError, InverseSettings, MagnetizationDemand, Structure};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, NodeId, Now, Previous, SafeField};
use anhyst_model::{AmplifierConstants, HysteresisLaw, LawModel, LawModelState, MaterialLaw, SlowLag};
use serde::{Deserialize, Serialize};

/// Weights go to what they are told to be within this time, 1/e of the way.
const APPROACH_S: f64 = 5e-3;
/// Inputs beyond this multiple of the limit are no knowledge.
const CREDIBLE: f64 = 10.0;

/// The inverse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawInverse {
    structure: Structure,
    law: LawModel,
    /// At t_k+1, with the time to t_k+2 passed.
    state: LawModelState,
    zero: f64,
    /// The material's own weights, those that the estimator tells, and those at work.
    nominal: Vec<f64>,
    told: Vec<f64>,
    weights: Vec<f64>,
    /// Of the way, in a tick.
    share: f64,
    tick_s: f64,
    limit: f64,
    /// Of the input's extent, for [`Structure::Gain`].
    slope: f64,
    lead: Lead,
    last: Command,
}

impl LawInverse {
    /// At rest; `guard_limit` is the limit where the settings give none, in the input's unit, ticks of `tick_s`.
    ///
    /// # Errors
    /// A setting or a constant that cannot be used.
    pub fn new(
        settings: &InverseSettings,
        of: &MaterialLaw,
        amplifier: &AmplifierConstants,
        guard_limit: f64,
        tick_s: f64,
    ) -> Result<Self, InverseError> {
        settings.validate()?;
        amplifier.validate()?;
        let law = LawModel {
            offset: 0.0,
            ..of.model.clone()
        };
        law.validate()?;
        let limit = settings.field_limit_a_per_m.unwrap_or(guard_limit);
        let lag_s = if settings.compensate_amplifier {
            amplifier.lag_s()
        } else {
            0.0
        };
        let weights = law.weights();
        let [low, high] = of.reach();
        let state = law.rest();
        Ok(Self {
            structure: settings.structure,
            zero: law.output(&state),
            state,
            nominal: weights.clone(),
            told: weights.clone(),
            weights,
            law,
            share: SlowLag::share_in(APPROACH_S, tick_s),
            tick_s,
            limit,
            slope: (high - low) / (of.input_extent[1] - of.input_extent[0]),
            lead: Lead::series([lag_s, 0.0], limit, tick_s),
            last: Command::default(),
        })
    }

    /// Hears of one weight; what is none, or below 0, is not believed. The zero of the output is nobody's here.
    fn hear(&mut self, index: u64, value: f64) {
        let own = usize::try_from(index).ok().filter(|index| *index > 0);
        if let Some(told) = own.and_then(|index| self.told.get_mut(index))
            && (0.0..f64::MAX).contains(&value)
        {
            *told = value;
        }
    }

    fn approach(&mut self, fall_back: bool) {
        let to = if fall_back { &self.nominal } else { &self.told };
        if self.weights == *to {
            return;
        }
        for (own, to) in self.weights.iter_mut().zip(to) {
            let way = to - *own;
            // The last of it at once: it would be halved for ever.
            *own = if way.abs() <= 1e-12 * to.abs() {
                *to
            } else {
                *own + self.share * way
            };
        }
        self.law.set_weights(&self.weights);
        // Some laws keep sums of what they weigh.
        self.law.reweigh(&mut self.state);
    }

    /// The command for t_k+2; `given` is the input at t_k+1. What is not a number leaves the last command.
    pub fn step(&mut self, wanted: MagnetizationDemand, given: f64, fall_back: bool) -> Command {
        self.approach(fall_back);
        if given.abs() <= CREDIBLE * self.limit {
            self.law.advance(&mut self.state, given);
        }
        let start = self.law.output(&self.state) - self.zero;
        self.law.pass(&mut self.state, self.tick_s);
        if !(wanted.magnetization_a_per_m.is_finite() && wanted.magnetization_rate_a_per_m_s.is_finite()) {
            return self.last;
        }
        let (input, reached, slope, output) = match self.structure {
            Structure::Gain => {
                let asked = wanted.magnetization_a_per_m / self.slope;
                let input = asked.clamp(-self.limit, self.limit);
                (input, input == asked, self.slope, self.slope * input)
            }
            _ => {
                let to = wanted.magnetization_a_per_m + self.zero;
                let (input, reached) = self.law.input_for(&self.state, to, self.limit);
                let (output, slope) = self.law.ahead(&self.state, input);
                (input, reached, slope, output - self.zero)
            }
        };
        let lead = if reached {
            self.lead.step(wanted.magnetization_rate_a_per_m_s, slope)
        } else {
            0.0
        };
        let command = Command {
            field_a_per_m: (input + lead).clamp(-self.limit, self.limit),
            coil_field_a_per_m: input,
            start_magnetization_a_per_m: start,
            reached_magnetization_a_per_m: output,
            limited: !reached,
        };
        if command.field_a_per_m.is_finite() && command.reached_magnetization_a_per_m.is_finite() {
            self.last = command;
        }
        self.last
    }
}

impl Block for LawInverse {
    const NODE: NodeId = NodeId::Inverse;
    type Inputs = (Now<Demand>, Now<Estimate>, Previous<SafeField>);
    type Outputs = (FieldCommand,);

    fn step(&mut self, _: u64, (Now(demand), Now(estimate), Previous(safe)): Self::Inputs) -> Self::Outputs {
        let wanted = MagnetizationDemand {
            magnetization_a_per_m: demand.magnetization_a_per_m,
            magnetization_rate_a_per_m_s: demand.magnetization_rate_a_per_m_s,
        };
        let fall_back = safe.status & SafeField::FALL_BACK != 0;
        self.hear(estimate.weight_index, estimate.weight);
        let given = match self.structure {
            Structure::OwnMemory => self.last.coil_field_a_per_m,
            _ if fall_back || !estimate.next_field_a_per_m.is_finite() => safe.field_a_per_m,
            _ => estimate.next_field_a_per_m,
        };
        (crate::node::field_command(
            LawInverse::step(self, wanted, given, fall_back),
            fall_back,
        ),)
    }

    /// As [`crate::Inverse`]: the material goes on, the answer was not given.
    fn follow(&mut self, tick: u64, inputs: Self::Inputs) {
        let last = self.last;
        Block::step(self, tick, inputs);
        self.last = last;
    }
}
