//! ÿ_j + k̂ ẏ_j + ĉ y_j = g λ_j(t): the known rod, once for every member of the bank.
//!
//! y_j displacement of member j (m), λ_j its free strain (no unit), g acceleration per unit of free strain (m/s²),
//! k̂ 1/s, ĉ 1/s². Propagated exactly for strains that are linear between ticks.
//! Known forces of the rod's own are added to the right: those of one more rod, under the strain at the estimate, for every member alike. So the
//! member at the estimate has its own; what they change in the derivatives by the parameters is left out.
//! Source: the paper's (13), with the gain taken per strain so that any magnetostriction law can drive it.

use anhyst_model::{ModelError, OwnForces, RodState, TwoPole, TwoPolePropagator};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The rods and their outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rods {
    two_pole_per_strain: TwoPole,
    propagator: TwoPolePropagator,
    own_forces: Option<OwnForces>,
    /// Rods that have them: derivatives do not.
    values: usize,
    motions: Motions,
}

/// Side by side, so that several rods go through one instruction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Motions {
    displacements_m: Vec<f64>,
    velocities_m_per_s: Vec<f64>,
    accelerations_m_per_s2: Vec<f64>,
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
            motions: Motions {
                displacements_m: vec![0.0; members],
                velocities_m_per_s: vec![0.0; members],
                accelerations_m_per_s2: vec![0.0; members],
            },
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

    /// Whether they have forces of their own.
    pub fn have_own_forces(&self) -> bool {
        self.own_forces.is_some()
    }

    /// Moves the first rod by so much of each of the others, which are its derivatives.
    pub fn shift(&mut self, change: &[f64]) {
        let own = &mut self.motions;
        for part in [
            &mut own.displacements_m,
            &mut own.velocities_m_per_s,
            &mut own.accelerations_m_per_s2,
        ] {
            if let Some((value, derivatives)) = part.split_first_mut() {
                for (by, times) in derivatives.iter().zip(change) {
                    *value += times * by;
                }
            }
        }
    }

    /// Moves every rod one tick on; `strains` are those at its end, one per member, `at_estimate` strain and magnetization
    /// (A/m) there, for forces of their own.
    pub fn advance(&mut self, strains: &[f64], at_estimate: Option<(f64, f64)>) {
        let gain = self.two_pole_per_strain.gain;
        let own_forces = self.own_forces.as_mut().zip(at_estimate);
        let own = own_forces.map_or(0.0, |(forces, (strain, magnetization_a_per_m))| {
            forces.under(strain, magnetization_a_per_m)
        });
        let split = self.values.min(strains.len());
        self.motions
            .advance(&self.propagator, 0..split, &strains[..split], |strain| {
                gain * strain + own
            });
        self.motions
            .advance(&self.propagator, split..strains.len(), &strains[split..], |strain| {
                gain * strain + 0.0
            });
    }

    /// Displacements of the tips, m, in the bank's order.
    pub fn displacements_m(&self) -> &[f64] {
        &self.motions.displacements_m
    }
}

impl Motions {
    /// Those of `range`, under the accelerations at the tick's end.
    #[inline(always)]
    fn advance(
        &mut self,
        propagator: &TwoPolePropagator,
        range: Range<usize>,
        strains: &[f64],
        acceleration: impl Fn(f64) -> f64,
    ) {
        let displacements_m = self.displacements_m[range.clone()].iter_mut();
        let velocities_m_per_s = self.velocities_m_per_s[range.clone()].iter_mut();
        let accelerations_m_per_s2 = self.accelerations_m_per_s2[range].iter_mut();
        let rods = displacements_m.zip(velocities_m_per_s).zip(accelerations_m_per_s2);
        for (((displacement_m, velocity_m_per_s), from), strain) in rods.zip(strains) {
            let before = RodState {
                displacement_m: *displacement_m,
                velocity_m_per_s: *velocity_m_per_s,
            };
            let to = acceleration(*strain);
            let after = propagator.advance(before, *from, to);
            (*displacement_m, *velocity_m_per_s, *from) = (after.displacement_m, after.velocity_m_per_s, to);
        }
    }
}
