//! z = κ/(s + κ)·(1 + s/μ)·y,  f = κ/(s + κ)·x,  z = G f,  G = ĉ (1 + s/μ)/(s² + k̂s + ĉ): the matrix law in the loop.
//!
//! y measured displacement (m), x displacement of a member's free strain at rest (m): f and z are metres, and so are
//! covers and errors. Only the displacement is measured: `rod_output.rs` makes z of it, and f of the strains, so that a
//! perfect model has no error at any tick. `matrix.rs` has the law and its proof. 0 < μ < k̂ makes G strictly positive
//! real: Re 1/G = μ[(ĉ − ω²)μ + k̂ω²]/(ĉ(ω² + μ²)).
//!
//! A tick without a measurement takes the displacement predicted at the estimate for it, and corrects nothing: the copy
//! runs on, and what the missing ticks hid comes back as an error of the copy's first state. A washout filters
//! measurement and strains alike ([`crate::Estimator`]), so z = G f stays true.
//! Source: the paper's (20)-(21), with an output that can be measured.

use crate::law::is_credible;
use crate::matrix::{Matrix, MatrixConstants};
use crate::modes::Modes;
use crate::rod_output::RodOutput;
use crate::{Correction, EstimatorError, Law, MinMaxSettings, Prediction};
use anhyst_ipc::Invalid;
use anhyst_model::TwoPole;
use serde::{Deserialize, Serialize};

/// The matrix law on the displacement of a two-pole rod.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MatrixLaw {
    output: RodOutput,
    law: Matrix,
}

impl MatrixLaw {
    /// The law at its start, for a rod at rest. The rod's gain is per unit of free strain.
    ///
    /// # Errors
    /// A zero that is not below the rod's damping; a rod without two distinct decaying modes.
    pub fn new(settings: &MinMaxSettings, two_pole_per_strain: &TwoPole, tick_s: f64) -> Result<Self, EstimatorError> {
        let (zero, damping) = (settings.zero_per_s.unwrap_or(0.0), two_pole_per_strain.damping_per_s);
        if zero >= damping {
            let sentence = format!(
                "{zero} 1/s must be below the rod's damping {damping:.1} 1/s: with a zero beyond it the output is not \
                 positive real"
            );
            return Err(Invalid::new("law.zero_per_s", sentence).into());
        }
        let constants = MatrixConstants {
            start_a_per_m: settings.start_a_per_m,
            dead_zone: settings.dead_zone_m,
            gain: settings.gain(),
            window_a_per_m: settings.window_a_per_m,
        };
        let modes = Modes::of_rod(two_pole_per_strain, zero)?;
        Ok(Self {
            output: RodOutput::new(
                two_pole_per_strain,
                zero,
                settings.filter_per_s,
                settings.members,
                tick_s,
            )?,
            law: Matrix::new(&modes, constants, settings.members, tick_s)?,
        })
    }
}

impl Law for MatrixLaw {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let grid = prediction.grid;
        let output = if is_credible(measured_displacement_m) {
            self.output.output_m(measured_displacement_m)
        } else {
            let expected = grid.linear(prediction.displacements_m, self.law.shape_a_per_m());
            self.output.output_m(expected);
            f64::NAN
        };
        let inputs = self.output.inputs_m(prediction.strains);
        self.law.correct(grid, inputs, output)
    }

    fn shape_a_per_m(&self) -> f64 {
        self.law.shape_a_per_m()
    }
}
