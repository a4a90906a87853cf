//! Measured loops as a fit sees them, and what of them belongs to the instrument.

use anhyst_model::MagneticState;

use crate::simulate::Beginning;

/// One loop as the fit sees it.
#[derive(Clone, Debug)]
pub(crate) struct ObservedLoop {
    pub field_a_per_m: Vec<f64>,
    pub magnetization_a_per_m: Vec<f64>,
    pub magnetization_range_a_per_m: f64,
    pub strain: Option<Vec<f64>>,
    pub beginning: Beginning,
    /// Before the first of two runs.
    pub before: MagneticState,
}

/// Unknowns that belong to the instrument and not to the material, as fractions of each loop's range of M.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Nuisance {
    /// Measured zero of M: measured M = true M + offset.
    pub offset: Vec<f64>,
    /// First true M less the first measured one, for loops that do not begin demagnetised.
    pub start: Vec<f64>,
}
