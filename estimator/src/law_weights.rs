//! Another hysteresis law than the domain wall's: y = y₀ + Σ w_i P x_i, its weights w learned from the measured y.
//!
//! x_i: what the weights are multiplied with (plays, cells, lags), from rest; P the rod, through which each x_i goes by itself, so that
//! the regression is that of the free run of the whole chain and a change of weights needs no state to be moved. y₀ the sensor's zero,
//! which goes through no rod and to nobody. While the input stands, nothing is learnt and nothing forgotten.
//! Every tick tells one weight; whoever inverts the law has all of them after as many ticks as there are.
//! Source: `weights.rs`.

use crate::law::{Correction, is_credible};
use crate::taught::{Taught, Weight};
use crate::weights::{Regression, WeightBelief, WeightFit};
use crate::{EstimatorError, LawSettings, WeightSettings};
use anhyst_ipc::Invalid;
use anhyst_model::{HysteresisLaw, LawModel, LawModelState, MaterialLaw};
use serde::{Deserialize, Serialize};

/// The input's recent ends, which creep towards where it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Motion {
    low: f64,
    high: f64,
    /// Of the way, in a tick.
    share: f64,
    least: f64,
}

impl Motion {
    fn follow(&mut self, input: f64) {
        self.low = input.min(self.low + self.share * (input - self.low));
        self.high = input.max(self.high + self.share * (input - self.high));
    }

    fn informs(&self) -> bool {
        self.high - self.low > self.least
    }
}

/// See above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct LawWeights {
    law: LawModel,
    state: LawModelState,
    tick_s: f64,
    regression: Regression,
    at_rest: Vec<f64>,
    /// From rest.
    columns: Vec<f64>,
    /// The columns behind the rod, and 1 for the zero.
    seen: Vec<f64>,
    fit: WeightFit,
    motion: Option<Motion>,
    /// Stands where a shape parameter is expected.
    scale: f64,
    told: u64,
}

impl LawWeights {
    /// At rest. Without motion nothing is learnt: of fixed weights.
    ///
    /// # Errors
    /// A law of estimation that is for something else.
    pub fn new(settings: &LawSettings, of: &MaterialLaw, scale: f64, tick_s: f64) -> Result<Self, EstimatorError> {
        let (own, learns) = match settings {
            LawSettings::Weights(own) => (*own, true),
            LawSettings::FixedWeights => (WeightSettings::default(), false),
            _ => {
                let sentence = "this estimates a of the domain wall law, and the material has another law: take Weights() or FixedWeights";
                return Err(Invalid::new("law", sentence).into());
            }
        };
        let belief = WeightBelief {
            trust_samples: own.trust_samples,
            memory_samples: own.memory_s / tick_s,
        };
        let law = LawModel {
            offset: 0.0,
            ..of.model.clone()
        };
        let (fit, mut regression) = WeightFit::new(&law, &belief, of.input_scale())?;
        let state = law.rest();
        regression.look(&law, &state);
        let at_rest = regression.x.clone();
        let motion = Motion {
            low: 0.0,
            high: 0.0,
            share: -libm::expm1(-tick_s / own.memory_s),
            least: own.least_motion * 2.0 * of.input_scale(),
        };
        Ok(Self {
            columns: vec![0.0; at_rest.len()],
            seen: vec![0.0; at_rest.len()],
            at_rest,
            regression,
            law,
            state,
            tick_s,
            fit,
            motion: learns.then_some(motion),
            scale,
            told: 0,
        })
    }

    /// Follows the input to the next tick.
    pub fn advance(&mut self, input: f64) {
        self.law.pass(&mut self.state, self.tick_s);
        self.law.advance(&mut self.state, input);
        self.regression.look(&self.law, &self.state);
        let all = self.columns.iter_mut().zip(&self.regression.x).zip(&self.at_rest);
        for ((own, x), rest) in all {
            *own = x - rest;
        }
        if let Some(motion) = &mut self.motion {
            motion.follow(input);
        }
    }

    /// x at this tick, from rest; 0 for the zero.
    pub fn columns(&self) -> &[f64] {
        &self.columns
    }

    /// What is measured at the present weights, of columns behind the rod.
    pub fn output(&self, displacements_m: &[f64]) -> f64 {
        // The zero's column is 0 there.
        self.fit.output(displacements_m) + self.fit.weights()[0]
    }

    /// Learns from a measurement.
    pub fn learn(&mut self, displacements_m: &[f64], measured_m: f64) -> Taught {
        let predicted_m = self.output(displacements_m);
        let measured = is_credible(measured_m);
        let adapts = measured && self.motion.is_some_and(|motion| motion.informs());
        if adapts {
            self.seen.copy_from_slice(displacements_m);
            self.seen[0] = 1.0;
            self.fit.learn(&self.seen, measured_m, &self.regression);
        }
        let weights = self.fit.weights();
        let index = self.told % weights.len() as u64;
        self.told += 1;
        let error_m = if measured { predicted_m - measured_m } else { 0.0 };
        Taught {
            correction: Correction {
                shape_a_per_m: self.scale,
                output_error_m: error_m,
                predicted_output_m: predicted_m,
                lower_cover_m: predicted_m,
                upper_cover_m: predicted_m,
                adapting: adapts,
                held: self.motion.is_some() && !adapts,
                fixed: self.motion.is_none(),
                ..Correction::default()
            },
            magnetization_a_per_m: self.fit.output(&self.columns),
            weight: Some(Weight {
                index,
                value: weights[index as usize],
            }),
            ..Taught::default()
        }
    }
}
