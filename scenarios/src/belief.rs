//! What the controller's side believes of the actuator: the scenario's material and rod with its effects.
//!
//! Effects that only change numbers are worked into material and rod; the nodes are given the others. What is really
//! so stands in the scenario's plant, and is the same unless that says otherwise.

use super::Scenario;
use anhyst_ipc::Invalid;
use anhyst_model::{
    ActuatorModel, Material, RodElements, TwoPole, rod_per_magnetization, rod_per_strain, validate_effects,
    with_known_effects,
};

impl Scenario {
    /// Material and rod (gain per free strain) for estimator, inverse and controller.
    ///
    /// # Errors
    /// If the rod's constants cannot be used.
    pub fn believed(&self) -> Result<(Material, TwoPole), Invalid> {
        Ok(with_known_effects(self.material()?, self.two_pole()?, &self.effects))
    }

    /// The rod's two poles for a drive by free strain, without effects: computed from its elements, or those of a
    /// fitted model.
    ///
    /// # Errors
    /// If the rod's constants cannot be used.
    pub fn two_pole(&self) -> Result<TwoPole, Invalid> {
        if let Some(fitted) = self.rod.two_pole {
            return Ok(rod_per_strain(fitted, self.material()?));
        }
        let elements = RodElements::assemble(&self.rod.constants, self.rod.elements)
            .map_err(|error| Invalid::new("rod.constants", error.to_string()))?;
        Ok(elements.two_pole(1.0))
    }

    /// What the controller's side believes, as a model of the actuator.
    ///
    /// # Errors
    /// If the rod's constants cannot be used.
    pub fn believed_model(&self) -> Result<ActuatorModel, Invalid> {
        let material = self.material()?.clone();
        Ok(ActuatorModel {
            name: format!("{} of scenario {}", material.name, self.name),
            source: material.source.clone(),
            amplifier: self.amplifier,
            rod: Some(rod_per_magnetization(self.two_pole()?, &material)),
            material,
            effects: self.effects.clone(),
            coil: true,
            ambient_temperature_k: self.plant.start_temperature_k,
            tolerances: Default::default(),
        })
    }

    /// What the plant does not say of itself is as the others believe.
    pub(super) fn complete_plant(&mut self) {
        let plant = &mut self.plant;
        plant.effects.get_or_insert_with(|| self.effects.clone());
        plant.two_pole = plant.two_pole.or(self.rod.two_pole);
    }

    /// The effects of both sides, each with its material.
    pub(super) fn validate_effects(&self) -> Result<(), Invalid> {
        let at = |path: &'static str| move |error: anhyst_model::ModelError| Invalid::new(path, error.to_string());
        let material = self.material()?;
        validate_effects(&self.effects, material, true).map_err(at("effects"))?;
        let real = self.plant.material.as_ref().unwrap_or(material);
        real.validate().map_err(at("plant.material"))?;
        let effects = self.plant.effects.as_deref().unwrap_or_default();
        validate_effects(effects, real, true).map_err(at("plant.effects"))?;
        for (path, rod) in [
            ("rod.two_pole", self.rod.two_pole),
            ("plant.two_pole", self.plant.two_pole),
        ] {
            rod.map_or(Ok(()), |rod| rod.validate()).map_err(at(path))?;
        }
        Ok(())
    }
}
