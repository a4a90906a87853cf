//! Parts of the chain that stand alone: what a controller's side needs to reckon with effects it knows of.
//!
//! A [`FieldPath`] leads from the coil's field to that in the material, a [`SignalPath`] from M to M with creep or
//! from the tip to what the sensor says, [`Creep`] has the inverse of one, [`Expansion`] is the strain by warming,
//! [`CoilGain`] what a warm coil must be asked for, [`PinningGrowth`] how a fast field is held, [`OwnForces`] the
//! forces of a rod that is not linear. All begin settled at
//! their first sample, allocate nothing afterwards, and are the code that the whole chain runs.
//! Left out of a field's path is a pure delay: it shifts everything that follows, and its user shifts time instead.

use serde::{Deserialize, Serialize};

use super::fields::Fields;
use super::nonlinear_rod::NonlinearRod;
use super::rod::Load;
use super::signals::Signals;
use crate::effects::after_effect::AfterEffect;
use crate::effects::coil_heating::COPPER_PER_K;
use crate::effects::excess_loss::ExcessLoss;
use crate::effects::intersample_field::IntersampleField;
use crate::effects::signal::Signal;
use crate::effects::thermal_expansion;
use crate::effects::warming::Warming;
use crate::{ActuatorModel, Effect, EffectKind, Material, ModelError, RodState, Stage, TwoPole};

/// Field that the nominal amplifier gives → field in the material, both A/m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FieldPath {
    amplifier: Fields,
    field: Fields,
    input_a_per_m: f64,
    begun: bool,
}

impl FieldPath {
    /// Of the effects of amplifier and field among `effects`, for samples `tick_s` apart.
    ///
    /// # Errors
    /// A tick that an effect cannot work with.
    pub fn new(effects: &[Effect], tick_s: f64) -> Result<Self, ModelError> {
        let without_delay: Vec<Effect> = effects
            .iter()
            .filter(|effect| effect.kind() != EffectKind::LoopDelay)
            .copied()
            .collect();
        Ok(FieldPath {
            amplifier: Fields::of(&without_delay, Stage::Amplifier, tick_s)?,
            field: Fields::of(&without_delay, Stage::Field, tick_s)?,
            input_a_per_m: 0.0,
            begun: false,
        })
    }

    /// Nothing stands between coil and material.
    pub fn is_empty(&self) -> bool {
        self.amplifier.is_empty() && self.field.is_empty()
    }

    /// The field in the material at the end of a tick in which the input goes straight to `field_a_per_m`.
    pub fn step(&mut self, field_a_per_m: f64) -> f64 {
        if !self.begun {
            self.begun = true;
            self.input_a_per_m = field_a_per_m;
            let in_coil = self.amplifier.steady_state(field_a_per_m);
            return self.field.steady_state(in_coil);
        }
        let (mut intersample, mut spare) = (IntersampleField::empty(), IntersampleField::empty());
        intersample.set_straight(self.input_a_per_m, field_a_per_m);
        self.input_a_per_m = field_a_per_m;
        self.amplifier.follow(&mut intersample, &mut spare);
        self.field.follow(&mut intersample, &mut spare);
        intersample.end()
    }
}

/// All effects of one stage that are a number in and a number out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignalPath {
    signals: Signals,
    begun: bool,
}

impl SignalPath {
    /// Of those among `effects` that belong to the stage; of another stage than the magnetization's and the sensor's
    /// it is empty.
    ///
    /// # Errors
    /// A delay of too many ticks.
    pub fn new(effects: &[Effect], stage: Stage, tick_s: f64) -> Result<Self, ModelError> {
        Ok(SignalPath {
            signals: Signals::of(effects, stage, tick_s)?,
            begun: false,
        })
    }

    /// Nothing happens on it.
    pub fn is_empty(&self) -> bool {
        self.signals.is_empty()
    }

    /// Takes the next sample.
    pub fn step(&mut self, sample: f64) -> f64 {
        let mut samples = [sample];
        self.signals.pass(!self.begun, &mut samples);
        self.begun = true;
        samples[0]
    }
}

/// The after-effect with its inverse: M without creep ↔ M with it, A/m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Creep {
    after_effect: AfterEffect,
    begun: bool,
}

impl Creep {
    /// None where `effects` have no after-effect.
    ///
    /// # Errors
    /// A tick that it cannot work with.
    pub fn new(effects: &[Effect], tick_s: f64) -> Result<Option<Self>, ModelError> {
        let known = effects.iter().find(|effect| effect.kind() == EffectKind::AfterEffect);
        known
            .map(|effect| {
                Ok(Creep {
                    after_effect: AfterEffect::new(effect.values(), tick_s)?,
                    begun: false,
                })
            })
            .transpose()
    }

