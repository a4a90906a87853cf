//! What is known of an actuator: the nominal chain, and the effects found in it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{ActuatorRod, rod_per_strain};
use crate::effects::prestress::under_prestress;
use crate::error::require_positive;
use crate::parameter::nominal_rows;
use crate::{AmplifierConstants, Effect, EffectKind, Magnetostriction, Material, ModelError, Stage, TwoPole};

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
    /// How far off a constant may be: its standard deviation, by its name, as a share of its value (of α as it is).
    /// What does not stand here has that of the table of parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tolerances: BTreeMap<String, f64>,
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
            tolerances: BTreeMap::new(),
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

    /// All that [`super::Actuator::magnetize`] depends on, and nothing else: two models with the same have the same magnetic half.
    pub fn magnetic_half(&self) -> Self {
        let behind = [Stage::Magnetization, Stage::Strain, Stage::Rod, Stage::Sensor];
        let effects = self
            .effects
            .iter()
            .filter(|effect| !behind.contains(&effect.kind().stage()));
        ActuatorModel {
            name: String::new(),
            source: String::new(),
            amplifier: self.amplifier,
            material: Material {
                magnetostriction: Magnetostriction::Unmeasured,
                ..self.material.clone()
            },
            rod: None,
            coil: self.coil,
            effects: effects.copied().collect(),
            ambient_temperature_k: self.ambient_temperature_k,
            tolerances: BTreeMap::new(),
        }
    }

    /// Checks every part, and that parts and effects go together.
    ///
    /// # Errors
    /// The first quantity out of its range; an effect that stands twice or lacks its rod.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.validate_with(self.actuator_rod().as_ref())
    }

    pub(super) fn validate_with(&self, rod: Option<&ActuatorRod>) -> Result<(), ModelError> {
        self.amplifier.validate()?;
        match (self.material.magnetostriction, rod) {
            // Without a rod its output may be the magnetization.
            (Magnetostriction::Unmeasured, None) => self.material.hysteresis.validate()?,
            _ => self.material.validate()?,
        }
        require_positive(self.ambient_temperature_k, "ambient temperature", "K")?;
        if let Some(ActuatorRod::TwoPole(two_pole)) = rod {
            two_pole.validate()?;
        }
        for (name, tolerance) in &self.tolerances {
            let known = nominal_rows(self.rod.is_some()).map(|row| row.name);
            if !known.contains(&name.as_str()) {
                return Err(ModelError::ToleranceUnknown {
                    name: name.clone(),
                    known: known.join(", "),
                });
            }
            require_positive(*tolerance, "a tolerance", "")?;
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
        effect.validate_in(material)?;
        let name = effect.kind().name();
        if effects[..index].iter().any(|other| other.kind() == effect.kind()) {
            return Err(ModelError::EffectRepeated { effect: name });
        }
        if effect.kind().stage() == Stage::Hysteresis && material.law.is_some() {
            return Err(ModelError::EffectNeedsDomainWall { effect: name });
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
