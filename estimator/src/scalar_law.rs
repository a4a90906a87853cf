//! ẏ_s = −k y_s + k y,  ŷ′ = −k ŷ + k f(u, θ̂) − k (ε + a*) sat(ỹ/ε),  θ̂′ = −γ ỹ_ε φ*,  ỹ = ŷ − y_s: the paper's scalar
//! form in the loop.
//!
//! y measured displacement, f(u, θ) displacement that the bank predicts through the known rod, y_s state of a plant of
//! (23) that the measured displacement drives (m); k its decay (1/s). This is `scalar.rs` with f = Y and time counted
//! in 1/k, in which states, f, ε and a* are all metres. Beside the folded law it has the paper's own ε in the threshold
//! and its covers over all of Θ, without a window: the original, to compare with. It stops where condition (19) stops
//! holding: with Langevin an estimate above the truth comes down only as far as the chord of f over Θ allows, some 5 to
//! 30 A/m on a cut (`the_scalar_law_stops_short_from_above`, `tests/laws_in_the_loop.rs`).
//! Source: the paper's (14)-(18), (23).

use crate::law::is_credible;
use crate::{Correction, Law, Prediction, Scalar, ScalarLawSettings, ScalarPlant, ScalarSettings};
use serde::{Deserialize, Serialize};

/// The scalar form on displacements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalarLaw {
    /// kT: a tick in the unit of time.
    tick: f64,
    plant: ScalarPlant,
    law: Scalar,
}

impl ScalarLaw {
    /// The law at its start, for a rod at rest.
    pub fn new(settings: &ScalarLawSettings, tick_s: f64) -> Self {
        let tick = settings.decay_per_s * tick_s;
        let scaled = ScalarSettings {
            start_a_per_m: settings.start_a_per_m,
            decay_per_s: 1.0,
            dead_zone: settings.dead_zone_m,
            gain: settings.gain() / settings.decay_per_s,
        };
        Self {
            tick,
            plant: ScalarPlant::new(scaled.decay_per_s),
            law: Scalar::new(scaled, settings.members, tick),
        }
    }
}

impl Law for ScalarLaw {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        let (grid, outputs) = (prediction.grid, prediction.displacements_m);
        if !is_credible(measured_displacement_m) {
            return self.law.hold(grid, outputs);
        }
        let observed = self.plant.advance(measured_displacement_m, self.tick);
        self.law.correct(grid, outputs, observed)
    }

    fn shape_a_per_m(&self) -> f64 {
        self.law.shape_a_per_m()
    }
}
