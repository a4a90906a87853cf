//! ÿ_j + k̂ ẏ_j + ĉ y_j = g λ_j(t): the known rod, once for every member of the bank.
//!
//! y_j displacement of member j (m), λ_j its free strain (no unit), g acceleration per unit of free strain (m/s²),
//! k̂ 1/s, ĉ 1/s². Propagated exactly for strains that are linear between ticks.
//! A known load that stiffens adds −ĉβy³ to the right, at the tick's end taken at y + T·ẏ: off by ½T²ÿ, nothing is solved for.
//! Source: the paper's (13), with the gain taken per strain so that any magnetostriction law can drive it.

use anhyst_model::{ModelError, RodState, Spring, TwoPole, TwoPolePropagator};
use serde::{Deserialize, Serialize};

/// The rods and their outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(into = "RodsSnapshot", try_from = "RodsSnapshot")]
pub struct Rods {
    two_pole_per_strain: TwoPole,
    tick_s: f64,
    propagator: TwoPolePropagator,
    spring: Option<Spring>,
    accelerations: Vec<f64>,
    states: Vec<RodState>,
    displacements_m: Vec<f64>,
}

/// What is stored: nothing derived.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RodsSnapshot {
    two_pole_per_strain: TwoPole,
    tick_s: f64,
    #[serde(default)]
    spring: Option<Spring>,
    accelerations: Vec<f64>,
    states: Vec<RodState>,
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
            accelerations: vec![0.0; members],
            states: vec![RodState::default(); members],
            displacements_m: vec![0.0; members],
        })
    }

    /// The same under a load that stiffens.
    pub fn with_spring(self, spring: Option<Spring>) -> Self {
        Self { spring, ..self }
    }

    /// Moves every rod one tick on; `strains` are those at its end, one per member.
    pub fn advance(&mut self, strains: &[f64]) {
        let gain = self.two_pole_per_strain.gain;
        let rods = self
            .states
            .iter_mut()
            .zip(&mut self.accelerations)
            .zip(&mut self.displacements_m);
        for (((state, acceleration), displacement), strain) in rods.zip(strains) {
            let mut reached = gain * strain;
            if let Some(spring) = &self.spring {
                let coming_m = state.displacement_m + self.tick_s * state.velocity_m_per_s;
                reached -= self.two_pole_per_strain.stiffness_per_s2 * spring.excess_m(coming_m);
            }
            *state = self.propagator.advance(*state, *acceleration, reached);
            *acceleration = reached;
            *displacement = state.displacement_m;
        }
    }

    /// Displacements of the tips, m, in the bank's order.
    pub fn displacements_m(&self) -> &[f64] {
        &self.displacements_m
    }
}

impl From<Rods> for RodsSnapshot {
    fn from(rods: Rods) -> Self {
        Self {
            two_pole_per_strain: rods.two_pole_per_strain,
            tick_s: rods.tick_s,
            spring: rods.spring,
            accelerations: rods.accelerations,
            states: rods.states,
        }
    }
}

impl TryFrom<RodsSnapshot> for Rods {
    type Error = ModelError;

    fn try_from(snapshot: RodsSnapshot) -> Result<Self, ModelError> {
        let (members, given) = (snapshot.states.len(), snapshot.accelerations.len());
        if members != given {
            return Err(ModelError::TooFew {
                what: "a stored list of rod inputs",
                least: members,
                given,
            });
        }
        let mut rods = Self::new(snapshot.two_pole_per_strain, snapshot.tick_s, members)?;
        for (displacement, state) in rods.displacements_m.iter_mut().zip(&snapshot.states) {
            *displacement = state.displacement_m;
        }
        rods.spring = snapshot.spring;
        rods.accelerations = snapshot.accelerations;
        rods.states = snapshot.states;
        Ok(rods)
    }
}
