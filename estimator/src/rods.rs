//! ÿ_j + k̂ ẏ_j + ĉ y_j = g λ_j(t): the known rod, once for every member of the bank.
//!
//! y_j displacement of member j (m), λ_j its free strain (no unit), g acceleration per unit of free strain (m/s²),
//! k̂ 1/s, ĉ 1/s². Propagated exactly for strains that are linear between ticks.
//! Known forces of the rod's own are added to the right: those of one more rod, under the strain at the estimate, for every member alike. So the
//! member at the estimate has its own; what they change in the derivatives by the parameters is left out.
//! Source: the paper's (13), with the gain taken per strain so that any magnetostriction law can drive it.

use anhyst_model::{ModelError, OwnForces, RodMotion, TwoPole, TwoPolePropagator};
use serde::{Deserialize, Serialize};

/// The rods and their outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rods {
    two_pole_per_strain: TwoPole,
    propagator: TwoPolePropagator,
    own_forces: Option<OwnForces>,
    /// Rods that have them: derivatives do not.
    values: usize,
    motions: Vec<RodMotion>,
    displacements_m: Vec<f64>,
}

impl Rods {
    /// `members` rods at rest. The gain of `two_pole_per_strain` is per unit of free strain:
    /// [`anhyst_model::RodElements::two_pole`] with a strain per magnetization of 1.
    ///
    /// # Errors
    /// If the rod or the tick cannot be used.
    pub fn new(two_pole_per_strain: TwoPole, tick_s: f64, members: usize) -> Result<Self, ModelError> {
        Ok(Self {
            two_pole_per_strain,
            propagator: TwoPolePropagator::new(two_pole_per_strain, tick_s)?,
            own_forces: None,
            values: 0,
            motions: vec![RodMotion::default(); members],
            displacements_m: vec![0.0; members],
        })
    }

    /// The same with forces of its own on the first `values` rods.
    pub fn with_own_forces(self, own_forces: Option<OwnForces>, values: usize) -> Self {
        Self {
            own_forces,
            values,
            ..self
        }
    }

    /// Moves the first rod by so much of each of the others, which are its derivatives.
    pub fn shift(&mut self, change: &[f64]) {
        let Some((value, derivatives)) = self.motions.split_first_mut() else {
            return;
        };
        for (by, times) in derivatives.iter().zip(change) {
            value.state.displacement_m += times * by.state.displacement_m;
            value.state.velocity_m_per_s += times * by.state.velocity_m_per_s;
            value.acceleration += times * by.acceleration;
        }
    }

    /// Moves every rod one tick on; `strains` are those at its end, one per member, `at_estimate` strain and magnetization (A/m) there.
    pub fn advance(&mut self, strains: &[f64], at_estimate: (f64, f64)) {
        let gain = self.two_pole_per_strain.gain;
        let own_forces = self.own_forces.as_mut();
        let own = own_forces.map_or(0.0, |forces| forces.under(at_estimate.0, at_estimate.1));
        let rods = self.motions.iter_mut().zip(&mut self.displacements_m).zip(strains);
        for (index, ((motion, displacement), strain)) in rods.enumerate() {
            let own = if index < self.values { own } else { 0.0 };
            *displacement = motion.advance(&self.propagator, gain * strain + own);
        }
    }

    /// Displacements of the tips, m, in the bank's order.
    pub fn displacements_m(&self) -> &[f64] {
        &self.displacements_m
    }
}