    /// Takes a sample of M and gives M with creep.
    pub fn step(&mut self, magnetization_a_per_m: f64) -> f64 {
        if self.begun {
            return self.after_effect.step(magnetization_a_per_m);
        }
        self.begun = true;
        self.after_effect.steady_state(magnetization_a_per_m)
    }

    /// The M that, taken as the next sample, gives `wanted` with creep.
    pub fn inverse(&self, wanted_a_per_m: f64) -> f64 {
        self.after_effect.inverse(wanted_a_per_m)
    }
}

/// Strain by warming, reckoned from the coil's field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Expansion {
    expansion: thermal_expansion::ThermalExpansion,
    begun: bool,
}

impl Expansion {
    /// None where `effects` have no thermal expansion.
    pub fn new(effects: &[Effect], tick_s: f64) -> Option<Self> {
        let known = effects
            .iter()
            .find(|effect| effect.kind() == EffectKind::ThermalExpansion);
        known.map(|effect| Expansion {
            expansion: thermal_expansion::ThermalExpansion::new(effect.values(), tick_s),
            begun: false,
        })
    }

    /// Takes a sample of the coil's field (A/m) and gives the strain since the first.
    pub fn step(&mut self, coil_field_a_per_m: f64) -> f64 {
        let warming = &mut self.expansion.warming;
        if !self.begun {
            self.begun = true;
            warming.steady_state(coil_field_a_per_m);
            return 0.0;
        }
        self.expansion.expansion_per_k * warming.step(coil_field_a_per_m)
    }
}

/// By how much more a warm coil must be asked for under voltage drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoilGain {
    warming: Warming,
    begun: bool,
}

impl CoilGain {
    /// None where `effects` have no heating of the coil.
    pub fn new(effects: &[Effect], tick_s: f64) -> Option<Self> {
        let known = effects.iter().find(|effect| effect.kind() == EffectKind::CoilHeating)?;
        Some(CoilGain {
            warming: Warming::of([known.values()[0], known.values()[1], known.values()[2]], tick_s),
            begun: false,
        })
    }

    /// Takes a sample of the coil's field (A/m) and gives command over field, no unit.
    pub fn step(&mut self, coil_field_a_per_m: f64) -> f64 {
        if !self.begun {
            self.begun = true;
            self.warming.steady_state(coil_field_a_per_m);
        } else {
            self.warming.step(coil_field_a_per_m);
        }
        1.0 + COPPER_PER_K * self.warming.rise_k()
    }
}

/// By how much a field that changes raises the pinning.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PinningGrowth(ExcessLoss);

impl PinningGrowth {
    /// None where `effects` have no excess loss.
    pub fn new(effects: &[Effect], tick_s: f64) -> Option<Self> {
        let known = effects.iter().find(|effect| effect.kind() == EffectKind::ExcessLoss)?;
        Some(PinningGrowth(ExcessLoss::new(known.values(), tick_s)))
    }

    /// k over its quasi-static value while the field in the material changes by this much in a tick, A/m.
    pub fn factor(&self, change_a_per_m: f64) -> f64 {
        self.0.pinning_factor(change_a_per_m)
    }
}

/// Forces of a known rod's own: what delta_e, a load that stiffens and friction take of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnForces(NonlinearRod);

impl OwnForces {
    /// None where `effects` have no such force. The gain of `rod` is per strain.
    ///
    /// # Errors
    /// A rod that is too fast for the tick.
    pub fn new(effects: &[Effect], material: &Material, rod: TwoPole, tick_s: f64) -> Result<Option<Self>, ModelError> {
        let model = ActuatorModel {
            material: material.clone(),
            effects: effects.to_vec(),
            ..ActuatorModel::terfenol_d()
        };
        let rod = NonlinearRod::new(&model, rod, tick_s)?;
        Ok(rod.has_own_forces().then_some(OwnForces(rod)))
    }

    /// Moves the rod by a tick, at whose end this is its free strain and its magnetization (A/m), and gives N there, m/s².
    pub fn under(&mut self, strain: f64, magnetization_a_per_m: f64) -> f64 {
        let load = Load {
            first: false,
            strain: &[strain],
            mean_excess: &[0.0],
            magnetization: &[magnetization_a_per_m],
            force: None,
        };
        self.0.step(&load, 0);
        self.0.own_acceleration()
    }

    /// What they take (m of quasi-static displacement) of a motion that is given, with this acceleration (m/s²) and magnetization (A/m).
    pub fn along_m(&self, state: RodState, acceleration: f64, magnetization_a_per_m: f64) -> f64 {
        -self.0.own_along(state, acceleration, magnetization_a_per_m) / self.0.stiffness_per_s2()
    }

    /// Stands there on a motion that is given.
    pub fn follow(&mut self, state: RodState) {
        self.0.follow(state);
    }
}
