//! What an estimation law is: predictions of the bank and one measurement in, a corrected shape parameter out.
//!
//! A law sees every member's strain and displacement at t_k and the measured displacement at t_k; it owns its state and
//! its estimate. One file per law; the scenario chooses by name ([`crate::LawSettings`]).

use crate::Grid;

/// A displacement (or tesla) beyond this is no measurement of an actuator: it would fill a law's filters with nonsense for a long time.
const CREDIBLE_DISPLACEMENT_M: f64 = 10.0;

/// Whether a law may use the measurement at all.
pub(crate) fn is_credible(displacement_m: f64) -> bool {
    displacement_m.abs() <= CREDIBLE_DISPLACEMENT_M
}

/// The bank at t_k, member by member in the order of the grid.
#[derive(Debug, Clone, Copy)]
pub struct Prediction<'a> {
    /// The members' shape parameters.
    pub grid: &'a Grid,
    /// Their free strains, without unit; washed as the displacements are where the law reads them.
    pub strains: &'a [f64],
    /// Their tip displacements after the known rod, m.
    pub displacements_m: &'a [f64],
}

/// What one step of a law found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Correction {
    /// New estimate of a, A/m.
    pub shape_a_per_m: f64,
    /// Predicted minus (filtered) measured output, m.
    pub output_error_m: f64,
    /// Output predicted at the estimate before the correction, f(θ̂), m.
    pub predicted_output_m: f64,
    /// Convex cover of f there, m.
    pub lower_cover_m: f64,
    /// Concave cover of f there, m.
    pub upper_cover_m: f64,
    /// Slope that was used, m per A/m: φ* of a cover, or dY/da.
    pub slope_m_per_a_per_m: f64,
    /// Standard deviation of the estimate, A/m; 0 where the law gives none.
    pub standard_deviation_a_per_m: f64,
    /// The output error is outside the dead zone: the estimate is being corrected.
    pub adapting: bool,
    /// The estimate stands at an edge of Θ.
    pub at_edge: bool,
    /// Nothing is learnt: no usable measurement, or a motion that does not inform ([`crate::Excitation`]).
    pub held: bool,
    /// The scenario fixes the estimate.
    pub fixed: bool,
}

/// An estimation law.
pub trait Law {
    /// Corrects the estimate with the measurement of this tick. Finite predictions give finite answers, whatever the
    /// measurement.
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction;

    /// Where the estimate stands, A/m.
    fn shape_a_per_m(&self) -> f64;

    /// A tick in which nothing can be learnt: the estimate stays. The same as a tick without a measurement.
    fn hold(&mut self, prediction: Prediction<'_>) -> Correction {
        self.correct(prediction, f64::NAN)
    }
}
