//! The rod of the simulated plant: one damped oscillator, or finite elements; both driven by free strain and tip force.
//!
//! u displacement of the tip (m), λ free strain (no unit), F tip force (N); both go linearly from tick to tick and are
//! propagated exactly. Equations and source: `anhyst_model::rod`, the paper's (10)-(13).

use anhyst_ipc::Invalid;
use anhyst_model::{
    ModelError, RodConstants, RodElements, RodElementsPropagator, RodState, TwoPole, TwoPolePropagator,
};
use serde::{Deserialize, Serialize};

/// Elements from which [`PlantRod::TwoPole`] is reduced: with these the paper's w comes out to all printed digits.
pub const TWO_POLE_ELEMENTS: usize = 8;

/// More elements than this only cost time: the 64th mode is far above any sampling frequency.
const MOST_ELEMENTS: usize = 64;

/// Which rod is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PlantRod {
    /// The paper's (13): what estimator and controller assume, too.
    #[default]
    TwoPole,
    /// This many elements: has the higher modes that the others do not know.
    Elements(usize),
}

impl PlantRod {
    /// # Errors
    /// No element, or too many.
    pub fn validate(&self) -> Result<(), Invalid> {
        match *self {
            PlantRod::Elements(count) if count == 0 || count > MOST_ELEMENTS => Err(Invalid::new(
                "",
                format!("{count} elements are outside [1, {MOST_ELEMENTS}]"),
            )),
            _ => Ok(()),
        }
    }
}

/// The rod in motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Rod {
    TwoPole(TwoPoleRod),
    /// And its tip force per strain, N.
    Elements(RodElementsPropagator, f64),
}

impl Rod {
    /// At rest without strain and force.
    pub(crate) fn new(kind: PlantRod, constants: &RodConstants, tick_s: f64) -> Result<Self, ModelError> {
        Ok(match kind {
            PlantRod::TwoPole => {
                let two_pole = RodElements::assemble(constants, TWO_POLE_ELEMENTS)?.two_pole(1.0);
                Rod::TwoPole(TwoPoleRod::at_rest(two_pole, tick_s)?)
            }
            PlantRod::Elements(count) => Rod::Elements(
                RodElementsPropagator::new(&RodElements::assemble(constants, count)?, tick_s)?,
                constants.force_per_strain_n(),
            ),
        })
    }

    /// One tick; strain and force go from the first to the second of their pair.
    pub(crate) fn advance(&mut self, strain: (f64, f64), force_n: (f64, f64)) {
        match self {
            Rod::TwoPole(rod) => {
                let [from, to] = [(strain.0, force_n.0), (strain.1, force_n.1)]
                    .map(|(strain, force_n)| rod.two_pole.acceleration(strain, force_n));
                rod.state = rod.propagator.advance(rod.state, from, to);
            }
            Rod::Elements(rod, per_strain_n) => {
                rod.advance(*per_strain_n * strain.1 + force_n.1, 0.0);
            }
        }
    }

    /// Displacement (m) and velocity (m/s) of the tip.
    pub(crate) fn tip(&self) -> RodState {
        match self {
            Rod::TwoPole(rod) => rod.state,
            Rod::Elements(rod, _) => rod.tip(),
        }
    }
}

/// The two-pole rod, its gain per unit of free strain. A snapshot holds no propagator: it is computed again, to the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TwoPoleSnapshot", into = "TwoPoleSnapshot")]
pub(crate) struct TwoPoleRod {
    two_pole: TwoPole,
    tick_s: f64,
    propagator: TwoPolePropagator,
    state: RodState,
}

impl TwoPoleRod {
    fn at_rest(two_pole: TwoPole, tick_s: f64) -> Result<Self, ModelError> {
        let propagator = TwoPolePropagator::new(two_pole, tick_s)?;
        Ok(TwoPoleRod {
            two_pole,
            tick_s,
            propagator,
            state: RodState::default(),
        })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TwoPoleSnapshot {
    two_pole: TwoPole,
    tick_s: f64,
    state: RodState,
}

impl From<TwoPoleRod> for TwoPoleSnapshot {
    fn from(rod: TwoPoleRod) -> Self {
        TwoPoleSnapshot {
            two_pole: rod.two_pole,
            tick_s: rod.tick_s,
            state: rod.state,
        }
    }
}

impl TryFrom<TwoPoleSnapshot> for TwoPoleRod {
    type Error = ModelError;

    fn try_from(snapshot: TwoPoleSnapshot) -> Result<Self, ModelError> {
        let rod = TwoPoleRod::at_rest(snapshot.two_pole, snapshot.tick_s)?;
        Ok(TwoPoleRod {
            state: snapshot.state,
            ..rod
        })
    }
}
