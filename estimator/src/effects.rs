//! Effects that the estimator knows of, around the bank: field path before it, creep and expansion behind it, sensor
//! behind the rods.
//!
//! H in the coil → H in the material drives every member; M_j → M_j with creep; + strain by warming; y_j → what the
//! sensor would say of it. So measured and predicted displacement have gone the same way, and what is left of their
//! difference is `a`. A delay d of the loop moves everything behind the command: the bank is kept d ahead of time, at
//! what is already commanded, and its outputs are delayed by d instead. Nothing but the material's state reaches
//! forward. Rounding of the sensor is not imitated: it would hide what its noise lets through.
//! Equations and sources: `anhyst_model::effects`.

use crate::coil_field::FieldKnowledge;
use crate::{EstimatorError, EstimatorSettings, FieldSource, LawSettings};
use anhyst_ipc::Invalid;
use anhyst_model::{Effect, EffectKind, Expansion, FieldPath, PinningGrowth, SignalPath, Stage};
use serde::{Deserialize, Serialize};

/// The known effects in motion, one path for every member where members differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KnownEffects {
    field: FieldPath,
    next_field_a_per_m: f64,
    pinning: Option<PinningGrowth>,
    /// The field at which the bank stands; none before the first.
    last_field_a_per_m: Option<f64>,
    creeps: Vec<SignalPath>,
    magnetizations: Vec<f64>,
    expansion: Option<Expansion>,
    /// Columns that are values; the others are derivatives of the first.
    values: usize,
    sensors: Vec<SignalPath>,
    displacements_m: Vec<f64>,
}

impl KnownEffects {
    /// For so many columns, and how many of them are values: the others are its derivatives, which only what is linear carries. None where nothing is known.
    ///
    /// # Errors
    /// An effect that field source or law cannot go with, or that cannot be built for this tick.
    pub fn new(
        effects: &[Effect],
        settings: &EstimatorSettings,
        (columns, values): (usize, usize),
        tick_s: f64,
    ) -> Result<Option<Box<Self>>, EstimatorError> {
        if effects.is_empty() {
            return Ok(None);
        }
        let seen = seen_by_the_sensor(effects)?;
        let each = |effects: &[Effect], stage| -> Result<Vec<SignalPath>, EstimatorError> {
            let path = SignalPath::new(effects, stage, tick_s)?;
            let count = if path.is_empty() { 0 } else { columns };
            Ok(vec![path; count])
        };
        let mut sensors = each(&seen, Stage::Sensor)?;
        if values < sensors.len() {
            let linear: Vec<Effect> = seen.iter().filter(|own| is_linear(own.kind())).copied().collect();
            let path = SignalPath::new(&linear, Stage::Sensor, tick_s)?;
            sensors[values..].fill(path);
        }
        let known = KnownEffects {
            field: FieldPath::new(effects, tick_s)?,
            next_field_a_per_m: 0.0,
            pinning: PinningGrowth::new(effects, tick_s),
            last_field_a_per_m: None,
            creeps: each(effects, Stage::Magnetization)?,
            magnetizations: vec![0.0; columns],
            expansion: Expansion::new(effects, tick_s),
            values,
            sensors,
            displacements_m: vec![0.0; columns],
        };
        known.validate(effects, settings)?;
        Ok(Some(Box::new(known)))
    }

    fn validate(&self, effects: &[Effect], settings: &EstimatorSettings) -> Result<(), Invalid> {
        let delayed = effects.iter().any(|effect| effect.kind() == EffectKind::LoopDelay);
        if matches!(settings.field, FieldSource::Measured { .. }) && (delayed || !self.field.is_empty()) {
            let sentence = "effects on the field are computed from the command; with them field must be Commanded";
            return Err(Invalid::new("field", sentence));
        }
        if matches!(settings.law, LawSettings::Matrix(_)) && !self.sensors.is_empty() {
            let sentence =
                "Matrix drives a rod of its own, which does not know the effects of the sensor; take Folded with them";
            return Err(Invalid::new("law", sentence));
        }
        Ok(())
    }

    /// The field in the material at t_k and t_k+1 from that in the coil.
    pub fn within(&mut self, tick: u64, coil: FieldKnowledge) -> FieldKnowledge {
        if tick == 0 {
            self.next_field_a_per_m = self.field.step(coil.now_a_per_m);
        }
        let now_a_per_m = self.next_field_a_per_m;
        self.next_field_a_per_m = self.field.step(coil.next_a_per_m);
        FieldKnowledge {
            now_a_per_m,
            next_a_per_m: self.next_field_a_per_m,
        }
    }

    /// k over its quasi-static value on the way to this field in the material.
    pub fn pinning_factor(&mut self, field_a_per_m: f64) -> f64 {
        let last = self.last_field_a_per_m.replace(field_a_per_m);
        let change = last.map(|last| field_a_per_m - last);
        change
            .zip(self.pinning)
            .map_or(1.0, |(change, pinning)| pinning.factor(change))
    }

    /// M with creep, for every member.
    pub fn crept<'a>(&'a mut self, magnetizations: &'a [f64]) -> &'a [f64] {
        if self.creeps.is_empty() {
            return magnetizations;
        }
        let all = self.creeps.iter_mut().zip(&mut self.magnetizations).zip(magnetizations);
        for ((creep, crept), magnetization) in all {
            *crept = creep.step(*magnetization);
        }
        &self.magnetizations
    }

    /// Adds the strain by warming, the same for every value.
    pub fn expand(&mut self, coil_field_a_per_m: f64, strains: &mut [f64]) {
        if let Some(expansion) = &mut self.expansion {
            let warm = expansion.step(coil_field_a_per_m);
            strains[..self.values].iter_mut().for_each(|strain| *strain += warm);
        }
    }

    /// What the sensor would say of each member's tip.
    pub fn sensed<'a>(&'a mut self, displacements_m: &'a [f64]) -> &'a [f64] {
        if self.sensors.is_empty() {
            return displacements_m;
        }
        let all = self
            .sensors
            .iter_mut()
            .zip(&mut self.displacements_m)
            .zip(displacements_m);
        for ((sensor, sensed), displacement) in all {
            *sensed = sensor.step(*displacement);
        }
        &self.displacements_m
    }
}

/// A sum of outputs is the output of the sum.
fn is_linear(kind: EffectKind) -> bool {
    matches!(
        kind,
        EffectKind::SecondMode | EffectKind::SensorDelay | EffectKind::SensorGain
    )
}

/// What lies between a member's tip and the measurement: the sensor's effects, and a delay of the loop in place of its
/// own.
fn seen_by_the_sensor(effects: &[Effect]) -> Result<Vec<Effect>, EstimatorError> {
    let mut seen = Vec::new();
    for effect in effects {
        match effect.kind() {
            EffectKind::LoopDelay => seen.push(Effect::new(EffectKind::SensorDelay, &[effect.values()[0], 1.0])?),
            EffectKind::Quantisation => {}
            kind if kind.stage() == Stage::Sensor => seen.push(*effect),
            _ => {}
        }
    }
    Ok(seen)
}
