//! The weights of a hysteresis law on line: min Σ λ^(t−s) (y_s − wᵀx_s)² + Σ ρ_i (w_i − w⁰_i)², w_i ≥ 0 but for the offset.
//!
//! x: what the output is linear in ([`LawModel::regressors`]), driven by the measured input alone, so that the estimate is that of a free
//! run. A sample adds x xᵀ to a Gram matrix; one sweep of coordinate descent follows, which keeps every weight within its bound and
//! cannot diverge: the cost falls with every coordinate. (Recursive least squares with weights clipped afterwards did diverge.)
//! What the motion does not tell stays where the prior holds it.
//! Source: coordinate descent for non-negative least squares: Franc, Hlaváč and Navara (2005); a law adapted by its weights:
//! Kuhnen and Janocha (1999), Tan and Baras, Automatica 40 (2004) 1469.

use anhyst_model::{HysteresisLaw, LawModel, LawModelState, ModelError};
use serde::{Deserialize, Serialize};

/// How a weight estimator believes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightBelief {
    /// Samples that the first weights are worth, each at the regressor's scale. Above 0.
    pub trust_samples: f64,
    /// Samples after which a measurement counts for 1/e; infinite: all count alike.
    pub memory_samples: f64,
}

impl Default for WeightBelief {
    fn default() -> Self {
        WeightBelief {
            trust_samples: 0.01,
            memory_samples: f64::INFINITY,
        }
    }
}

/// The weights of a law, and what they are to be multiplied with: lags that began with one weight keep one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Regression {
    /// Which free weight each of the law's weights is.
    tied: Vec<usize>,
    regressors: Vec<f64>,
    /// d output/d free weight; that of the offset, the first, is 1.
    pub x: Vec<f64>,
}

impl Regression {
    fn new(model: &LawModel) -> Self {
        let weights = model.weights();
        let lags = weights.len() - model.creep.len();
        let mut tied = vec![0];
        for (index, weight) in weights.iter().enumerate().skip(1) {
            let is_new = index <= lags || *weight != weights[index - 1];
            tied.push(tied[index - 1] + usize::from(is_new));
        }
        Regression {
            x: vec![0.0; tied.last().map_or(0, |last| last + 1)],
            regressors: Vec::with_capacity(weights.len()),
            tied,
        }
    }

    /// Looks at a state.
    pub fn look(&mut self, model: &LawModel, state: &LawModelState) {
        model.regressors(state, &mut self.regressors);
        self.x.fill(0.0);
        for (of, value) in self.tied.iter().zip(&self.regressors) {
            self.x[*of] += *value;
        }
    }

    /// The law's weights from the free ones.
    fn untie(&self, free: &[f64], weights: &mut [f64]) {
        for (own, of) in weights.iter_mut().zip(&self.tied) {
            *own = free[*of];
        }
    }
}

/// Weights and what the measurements have said of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WeightFit {
    /// Of the free weights.
    free: Vec<f64>,
    first: Vec<f64>,
    /// ρ.
    trust: Vec<f64>,
    /// Row by row.
    gram: Vec<f64>,
    moment: Vec<f64>,
    forget: f64,
    /// The law's.
    weights: Vec<f64>,
}

impl WeightFit {
    /// Begins with the law's weights. `input_scale`: half of the input's range, in its unit. Also what the law is to be regressed on.
    ///
    /// # Errors
    /// A law that is none.
    pub fn new(model: &LawModel, belief: &WeightBelief, input_scale: f64) -> Result<(Self, Regression), ModelError> {
        model.validate()?;
        let mut regression = Regression::new(model);
        let weights = model.weights();
        let count = regression.x.len();
        let mut free = vec![0.0; count];
        for (weight, of) in weights.iter().zip(&regression.tied) {
            free[*of] = *weight;
        }
        // A regressor's scale is how far it comes when the input goes through its range.
        let mut probe = model.rest();
        model.advance(&mut probe, input_scale);
        model.pass(&mut probe, f64::INFINITY);
        regression.look(model, &probe);
        let scaled = |x: &f64| belief.trust_samples * (x * x).max(f64::MIN_POSITIVE);
        let mut trust: Vec<f64> = regression.x.iter().map(scaled).collect();
        // A play wider than the range does not move; its weight is trusted as that of the line.
        let line = trust[1];
        let still = trust.iter_mut().skip(2).filter(|trust| **trust < 1e-9 * line);
        still.for_each(|trust| *trust = line);
        let fit = WeightFit {
            trust,
            gram: vec![0.0; count * count],
            moment: vec![0.0; count],
            forget: libm::exp(-1.0 / belief.memory_samples),
            first: free.clone(),
            free,
            weights,
        };
        Ok((fit, regression))
    }

    /// One measurement, and what each free weight is multiplied with in it.
    pub fn learn(&mut self, x: &[f64], measured: f64, regression: &Regression) {
        let count = self.free.len();
        for (i, row) in self.gram.chunks_exact_mut(count).enumerate() {
            for (sum, own) in row.iter_mut().zip(x) {
                *sum = self.forget * *sum + x[i] * own;
            }
            self.moment[i] = self.forget * self.moment[i] + x[i] * measured;
        }
        self.sweep();
        regression.untie(&self.free, &mut self.weights);
    }

