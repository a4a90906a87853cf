//! Free strain → displacement of the tip: no rod, a rod at rest, a linear rod, or one with forces of its own.
//!
//! A rod of two poles is driven by acceleration (m/s²), w/λ′ · λ + f F, one of elements by tip force (N), EA λ + F.
//! A linear rod counts from its equilibrium at the first sample, so that what rests there stays to the last bit.

use serde::{Deserialize, Serialize};

use super::nonlinear_rod::NonlinearRod;
use super::rod::{ActuatorRod, Load};
use crate::effects::load_change::loaded;
use crate::{
    ActuatorModel, EffectKind, ModelError, RodElementsPropagator, RodMotion, RodState, Stage, TwoPolePropagator,
};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// One to an actuator, and stepped for every sample: a box would cost more than its bytes.
#[allow(clippy::large_enum_variant)]
pub(super) enum RodStage {
    /// No rod: the strain of a free bar one metre long.
    Free,
    /// Always at rest: a sweep without time.
    Resting(NonlinearRod),
    Linear(LinearRod),
    Nonlinear(NonlinearRod),
}

/// A linear rod in motion about its equilibrium at the first sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LinearRod {
    /// Its input is the first times the strain plus the second times the force; the third times a constant input is
    /// where the tip then rests, m.
    per_strain: f64,
    per_force: f64,
    compliance: f64,
    rest_input: f64,
    rest_m: f64,
    motion: LinearMotion,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)]
enum LinearMotion {
    TwoPole(TwoPolePropagator, RodMotion),
    Elements(RodElementsPropagator),
}

impl RodStage {
    /// `tick_s` is infinite for a sweep without time.
    pub fn new(model: &ActuatorModel, rod: Option<ActuatorRod>, tick_s: f64) -> Result<Self, ModelError> {
        let mut two_pole = match rod {
            None => return Ok(RodStage::Free),
            Some(ActuatorRod::Elements(elements)) => {
                if let Some(effect) = model.effects.iter().find(|effect| effect.kind().stage() == Stage::Rod) {
                    return Err(ModelError::EffectNeedsTwoPoles {
                        effect: effect.kind().name(),
                    });
                }
                let motion = LinearMotion::Elements(RodElementsPropagator::new(&elements, tick_s)?);
                let constants = elements.constants();
                let compliance = constants.static_compliance_m_per_n();
                return Ok(LinearRod::stage(
                    constants.force_per_strain_n(),
                    1.0,
                    compliance,
                    motion,
                ));
            }
            Some(ActuatorRod::TwoPole(two_pole)) => two_pole,
        };
        if let Some(effect) = model.effect(EffectKind::LoadChange) {
            two_pole = loaded(two_pole, effect.values());
        }
        if tick_s.is_infinite() {
            return Ok(RodStage::Resting(NonlinearRod::resting(model, two_pole)));
        }
        let own_forces = [EffectKind::DeltaE, EffectKind::Stiffening, EffectKind::Friction];
        if own_forces.into_iter().any(|kind| model.effect(kind).is_some()) {
            return Ok(RodStage::Nonlinear(NonlinearRod::new(model, two_pole, tick_s)?));
        }
        let motion = LinearMotion::TwoPole(TwoPolePropagator::new(two_pole, tick_s)?, RodMotion::default());
        let compliance = 1.0 / two_pole.stiffness_per_s2;
        Ok(LinearRod::stage(
            two_pole.gain,
            two_pole.force_gain_per_kg,
            compliance,
            motion,
        ))
    }

    /// Displacement and velocity after the last sample; without a rod it has none.
    pub fn state(&self) -> RodState {
        match self {
            RodStage::Free => RodState::default(),
            RodStage::Linear(rod) => rod.state(),
            RodStage::Resting(rod) | RodStage::Nonlinear(rod) => rod.state,
        }
    }

    /// Writes the displacement of the tip, m.
    #[inline]
    pub fn pass(&mut self, load: &Load, displacement: &mut [f64]) {
        match self {
            RodStage::Free => displacement.copy_from_slice(load.strain),
            RodStage::Linear(rod) => rod.pass(load, displacement),
            RodStage::Resting(rod) => {
                for (index, displacement) in displacement.iter_mut().enumerate() {
                    *displacement = rod.steady_state(load, index);
                }
            }
            RodStage::Nonlinear(rod) => {
                for (index, displacement) in displacement.iter_mut().enumerate() {
                    *displacement = if load.first && index == 0 {
                        rod.steady_state(load, index)
                    } else {
                        rod.step(load, index)
                    };
                }
            }
        }
    }
}

impl LinearRod {
    fn stage(per_strain: f64, per_force: f64, compliance: f64, motion: LinearMotion) -> RodStage {
        RodStage::Linear(LinearRod {
            per_strain,
            per_force,
            compliance,
            rest_input: 0.0,
            rest_m: 0.0,
            motion,
        })
    }

    fn state(&self) -> RodState {
        let motion = match &self.motion {
            LinearMotion::TwoPole(_, motion) => motion.state,
            LinearMotion::Elements(rod) => rod.tip(),
        };
        RodState {
            displacement_m: self.rest_m + motion.displacement_m,
            ..motion
        }
    }

    #[inline]
    fn pass(&mut self, load: &Load, displacement: &mut [f64]) {
        let mut from = 0;
        if load.first && !displacement.is_empty() {
            self.rest_input = self.per_strain * load.strain[0] + self.per_force * load.force_n(0);
            self.rest_m = self.rest_input * self.compliance;
            displacement[0] = self.rest_m;
            from = 1;
        }
        for (index, displacement) in displacement.iter_mut().enumerate().skip(from) {
            let input = self.per_strain * load.strain[index] + self.per_force * load.force_n(index) - self.rest_input;
            let mean_excess = self.per_strain * load.mean_excess[index];
            let moved_m = match &mut self.motion {
                LinearMotion::TwoPole(propagator, motion) => motion.advance_curved(propagator, input, mean_excess),
                LinearMotion::Elements(rod) => rod.advance(input, mean_excess),
            };
            *displacement = self.rest_m + moved_m;
        }
    }
}
