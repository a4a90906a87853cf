//! ÿ_j + k̂ ẏ_j + ĉ y_j = g λ_j(t): the known rod, once for every member of the bank.
//!
//! y_j displacement of member j (m), λ_j its free strain (no unit), g acceleration per unit of free strain (m/s²),
//! k̂ 1/s, ĉ 1/s². Propagated exactly for strains that are linear between ticks.
//! A known load that stiffens adds −ĉβy³ to the right, at the tick's end taken at y + T·ẏ: off by ½T²ÿ, nothing is solved for.
//! Source: the paper's (13), with the gain taken per strain so that any magnetostriction law can drive it.

use anhyst_model::{ModelError, RodMotion, Spring, TwoPole, TwoPolePropagator};
use serde::{Deserialize, Serialize};

/// The rods and their outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rods {
    two_pole_per_strain: TwoPole,
    tick_s: f64,
    propagator: TwoPolePropagator,
    spring: Option<Spring>,
    /// Rods that carry it: derivatives do not.
    sprung: usize,
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
            tick_s,
            propagator: TwoPolePropagator::new(two_pole_per_strain, tick_s)?,
            spring: None,
            sprung: 0,
            motions: vec![RodMotion::default(); members],
            displacements_m: vec![0.0; members],
        })
    }

    /// The same with the first `sprung` rods under a load that stiffens.
    pub fn with_spring(self, spring: Option<Spring>, sprung: usize) -> Self {
        Self { spring, sprung, ..self }
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

    /// Moves every rod one tick on; `strains` are those at its end, one per member.
    pub fn advance(&mut self, strains: &[f64]) {
        let gain = self.two_pole_per_strain.gain;
        let rods = self.motions.iter_mut().zip(&mut self.displacements_m).zip(strains);
        for (index, ((motion, displacement), strain)) in rods.enumerate() {
            let mut reached = gain * strain;
            if let Some(spring) = self.spring.as_ref().filter(|_| index < self.sprung) {
                let coming_m = motion.state.displacement_m + self.tick_s * motion.state.velocity_m_per_s;
                reached -= self.two_pole_per_strain.stiffness_per_s2 * spring.excess_m(coming_m);
            }
            *displacement = motion.advance(&self.propagator, reached);
        }
    }

    /// Displacements of the tips, m, in the bank's order.
    pub fn displacements_m(&self) -> &[f64] {
        &self.displacements_m
    }
}
