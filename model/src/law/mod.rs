//! Hysteresis laws, each in a file or folder of its own behind one trait.
//!
//! A law maps an input that moves monotonically from sample to sample (a field, a voltage) to an output (a magnetization,
//! a charge, a displacement). It holds parameters only; all memory is in a state that its user keeps, so that a run can be
//! stored, restored and branched. The same state and input give the same bits.
//! [`LawModel`] adds what stands beside hysteresis in measured data: a line, and creep.
//! What is special to one law (the domain wall law's derivatives, its bank over `a`) stays with its own type.

mod bouc_wen;
mod composite;
mod density;
pub mod domain_wall;
mod inversion;
mod plays;
mod preisach;
mod scaled_domain_wall;
mod sums;

pub use bouc_wen::BoucWen;
pub use composite::{Law, LawModel, LawModelState, LawState, SlowLag};
pub use density::Density;
pub use plays::{PlayGroup, PlaySum, PlaySumState, Warp};
pub use preisach::{Preisach, PreisachState};
pub use scaled_domain_wall::ScaledDomainWall;

use crate::ModelError;

/// One number of a law, as a report shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct LawParameter {
    /// In the field's words.
    pub name: String,
    /// In the units of the law's input and output.
    pub value: f64,
    /// The smallest value that the law takes.
    pub lower: f64,
    /// The largest.
    pub upper: f64,
}

impl LawParameter {
    pub(crate) fn new(name: impl Into<String>, value: f64, [lower, upper]: [f64; 2]) -> Self {
        LawParameter {
            name: name.into(),
            value,
            lower,
            upper,
        }
    }

    /// A weight: not negative.
    pub(crate) fn weight(name: impl Into<String>, value: f64) -> Self {
        Self::new(name, value, [0.0, f64::INFINITY])
    }
}

/// One hysteresis law with its parameters.
pub trait HysteresisLaw {
    /// Everything that it remembers. Two equal states go on with the same bits.
    type State: Clone + PartialEq;

    /// Without history, at input 0.
    fn rest(&self) -> Self::State;

    /// The price of the law: every number that a fit chooses.
    fn parameters(&self) -> Vec<LawParameter>;

    /// Refuses parameters out of range, and sets whose slope would not stay finite and not negative.
    ///
    /// # Errors
    /// The first quantity that is refused, with its limit.
    fn validate(&self) -> Result<(), ModelError>;

    /// Where the input stands.
    fn input(state: &Self::State) -> f64;

    /// What comes out there.
    fn output(&self, state: &Self::State) -> f64;

    /// Moves the input monotonically to a value.
    fn advance(&self, state: &mut Self::State, input_to: f64);

    /// Output and d output/d input where [`HysteresisLaw::advance`] would lead, on the side from which it comes.
    fn ahead(&self, state: &Self::State, input_to: f64) -> (f64, f64);

    /// d output/d input for a rising or a falling input.
    fn slope(&self, state: &Self::State, rising: bool) -> f64;

    /// Where the input would have to go for the output to have a value, not past ± a limit; false if the limit, or a demand
    /// that is not a number, comes before.
    fn input_for(&self, state: &Self::State, output_to: f64, input_limit: f64) -> (f64, bool) {
        inversion::input_for(self, state, output_to, input_limit)
    }

    /// Moves the input there. The state is exactly what [`HysteresisLaw::advance`] makes of it.
    fn advance_to_output(&self, state: &mut Self::State, output_to: f64, input_limit: f64) -> bool {
        let (input_to, reached) = self.input_for(state, output_to, input_limit);
        self.advance(state, input_to);
        reached
    }
}
