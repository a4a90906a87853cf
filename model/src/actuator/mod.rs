//! The actuator as a chain: command → coil field H → field in the material → M → free strain λ → tip u → what the sensor says y.
//!
//! ü + k̂ u̇ + ĉ u = w λ(M)/λ′ + f F, with λ′ the strain law's slope at M = 0 (at Ms/2 for an even law): for a linear law w M.
//! H and F are straight lines between samples; lags and the rod are propagated exactly. Effects join where
//! [`crate::Stage`] says, in the order of [`EffectKind::ALL`]; one that is not there costs nothing in a run.
//! Without a rod the tip is that of a free bar one metre long: y is the strain.
//! [`ActuatorModel`] is immutable and is what a file holds; [`Actuator`] holds the state. Source: the paper's (1)-(13).

mod chain;
mod fields;
mod magnetizer;
mod nonlinear_rod;
mod parts;
mod restated;
mod rod_stage;
mod samples;
mod signals;
mod strain;

use serde::{Deserialize, Serialize};

pub use chain::{Actuator, simulate};
pub use parts::{CoilGain, Creep, Expansion, FieldPath, SignalPath, Spring};
pub use restated::{rod_per_magnetization, rod_per_strain, with_known_effects};
pub use rod_stage::ActuatorRod;
pub use samples::{ActuatorInput, ActuatorInputs, ActuatorOutput, ActuatorOutputs, Drive};

use crate::effects::prestress::under_prestress;
use crate::error::require_positive;
use crate::{AmplifierConstants, Effect, EffectKind, Material, ModelError, TwoPole};

/// Everything that is known about an actuator: the nominal chain and the effects found in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorModel {
    /// What to call it.
    pub name: String,
    /// Publication, data sheet or measured file that the numbers come from.
    pub source: String,
    /// Nominal amplifier, without the tick that a loop's computing takes: the command of t_k is the field at t_k.
    #[serde(default)]
    pub amplifier: AmplifierConstants,
    /// Hysteresis and strain law, at the ambient temperature.
    pub material: Material,
    /// The rod; none: the output is the strain.
    #[serde(default)]
    pub rod: Option<TwoPole>,
    /// Whether a coil's current makes the field. A piezo stack has none: without a coil a diagnosis seeks no effect that
    /// [`EffectKind::needs_coil`].
    #[serde(default = "with_coil")]
    pub coil: bool,
    /// At most one of each kind; their order here does not matter.
    #[serde(default)]
    pub effects: Vec<Effect>,
    /// Temperature of the surroundings, to which the material's numbers belong, K.
    #[serde(default = "room_temperature_k")]
    pub ambient_temperature_k: f64,
}

fn room_temperature_k() -> f64 {
    293.0
}

fn with_coil() -> bool {
    true
}

impl ActuatorModel {
    /// The paper's actuator: its Terfenol-D and the rod of its (13), without force at the tip.
    pub fn terfenol_d() -> Self {
        ActuatorModel {
            name: String::from("Terfenol-D actuator"),
            source: String::from("Nealis and Smith, section 5 and (13)"),
            amplifier: AmplifierConstants::default(),
            material: Material::terfenol_d(),
            rod: Some(TwoPole {
                gain: 1.3724e-2,
                damping_per_s: 7889.9,
                stiffness_per_s2: 6.4251e7,
                force_gain_per_kg: 0.0,
            }),
            coil: with_coil(),
            effects: Vec::new(),
            ambient_temperature_k: room_temperature_k(),
        }
    }

    /// The effect of that kind, where the model has it.
    pub fn effect(&self, kind: EffectKind) -> Option<&Effect> {
        self.effects.iter().find(|effect| effect.kind() == kind)
    }

    /// The same with this effect, in place of one of its kind.
    pub fn with_effect(mut self, effect: Effect) -> Self {
        match self.effects.iter_mut().find(|own| own.kind() == effect.kind()) {
            Some(own) => *own = effect,
            None => self.effects.push(effect),
        }
        self
    }

    /// Checks every part, and that parts and effects go together.
    ///
    /// # Errors
    /// The first quantity out of its range; an effect that stands twice or lacks its rod.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.validate_with(self.actuator_rod().as_ref())
    }

    fn validate_with(&self, rod: Option<&ActuatorRod>) -> Result<(), ModelError> {
        self.amplifier.validate()?;
        self.material.validate()?;
        require_positive(self.ambient_temperature_k, "ambient temperature", "K")?;
        if let Some(ActuatorRod::TwoPole(two_pole)) = rod {
            two_pole.validate()?;
        }
        validate_effects(&self.effects, &self.material, rod.is_some())
    }

    /// Its rod as the free strain of its material drives it.
    pub(crate) fn actuator_rod(&self) -> Option<ActuatorRod> {
        self.rod
            .map(|rod| ActuatorRod::TwoPole(rod_per_strain(rod, &self.material)))
    }
}

/// Checks effects, and that they go together with a material and with or without a rod.
///
/// # Errors
/// The first value out of its bounds; an effect that stands twice or lacks its rod.
pub fn validate_effects(effects: &[Effect], material: &Material, with_rod: bool) -> Result<(), ModelError> {
    for (index, effect) in effects.iter().enumerate() {
        effect.validate()?;
        let name = effect.kind().name();
        if effects[..index].iter().any(|other| other.kind() == effect.kind()) {
            return Err(ModelError::EffectRepeated { effect: name });
        }
        if effect.kind().needs_rod() && !with_rod {
            return Err(ModelError::EffectNeedsRod { effect: name });
        }
        if effect.kind() == EffectKind::Prestress {
            under_prestress(material.hysteresis, effect.values()).validate()?;
        }
    }
    Ok(())
}
