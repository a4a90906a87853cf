//! Hysteresis laws, each in a folder of its own behind one trait.
//!
//! A law maps an input that moves monotonically from sample to sample (a field, a voltage) to an output (a magnetization,
//! a charge, a displacement). It holds parameters only; all memory is in a state that its user keeps, so that a run can be
//! stored, restored and branched. The same state and input give the same bits.
//! What is special to one law (the domain wall law's derivatives, its bank over `a`) stays with its own type.

pub mod domain_wall;

use crate::ModelError;

/// One hysteresis law with its parameters.
pub trait HysteresisLaw {
    /// Everything that it remembers; the default has no history. Two equal states go on with the same bits.
    type State: Clone + Default + PartialEq;
    /// Names its parameters.
    type Parameter: Copy + 'static;
    /// In the order of every list of them.
    const PARAMETERS: &'static [Self::Parameter];

    /// A parameter's value in its unit.
    fn value(&self, parameter: Self::Parameter) -> f64;

    /// The same law with another value, which [`HysteresisLaw::validate`] may refuse.
    #[must_use]
    fn with_value(self, parameter: Self::Parameter, value: f64) -> Self;

    /// Refuses parameters out of range, and sets whose slope would not stay finite and positive.
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

    /// d output/d input for a rising or a falling input.
    fn slope(&self, state: &Self::State, rising: bool) -> f64;

    /// Moves the input monotonically until the output has a value, not past ± a limit; false if the limit, or a demand that
    /// is not a number, came before. The state is then exactly what [`HysteresisLaw::advance`] makes of its input.
    fn advance_to_output(&self, state: &mut Self::State, output_to: f64, input_limit: f64) -> bool;
}
