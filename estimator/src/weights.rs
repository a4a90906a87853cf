//! The weights of a hysteresis law on line: min Σ λ^(t−s) (y_s − wᵀx_s)² + Σ ρ_i (w_i − w⁰_i)², w_i ≥ 0 but for the offset.
//!
//! x: what the output is linear in ([`LawModel::regressors`]), driven by the measured input alone, so that the estimate is that of a free
//! run. A sample adds x xᵀ to a Gram matrix; one sweep of coordinate descent follows, which keeps every weight within its bound and
//! cannot diverge: the cost falls with every coordinate. (Recursive least squares with weights clipped afterwards did diverge.)
//! What the motion does not tell stays where the prior holds it; [`WeightEstimator::told`] says how much of each weight came from data.
//! Source: coordinate descent for non-negative least squares: Franc, Hlaváč and Navara (2005); a law adapted by its weights:
//! Kuhnen and Janocha (1999), Tan and Baras, Automatica 40 (2004) 1469.

use anhyst_model::{HysteresisLaw, LawModel, LawModelState, ModelError};

/// How a weight estimator believes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightSettings {
    /// Samples that the first weights are worth, each at the regressor's scale. Above 0.
    pub trust_samples: f64,
    /// Samples after which a measurement counts for 1/e; infinite: all count alike.
    pub memory_samples: f64,
}

impl Default for WeightSettings {
    fn default() -> Self {
        WeightSettings {
            trust_samples: 0.01,
            memory_samples: f64::INFINITY,
        }
    }
}

/// One law whose weights follow the measurements.
#[derive(Clone, Debug)]
pub struct WeightEstimator {
    model: LawModel,
    state: LawModelState,
    /// Which free weight each of the law's weights is: lags that began with one weight keep one.
    tied: Vec<usize>,
    /// Of the free weights.
    free: Vec<f64>,
    first: Vec<f64>,
    /// ρ.
    trust: Vec<f64>,
    /// Row by row.
    gram: Vec<f64>,
    moment: Vec<f64>,
    forget: f64,
    regressors: Vec<f64>,
    x: Vec<f64>,
    weights: Vec<f64>,
}

impl WeightEstimator {
    /// Begins with the law's weights, at rest at input 0. `input_scale`: half of the input's range, in its unit.
    ///
    /// # Errors
    /// A law that is none.
    pub fn new(model: LawModel, settings: &WeightSettings, input_scale: f64) -> Result<Self, ModelError> {
        model.validate()?;
        let law_weights = model.weights();
        let lags = law_weights.len() - model.creep.len();
        let mut tied = Vec::new();
        let mut weights: Vec<f64> = Vec::new();
        for (index, weight) in law_weights.iter().enumerate() {
            if index <= lags || *weight != law_weights[index - 1] {
                weights.push(*weight);
            }
            tied.push(weights.len() - 1);
        }
        let state = model.rest();
        let count = weights.len();
        let mut estimator = WeightEstimator {
            state,
            trust: vec![0.0; count],
            gram: vec![0.0; count * count],
            moment: vec![0.0; count],
            forget: (-1.0 / settings.memory_samples).exp(),
            regressors: Vec::with_capacity(law_weights.len()),
            x: vec![0.0; count],
            first: weights.clone(),
            tied,
            free: weights,
            weights: law_weights,
            model,
        };
        // A regressor's scale is how far it comes when the input goes through its range.
        let mut probe = estimator.model.rest();
        estimator.model.advance(&mut probe, input_scale);
        estimator.model.pass(&mut probe, f64::INFINITY);
        regress(
            &estimator.model,
            &probe,
            &estimator.tied,
            &mut estimator.regressors,
            &mut estimator.x,
        );
        for (trust, x) in estimator.trust.iter_mut().zip(&estimator.x) {
            *trust = settings.trust_samples * (x * x).max(f64::MIN_POSITIVE);
        }
        // A play wider than the range does not move; its weight is trusted as that of the line.
        let line = estimator.trust[1];
        estimator
            .trust
            .iter_mut()
            .skip(2)
            .filter(|trust| **trust < 1e-9 * line)
            .for_each(|trust| *trust = line);
        Ok(estimator)
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
        regress(&self.model, &self.state, &self.tied, &mut self.regressors, &mut self.x);
        let count = self.free.len();
        for (i, row) in self.gram.chunks_exact_mut(count).enumerate() {
            for (sum, x) in row.iter_mut().zip(&self.x) {
                *sum = self.forget * *sum + self.x[i] * x;
            }
            self.moment[i] = self.forget * self.moment[i] + self.x[i] * measured;
        }
        self.sweep();
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
        for (own, of) in self.weights.iter_mut().zip(&self.tied) {
            *own = self.free[*of];
        }
    }

    /// The law's weights now, as [`LawModel::set_weights`] takes them.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The law with its weights now.
    pub fn law(&self) -> LawModel {
        let mut law = self.model.clone();
        law.set_weights(&self.weights);
        law
    }

    /// Of each of the law's weights the share that came from data: 0 the prior's, 1 all.
    pub fn told(&self) -> impl Iterator<Item = f64> + '_ {
        let count = self.free.len();
        self.tied.iter().map(move |of| {
            let power = self.gram[of * count + of];
            power / (power + self.trust[*of])
        })
    }
}

/// What each free weight is multiplied with.
fn regress(model: &LawModel, state: &LawModelState, tied: &[usize], regressors: &mut Vec<f64>, x: &mut [f64]) {
    model.regressors(state, regressors);
    x.fill(0.0);
    for (of, value) in tied.iter().zip(regressors) {
        x[*of] += *value;
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
        let mut estimator = WeightEstimator::new(law([0.4, 0.8, 0.5, 0.48]), &WeightSettings::default(), 1.0).unwrap();
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

    /// Guards what is held: a play that the motion never reaches keeps its weight, and says that nobody told.
    #[test]
    fn what_does_not_move_is_held() {
        let mut estimator = WeightEstimator::new(law([0.4, 0.8, 0.5, 0.48]), &WeightSettings::default(), 1.0).unwrap();
        for sample in 0..5000 {
            let v = 0.3 * input(sample);
            estimator.step(1e-3, v, 0.7 * v);
        }
        let told: Vec<f64> = estimator.told().collect();
        assert!(
            (estimator.weights()[5] - 0.48).abs() < 1e-12 && told[5] == 0.0,
            "{told:?}"
        );
        assert!(told[1] > 0.99, "{told:?}");
        let held = estimator.weights().to_vec();
        estimator.step(1e-3, 0.1, f64::NAN);
        assert_eq!(estimator.weights(), held);
    }
}
