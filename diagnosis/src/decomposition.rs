//! What a decomposition has come to, and what a fit costs.

use crate::fitting::Fitted;
use crate::likelihood::Point;
use crate::screening::Screened;
use crate::search::JOINS;
use crate::unlisted::Unlisted;

/// What came out.
pub(crate) struct Decomposition {
    /// The model as given, with its zero, nothing fitted.
    pub nominal: Point,
    /// Constants and nuisance, no term.
    pub base: Fitted,
    /// With all terms.
    pub last: Fitted,
    /// Fits that explain as well, each with one term in the place of another.
    pub ties: Vec<Fitted>,
    /// Fits that were tried at each stage.
    pub tried: Vec<Fitted>,
    /// What the free curves gain beside the last fit.
    pub unlisted: Vec<Unlisted>,
    /// A free curve ended the search, or nothing that was tried is an answer.
    pub nameless: bool,
    /// The first screening.
    pub screened: Vec<Screened>,
}

/// By how much a fit explains the measurement worse than another: J, and what each term more has to earn.
pub(crate) fn cost(fit: &Fitted) -> f64 {
    fit.point.cost + JOINS * fit.point.composition.terms().len() as f64
}
