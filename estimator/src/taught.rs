//! What one measurement has taught, whichever law it was.

use crate::multi_parameter::{COLUMNS, ParameterEstimates};
use crate::{Correction, Excitation};

/// One of a law's weights.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Weight {
    /// Which, as [`LawModel::weights`] has them.
    pub index: u64,
    /// Output per what it is multiplied with.
    pub value: f64,
}

/// What one measurement has taught.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Taught {
    pub correction: Correction,
    pub excitation: Excitation,
    /// M at the estimate, A/m.
    pub magnetization_a_per_m: f64,
    pub parameters: Option<ParameterEstimates>,
    /// By how much of its derivatives the first column is to move.
    pub change: Option<[f64; COLUMNS - 1]>,
    /// One of another law's weights.
    pub weight: Option<Weight>,
}
