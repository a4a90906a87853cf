//! How far long work has come; the executable draws it, this crate only tells.

/// One sign of life.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    pub stage: Stage,
    pub done: usize,
    pub total: usize,
    /// Smallest joint NRMSE so far (a fraction of the range), infinite before the first.
    pub best_nrmse: f64,
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Random parameter sets over the bounds, simulated once each.
    Screening,
    /// Levenberg-Marquardt from the best of each group of random sets.
    Polishing,
}

impl std::fmt::Display for Stage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Stage::Screening => "screening random parameter sets",
            Stage::Polishing => "polishing the best of them",
        })
    }
}
