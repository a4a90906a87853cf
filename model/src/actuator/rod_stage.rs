//! Free strain → displacement of the tip: no rod, a rod at rest, the linear rod, or one with forces of its own.
//!
//! Everything is reckoned as acceleration (m/s²): w λ/λ′ drives the rod, f F is the force at its tip.

use serde::{Deserialize, Serialize};

use super::nonlinear_rod::NonlinearRod;
use crate::effects::load_change::loaded;
use crate::effects::quadratic_magnetostriction::reference_slope;
use crate::{ActuatorModel, EffectKind, ModelError, RodMotion, RodState, TwoPole, TwoPolePropagator};

/// What a stretch of the run brings to the rod.
pub(super) struct Load<'a> {
    pub first: bool,
    pub strain: &'a [f64],
    /// By how much the strain's mean over the tick lies above the mean of its ends.
    pub bulge: &'a [f64],
    /// A/m.
    pub magnetization: &'a [f64],
    /// N.
    pub force: Option<&'a [f64]>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum RodStage {
    /// No rod: the strain of a free bar one metre long.
    Free,
    /// Always at rest: a sweep without time.
    Resting(NonlinearRod),
    Linear(LinearRod),
    Nonlinear(NonlinearRod),
}

/// The rod and how strain and force accelerate it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DrivenRod {
    pub two_pole: TwoPole,
    /// w/λ′, m/s² per strain.
    gain_per_strain: f64,
}

impl DrivenRod {
    /// Acceleration by strain, m/s².
    #[inline]
    pub fn by_strain(&self, strain: f64) -> f64 {
        self.gain_per_strain * strain
    }

    /// Acceleration by force, m/s².
    #[inline]
    pub fn by_force(&self, load: &Load, index: usize) -> f64 {
        match load.force {
            Some(force) => self.two_pole.force_gain_per_kg * force[index],
            None => 0.0,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LinearRod {
    driven: DrivenRod,
    propagator: TwoPolePropagator,
    motion: RodMotion,
}

impl RodStage {
    /// `tick_s` is infinite for a sweep without time.
    pub fn new(model: &ActuatorModel, tick_s: f64) -> Result<Self, ModelError> {
        let Some(mut two_pole) = model.rod else {
            return Ok(RodStage::Free);
        };
        let gain = two_pole.gain / reference_slope(&model.material);
        let mut gain_per_strain = gain;
        if let Some(effect) = model.effect(EffectKind::LoadChange) {
            let nominal = two_pole.gain;
            two_pole = loaded(two_pole, effect.values());
            gain_per_strain = gain * (two_pole.gain / nominal);
        }
        let driven = DrivenRod {
            two_pole,
            gain_per_strain,
        };
        if tick_s.is_infinite() {
            return Ok(RodStage::Resting(NonlinearRod::resting(model, driven)));
        }
        let own_forces = [EffectKind::DeltaE, EffectKind::Stiffening, EffectKind::Friction];
        if own_forces.into_iter().any(|kind| model.effect(kind).is_some()) {
            return Ok(RodStage::Nonlinear(NonlinearRod::new(model, driven, tick_s)?));
        }
        Ok(RodStage::Linear(LinearRod {
            driven,
            propagator: TwoPolePropagator::new(two_pole, tick_s)?,
            motion: RodMotion::default(),
        }))
    }

    /// Displacement and velocity after the last sample; without a rod it has none.
    pub fn state(&self) -> RodState {
        match self {
            RodStage::Free => RodState::default(),
            RodStage::Linear(rod) => rod.motion.state,
            RodStage::Resting(rod) | RodStage::Nonlinear(rod) => rod.state,
        }
    }

    /// Writes the displacement of the tip, m.
    pub fn pass(&mut self, load: &Load, displacement: &mut [f64]) {
        match self {
            RodStage::Free => displacement.copy_from_slice(load.strain),
            RodStage::Linear(rod) => rod.pass(load, displacement),
            RodStage::Resting(rod) => {
                for (index, displacement) in displacement.iter_mut().enumerate() {
                    *displacement = rod.settle(load, index);
                }
            }
            RodStage::Nonlinear(rod) => {
                for (index, displacement) in displacement.iter_mut().enumerate() {
                    *displacement = if load.first && index == 0 {
                        rod.settle(load, index)
                    } else {
                        rod.step(load, index)
                    };
                }
            }
        }
    }
}

impl LinearRod {
    fn pass(&mut self, load: &Load, displacement: &mut [f64]) {
        for (index, displacement) in displacement.iter_mut().enumerate() {
            let acceleration = self.driven.by_strain(load.strain[index]) + self.driven.by_force(load, index);
            if load.first && index == 0 {
                let displacement_m = acceleration / self.driven.two_pole.stiffness_per_s2;
                self.motion = RodMotion {
                    state: RodState {
                        displacement_m,
                        velocity_m_per_s: 0.0,
                    },
                    acceleration,
                };
                *displacement = displacement_m;
                continue;
            }
            let bulge = self.driven.by_strain(load.bulge[index]);
            *displacement = self.motion.advance_curved(&self.propagator, acceleration, bulge);
        }
    }
}