    /// Every weight in turn to where the cost is least along it.
    fn sweep(&mut self) {
        let count = self.free.len();
        for i in 0..count {
            let row = &self.gram[i * count..(i + 1) * count];
            let of_all: f64 = row.iter().zip(&self.free).map(|(sum, weight)| sum * weight).sum();
            let power = row[i] + self.trust[i];
            let way = self.moment[i] - of_all + self.trust[i] * (self.first[i] - self.free[i]);
            let to = self.free[i] + way / power;
            self.free[i] = if i == 0 || to > 0.0 { to } else { 0.0 };
        }
    }

    /// What comes out at the present weights.
    pub fn output(&self, x: &[f64]) -> f64 {
        self.free.iter().zip(x).map(|(weight, x)| weight * x).sum()
    }

    /// The law's weights now, as [`LawModel::set_weights`] takes them.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }
}

/// One law whose weights follow the measurements.
#[derive(Clone, Debug)]
pub struct WeightEstimator {
    model: LawModel,
    state: LawModelState,
    regression: Regression,
    fit: WeightFit,
}

impl WeightEstimator {
    /// Begins with the law's weights, at rest at input 0. `input_scale`: half of the input's range, in its unit.
    ///
    /// # Errors
    /// A law that is none.
    pub fn new(model: LawModel, belief: &WeightBelief, input_scale: f64) -> Result<Self, ModelError> {
        let (fit, regression) = WeightFit::new(&model, belief, input_scale)?;
        Ok(WeightEstimator {
            state: model.rest(),
            model,
            regression,
            fit,
        })
    }

    /// A time passes and the input moves, without a measurement.
    pub fn advance(&mut self, passed_s: f64, input: f64) {
        self.model.pass(&mut self.state, passed_s);
        self.model.advance(&mut self.state, input);
    }

    /// The same, and what came out is measured. Not a number: as without.
    pub fn step(&mut self, passed_s: f64, input: f64, measured: f64) {
        self.advance(passed_s, input);
        if !measured.is_finite() {
            return;
        }
        self.regression.look(&self.model, &self.state);
        self.fit.learn(&self.regression.x, measured, &self.regression);
    }

    /// The law's weights now, as [`LawModel::set_weights`] takes them.
    pub fn weights(&self) -> &[f64] {
        self.fit.weights()
    }

    /// The law with its weights now.
    pub fn law(&self) -> LawModel {
        let mut law = self.model.clone();
        law.set_weights(self.weights());
        law
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::{Law, PlaySum};

    fn law(weights: [f64; 4]) -> LawModel {
        LawModel {
            offset: 0.0,
            slope: 0.0,
            laws: vec![Law::Plays(PlaySum::prandtl_ishlinskii(
                vec![0.0, 0.2, 0.5, 0.8],
                weights.to_vec(),
            ))],
            creep: Vec::new(),
        }
    }

    fn input(sample: i32) -> f64 {
        let angle = 0.02 * f64::from(sample);
        (0.6 + 0.4 * (0.13 * angle).sin()) * angle.sin()
    }

    /// Guards the estimate by the free run: weights 60 % wrong come to what plays, moved by hand here, were made with.
    #[test]
    fn wrong_weights_come_right() {
        let truth = [1.0, 0.5, 0.0, 0.3];
        let mut estimator = WeightEstimator::new(law([0.4, 0.8, 0.5, 0.48]), &WeightBelief::default(), 1.0).unwrap();
        let mut plays = [0.0_f64; 4];
        for sample in 0..20_000 {
            let v = input(sample);
            for (play, radius) in plays.iter_mut().zip([0.0, 0.2, 0.5, 0.8]) {
                *play = play.max(v - radius).min(v + radius);
            }
            let output: f64 = plays.iter().zip(truth).map(|(play, weight)| play * weight).sum();
            estimator.step(1e-3, v, 3.0 + output);
            assert!(estimator.weights()[1..].iter().all(|weight| *weight >= 0.0));
        }
        let found = estimator.weights();
        assert!((found[0] - 3.0).abs() < 1e-3, "{found:?}");
        // The line and the play of radius 0 are one.
        assert!((found[1] + found[2] - truth[0]).abs() < 5e-3, "{found:?}");
        for (own, truth) in found[3..].iter().zip(&truth[1..]) {
            assert!((own - truth).abs() < 5e-3, "{found:?}");
        }
    }

    /// Guards what is held: a play that the motion never reaches keeps its weight.
    #[test]
    fn what_does_not_move_is_held() {
        let mut estimator = WeightEstimator::new(law([0.4, 0.8, 0.5, 0.48]), &WeightBelief::default(), 1.0).unwrap();
        for sample in 0..5000 {
            let v = 0.3 * input(sample);
            estimator.step(1e-3, v, 0.7 * v);
        }
        assert!(
            (estimator.weights()[5] - 0.48).abs() < 1e-12,
            "{:?}",
            estimator.weights()
        );
        let held = estimator.weights().to_vec();
        estimator.step(1e-3, 0.1, f64::NAN);
        assert_eq!(estimator.weights(), held);
    }
}
