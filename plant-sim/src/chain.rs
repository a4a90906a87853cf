//! Coil, material and two-pole rod with physical effects in them: the chain of the model library in place of the plain
//! plant.
//!
//! The amplifier's token is the chain's command, so that effects of the amplifier's stage act between that token and
//! the coil. a(t) and, with `heating`, the rod's temperature come from the plant; without it thermal effects reckon
//! their own. Between ticks M is taken by its mean, not as a straight line as in the plain plant: 1 A/m of it is 0.2
//! nm. Equations, assumptions and sources: `anhyst_model::actuator`.

use anhyst_ipc::Invalid;
use anhyst_model::{
    Actuator, ActuatorInput, ActuatorModel, AmplifierConstants, Effect, EffectKind, Material, RodConstants,
    RodElements, RodState, TwoPole,
};
use serde::{Deserialize, Serialize};

use crate::{PlantError, PlantRod, PlantSettings, ShapeCourse, TWO_POLE_ELEMENTS};

/// What came of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reached {
    /// What the displacement sensor sees, before its noise, m.
    pub sensed_m: f64,
    /// In the coil, A/m.
    pub coil_field_a_per_m: f64,
    /// With its creep, A/m.
    pub magnetization_a_per_m: f64,
    /// The true one, A/m.
    pub shape_a_per_m: f64,
    /// Of the rod, K.
    pub temperature_k: f64,
}

/// The chain in motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Chain {
    actuator: Actuator,
    heated: bool,
}

impl Chain {
    /// Settled at zero field, and what it shows then. None where the plant is a plain one.
    pub fn new(
        settings: &PlantSettings,
        material: &Material,
        rod: &RodConstants,
        tick_s: f64,
    ) -> Result<Option<(Self, Reached)>, PlantError> {
        let effects = settings.effects.clone().unwrap_or_default();
        if effects.is_empty() && settings.two_pole.is_none() {
            return Ok(None);
        }
        validate(settings)?;
        let model = ActuatorModel {
            name: material.name.clone(),
            source: material.source.clone(),
            amplifier: AmplifierConstants::default(),
            material: material.clone(),
            rod: Some(two_pole(settings, material, rod)?),
            coil: true,
            effects,
            ambient_temperature_k: settings.start_temperature_k,
        };
        let mut chain = Chain {
            actuator: Actuator::new(&model, tick_s)?,
            heated: settings.heating.is_some(),
        };
        let temperature_k = settings.start_temperature_k;
        let shape_a_per_m = settings.shape.shape_a_per_m(0.0, temperature_k);
        let reached = chain.advance(0.0, shape_a_per_m, temperature_k, 0.0);
        Ok(Some((chain, reached)))
    }

    /// Goes on by one tick. `temperature_k` is used where the plant reckons it; the force acts on the tip, N.
    pub fn advance(&mut self, field_to_a_per_m: f64, shape_a_per_m: f64, temperature_k: f64, force_n: f64) -> Reached {
        let measured_k = self.heated.then_some(temperature_k);
        self.actuator.set_shape_a_per_m(shape_a_per_m);
        let output = self.actuator.step(ActuatorInput {
            temperature_k: measured_k,
            force_n,
            ..ActuatorInput::command(field_to_a_per_m)
        });
        Reached {
            sensed_m: output.displacement_m,
            coil_field_a_per_m: output.field_a_per_m,
            magnetization_a_per_m: output.magnetization_a_per_m,
            shape_a_per_m: self.actuator.shape_a_per_m(measured_k),
            temperature_k: output.temperature_k,
        }
    }

    /// The tip itself.
    pub fn tip(&self) -> RodState {
        self.actuator.tip()
    }
}

/// The rod of the settings, or the constants' reduced for this material; its gain is per magnetization.
fn two_pole(settings: &PlantSettings, material: &Material, rod: &RodConstants) -> Result<TwoPole, PlantError> {
    if let Some(two_pole) = settings.two_pole {
        return Ok(two_pole);
    }
    let slope = 1.0 / anhyst_model::rod_per_strain(UNIT_GAIN, material).gain;
    Ok(RodElements::assemble(rod, TWO_POLE_ELEMENTS)?.two_pole(slope))
}

/// A rod whose gain per strain is 1/λ′.
const UNIT_GAIN: TwoPole = TwoPole {
    gain: 1.0,
    damping_per_s: 0.0,
    stiffness_per_s2: 1.0,
    force_gain_per_kg: 0.0,
};

/// What only the plain plant has.
fn validate(settings: &PlantSettings) -> Result<(), Invalid> {
    if settings.rod != PlantRod::TwoPole {
        let sentence = "a plant with effects or with a two_pole of its own has a rod of two poles: leave Elements out";
        return Err(Invalid::new("rod", sentence));
    }
    let drifts = |effects: &Vec<Effect>| effects.iter().any(|effect| effect.kind() == EffectKind::ThermalDrift);
    if matches!(settings.shape, ShapeCourse::Thermal { .. }) && settings.effects.as_ref().is_some_and(drifts) {
        let sentence = "Thermal and the effect ThermalDrift both make `a` follow the temperature: keep one of them";
        return Err(Invalid::new("shape", sentence));
    }
    if settings.expansion.is_some() {
        let sentence = "a plant with effects expands by the effect ThermalExpansion: give that in its place";
        return Err(Invalid::new("expansion", sentence));
    }
    Ok(())
}
