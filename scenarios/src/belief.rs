//! What the controller's side believes of the actuator: the scenario's material and rod with its effects.
//!
//! Effects that only change numbers are worked into material and rod; the nodes are given the others. What is really
//! so stands in the scenario's plant, and is the same unless that says otherwise.

use super::Scenario;
use anhyst_guard::{Beliefs, BelievedCoil, CoilWatching};
use anhyst_ipc::{Invalid, NodeId};
use anhyst_model::{
    ActuatorModel, Effect, EffectKind, Material, RodElements, Stage, TwoPole, rod_per_magnetization, rod_per_strain,
    validate_effects, with_known_effects,
};
use serde::{Deserialize, Serialize};

/// What makes a coil later than is believed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Late {
    /// More ticks.
    Ticks(u32),
    /// A first-order lag, all that there is, time constant in s.
    Lag(f64),
}

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
            // A voltage drives no coil.
            coil: self.units().input != "V",
            ambient_temperature_k: self.plant.start_temperature_k,
            tolerances: Default::default(),
        })
    }

    /// The amplifier, as the coil's field is held against it.
    pub fn believed_coil(&self) -> BelievedCoil {
        let of = |kind: EffectKind| {
            let own = self.effects.iter().filter(move |effect| effect.kind() == kind);
            own.map(|effect| effect.values()[0]).sum::<f64>()
        };
        BelievedCoil {
            delay_ticks: self.amplifier.delay_ticks + (of(EffectKind::LoopDelay) / self.tick_s).round() as u32,
            lag_s: self.amplifier.lag_s() + of(EffectKind::AmplifierBandwidth),
            timing: self.clock.realtime().is_none(),
        }
    }

    /// Believes that the amplifier is later, on the controller's side only.
    ///
    /// # Errors
    /// A time that no amplifier has.
    pub fn believe_late(&mut self, late: Late) -> Result<(), Invalid> {
        let foreign = self.external_nodes().contains(&NodeId::Amplifier);
        let (kind, seconds) = match late {
            Late::Ticks(ticks) if foreign => {
                self.amplifier.delay_ticks += ticks;
                return Ok(());
            }
            Late::Lag(lag_s) if foreign => {
                self.amplifier.bandwidth_hz = Some(1.0 / (std::f64::consts::TAU * lag_s));
                return Ok(());
            }
            Late::Ticks(ticks) => {
                let before = self.believed_coil().delay_ticks - self.amplifier.delay_ticks;
                (EffectKind::LoopDelay, f64::from(before + ticks) * self.tick_s)
            }
            Late::Lag(lag_s) => (
                EffectKind::AmplifierBandwidth,
                (lag_s - self.amplifier.lag_s()).max(0.0),
            ),
        };
        let effect = Effect::new(kind, &[seconds]).map_err(|error| Invalid::new("effects", error.to_string()))?;
        self.effects.retain(|own| own.kind() != kind);
        self.effects.push(effect);
        Ok(())
    }

    /// What the guard is told of the loop. Whether its monitors look is its own settings' matter.
    ///
    /// # Errors
    /// If there can be no such controller.
    pub fn beliefs(&self) -> Result<Beliefs, Invalid> {
        let foreign = self.external_nodes();
        let watched = match self.guard.monitors.coil {
            CoilWatching::On => true,
            CoilWatching::Off => false,
            CoilWatching::Foreign => [NodeId::Amplifier, NodeId::Plant]
                .iter()
                .any(|node| foreign.contains(node)),
        };
        // What bends on the way to the coil is none of a gain and a shift.
        let bends = |effect: &Effect| {
            let followed = [EffectKind::AmplifierBandwidth, EffectKind::LoopDelay];
            effect.kind().stage() == Stage::Amplifier && !followed.contains(&effect.kind())
        };
        let bent = self.amplifier.slew_limit_a_per_m_s.is_some() || self.effects.iter().any(bends);
        let follows = !self.inverse.is_open_loop();
        let reference_m = if follows {
            self.controller()?.size_m(self.duration_s)
        } else {
            None
        };
        Ok(Beliefs {
            reference_m,
            coil: (watched && !bent).then(|| self.believed_coil()),
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
