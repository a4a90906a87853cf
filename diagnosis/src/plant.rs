//! The actuator chain as the engine sees it: runs in, stacked outputs out.
//!
//! A run is driven by its command through the amplifier's model; where only a measured field exists, by that field
//! through a play of 3σ: a noisy field would ratchet a rate-independent model. A run without time is a sweep through states
//! of rest; unless its first magnetization was measured, the sweep is run twice and the second time counts.

use anhyst_model::{
    Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs, Drive, Effect, MagneticState, ModelError,
};

use crate::system::{Channel, ChannelKind, Setting, Signals, System};
use crate::term::Term;

/// What drives the model in one run.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunInputs {
    /// Command, or measured field made fit for the model, A/m.
    pub drive_a_per_m: Vec<f64>,
    pub drive: Drive,
    /// None for a sweep without time.
    pub tick_s: Option<f64>,
    pub temperature_k: Option<Vec<f64>>,
    pub force_n: Option<Vec<f64>>,
    /// Where the material was at the first sample, if that was measured; otherwise demagnetised.
    pub start: Option<MagneticState>,
    /// The actuator rested without drive before the first sample, which already has one.
    pub from_rest: bool,
}

/// A nominal model and the runs that it has to explain.
pub(crate) struct Plant {
    pub model: ActuatorModel,
    pub runs: Vec<RunInputs>,
    pub channels: Vec<Channel>,
}

/// The model under a set of terms.
pub(crate) fn amended(model: &ActuatorModel, settings: &[Setting]) -> Result<ActuatorModel, ModelError> {
    let mut amended = model.clone();
    for setting in settings {
        match setting.term {
            Term::Effect(kind) => {
                let mut effect = model.effect(kind).copied().unwrap_or_else(|| Effect::typical(kind));
                for ((index, _), value) in Term::fitted(kind).zip(&setting.values) {
                    effect.values_mut()[index] = *value;
                }
                effect.validate()?;
                amended = amended.with_effect(effect);
            }
            Term::Parameter(parameter) => {
                if let Some(value) = setting.values.first() {
                    parameter.set(&mut amended, *value);
                }
            }
        }
    }
    amended.validate()?;
    Ok(amended)
}

impl RunInputs {
    fn inputs(&self) -> ActuatorInputs<'_> {
        ActuatorInputs {
            drive_a_per_m: &self.drive_a_per_m,
            drive: self.drive,
            temperature_k: self.temperature_k.as_deref(),
            force_n: self.force_n.as_deref(),
        }
    }

    pub fn simulate(&self, model: &ActuatorModel) -> Result<ActuatorOutputs, ModelError> {
        let mut outputs = ActuatorOutputs::default();
        let mut actuator = match self.tick_s {
            Some(tick_s) if self.from_rest => {
                let mut actuator = Actuator::new(model, tick_s)?;
                actuator.step(ActuatorInput {
                    drive: self.drive,
                    temperature_k: self.temperature_k.as_ref().map(|column| column[0]),
                    ..ActuatorInput::command(0.0)
                });
                actuator
            }
            Some(tick_s) => Actuator::new(model, tick_s)?,
            None => Actuator::quasi_static(model)?,
        };
        if let Some(start) = self.start {
            actuator = actuator.starting_at(start);
        } else if self.tick_s.is_none() {
            actuator.run(self.inputs(), &mut outputs)?;
            let end = actuator.magnetic_state();
            actuator = Actuator::quasi_static(model)?.starting_at(end);
        }
        actuator.run(self.inputs(), &mut outputs)?;
        Ok(outputs)
    }
}

impl Plant {
    fn simulate(&self, settings: &[Setting]) -> Option<Vec<ActuatorOutputs>> {
        let model = amended(&self.model, settings).ok()?;
        self.runs.iter().map(|run| run.simulate(&model).ok()).collect()
    }
}

impl System for Plant {
    fn outputs(&self, settings: &[Setting]) -> Option<Vec<f64>> {
        let runs = self.simulate(settings)?;
        let with_rod = self.model.rod.is_some();
        let length = self.channels.last().map_or(0, |channel| channel.rows.end);
        let mut outputs = Vec::with_capacity(length);
        for channel in &self.channels {
            let run = &runs[channel.run];
            outputs.extend_from_slice(match channel.kind {
                ChannelKind::Field => &run.field_a_per_m,
                ChannelKind::Output if with_rod => &run.displacement_m,
                // Without a rod the sensor's end is that of a bar one metre long.
                ChannelKind::Output => &run.displacement_m,
                ChannelKind::Magnetization => &run.magnetization_a_per_m,
            });
        }
        outputs.iter().all(|value| value.is_finite()).then_some(outputs)
    }

    fn signals(&self, settings: &[Setting]) -> Option<Vec<Signals>> {
        let runs = self.simulate(settings)?;
        let signals = runs.into_iter().zip(&self.runs).map(|(outputs, run)| Signals {
            drive: run.drive_a_per_m.clone(),
            field: outputs.field_a_per_m,
            magnetization: outputs.magnetization_a_per_m,
            output: outputs.displacement_m,
            tick_s: run.tick_s,
            temperature: run.temperature_k.as_ref().map(|_| outputs.temperature_k),
        });
        Some(signals.collect())
    }
}
