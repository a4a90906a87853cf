//! The scalar law with an erratum left in. Wrong on purpose: nothing but the paper's figures uses it.
//!
//! `Pairing`: (18) as printed, the concave cover where ỹ_ε > 0 and the convex one where ỹ_ε < 0.
//! `Argument`: sat(ŷ/ε) where the derivation has sat(ỹ/ε), as (20) prints it in all its places.
//! Otherwise the equations of [`anhyst_estimator::Scalar`], backward Euler like there.

use anhyst_estimator::{Covers, Grid, ScalarSettings};

/// Which erratum is left in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Erratum {
    /// Of (18).
    Pairing,
    /// Of (14) and (20).
    Argument,
}

/// The law.
#[derive(Debug, Clone)]
pub struct PrintedScalar {
    erratum: Erratum,
    settings: ScalarSettings,
    tick_s: f64,
    covers: Covers,
    shape_a_per_m: f64,
    /// ŷ, A s/m.
    predicted: f64,
}

impl PrintedScalar {
    /// At its start.
    pub fn new(erratum: Erratum, settings: ScalarSettings, members: usize, tick_s: f64) -> Self {
        Self {
            erratum,
            settings,
            tick_s,
            covers: Covers::with_members(members),
            shape_a_per_m: settings.start_a_per_m,
            predicted: 0.0,
        }
    }

    /// One step; gives θ̂ (A/m) and ỹ (A s/m).
    pub fn correct(&mut self, grid: &Grid, magnetizations_a_per_m: &[f64], observed: f64) -> [f64; 2] {
        let (thetas, at) = (grid.shapes_a_per_m(), self.shape_a_per_m);
        self.covers.update(thetas, magnetizations_a_per_m);
        let f = grid.linear(magnetizations_a_per_m, at);
        let h = self.settings.decay_per_s * self.tick_s;
        let drive = self.predicted + self.tick_s * f - (1.0 + h) * observed;
        let convex = (drive > 0.0) != (self.erratum == Erratum::Pairing);
        let cover = if convex {
            self.covers.lower_at(thetas, magnetizations_a_per_m, at)
        } else {
            self.covers.upper_at(thetas, magnetizations_a_per_m, at)
        };
        let zone = self.settings.dead_zone;
        let threshold = self.tick_s * (zone + (f - cover.value).abs());
        let (error, outside) = match self.erratum {
            Erratum::Pairing => {
                let inside = drive / (1.0 + h + threshold / zone);
                let beyond = (drive.abs() - threshold) / (1.0 + h);
                let error = if inside.abs() <= zone {
                    inside
                } else {
                    beyond.copysign(drive)
                };
                (error, error - error.clamp(-zone, zone))
            }
            Erratum::Argument => {
                let sat = (self.predicted / zone).clamp(-1.0, 1.0);
                let error = (drive - threshold * sat) / (1.0 + h);
                (error, error - zone * sat)
            }
        };
        self.predicted = observed + error;
        self.shape_a_per_m = grid.project(at - self.settings.gain * self.tick_s * outside * cover.slope);
        [self.shape_a_per_m, error]
    }
}
