//! θ̂⁺ = proj_Θ(θ̂ + K (y − Y(θ̂) − ½Y″P)),  K = P Y′/S,  S = σ² + Y′²P + ½(Y″P)²,  P⁺ = (1 − K Y′)P,  each tick P ← P + q dt
//!
//! y measured displacement, Y(θ) displacement that the bank predicts through the known rod (m), Y′ and Y″ its derivatives at
//! θ̂ (m per A/m, m per (A/m)²), P variance of the estimate ((A/m)²), σ noise of the displacement sensor (m), q variance of the
//! random walk that `a` is taken for ((A/m)²/s).
//! Recursive Gauss-Newton, that is the extended Kalman filter of one parameter. The two terms with Y″ are those of the
//! second-order filter: while P is large they keep the filter from trusting a tangent further than it reaches, and they vanish
//! with P. They make the standard deviation √P honest after a start hundreds of A/m away.
//! Memory: with the information rate I = mean(Y′²)/(σ² dt) the filter settles at P = √(q/I), forgets at the rate √(qI) and
//! lags behind a drift v by v/√(qI). With q = 0 it remembers everything: P → 1/(I t), the Cramér-Rao bound.
//! Assumptions: white Gaussian noise, everything but `a` known. P never exceeds what is known before any measurement.
//! Source: Jazwinski, Stochastic Processes and Filtering Theory (1970), chapter 9 (modified Gaussian second-order filter).

use crate::law::is_credible;
use crate::{Correction, GaussNewtonSettings, Law, Prediction};
use serde::{Deserialize, Serialize};

/// The recursive Gauss-Newton law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaussNewton {
    /// σ², m².
    noise_variance_m2: f64,
    /// q dt, (A/m)².
    drift_per_tick: f64,
    /// Variance before any measurement, (A/m)².
    first_variance: f64,
    /// P, (A/m)².
    variance: f64,
    shape_a_per_m: f64,
}

impl GaussNewton {
    /// The law at its start.
    pub fn new(settings: &GaussNewtonSettings, tick_s: f64) -> Self {
        let first_variance = settings.start_deviation_a_per_m * settings.start_deviation_a_per_m;
        Self {
            noise_variance_m2: settings.noise_m * settings.noise_m,
            drift_per_tick: settings.drift_variance_per_s * tick_s,
            first_variance,
            variance: first_variance,
            shape_a_per_m: settings.start_a_per_m,
        }
    }
}

impl Law for GaussNewton {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let grid = prediction.grid;
        let output = grid.smooth(prediction.displacements_m, self.shape_a_per_m);
        self.variance = (self.variance + self.drift_per_tick).min(self.first_variance);
        let mut correction = Correction {
            predicted_output_m: output.value,
            lower_cover_m: output.value,
            upper_cover_m: output.value,
            slope_m_per_a_per_m: output.slope,
            held: !is_credible(measured_displacement_m),
            ..Correction::default()
        };
        if !correction.held {
            let bend = 0.5 * output.curvature * self.variance;
            let expected_variance =
                self.noise_variance_m2 + output.slope * output.slope * self.variance + 2.0 * bend * bend;
            let gain = self.variance * output.slope / expected_variance;
            correction.output_error_m = output.value - measured_displacement_m;
            correction.adapting = gain != 0.0;
            self.shape_a_per_m = grid.project(self.shape_a_per_m - gain * (correction.output_error_m + bend));
            self.variance *= (self.noise_variance_m2 + 2.0 * bend * bend) / expected_variance;
        }
        correction.shape_a_per_m = self.shape_a_per_m;
        correction.standard_deviation_a_per_m = self.variance.sqrt();
        correction.at_edge = grid.is_edge(self.shape_a_per_m);
        correction
    }

    fn shape_a_per_m(&self) -> f64 {
        self.shape_a_per_m
    }
}

#[cfg(test)]
#[path = "gauss_newton_tests.rs"]
mod tests;
