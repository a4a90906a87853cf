//! The rod in the chain, and what drives it over a stretch of a run.

use crate::{RodElements, TwoPole};

/// The rod that the free strain drives.
#[derive(Clone, Debug, PartialEq)]
pub enum ActuatorRod {
    /// Its gain is per unit of free strain: [`RodElements::two_pole`] of 1, or [`super::rod_per_strain`].
    TwoPole(TwoPole),
    /// With its higher modes; effects on the rod are written for two poles.
    Elements(RodElements),
}

/// What a stretch of the run brings to the rod.
pub(super) struct Load<'a> {
    pub first: bool,
    pub strain: &'a [f64],
    /// By how much the strain's mean over the tick lies above the mean of its ends.
    pub mean_excess: &'a [f64],
    /// A/m.
    pub magnetization: &'a [f64],
    /// N.
    pub force: Option<&'a [f64]>,
}

impl Load<'_> {
    /// N.
    #[inline]
    pub fn force_n(&self, index: usize) -> f64 {
        self.force.map_or(0.0, |force| force[index])
    }
}
