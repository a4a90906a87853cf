//! q̂⁺ = q̂ + Π K(y − ŷ),  K = PΠφ/S,  S = r + φᵀΠPΠφ,  P⁺ = P − S K Kᵀ,  r = σ² + β max(φᵀΠPΠφ, s² − σ²)
//! x̂⁺ = x̂ + (∂x/∂θ)(θ̂⁺ − θ̂),  each block of ticks P ← E P E + (1 − E²)
//!
//! θ any of [Ms, a, k, α, c], q their scaled logarithms (`coordinates.rs`), P covariance of q, y measured and ŷ predicted
//! displacement (m), φ = ∂ŷ/∂q exact along the whole history, σ noise of the sensor (m), s rms of y − ŷ in the recent past (m), Π
//! the directions of q that the recent motion tells (`directions.rs`), x magnetization and the rod's state, E = diag e_i the
//! memory of each parameter. Recursive Gauss-Newton, that is the extended Kalman filter. It carries a single model: when θ̂ is
//! corrected, the model's state is moved by its own sensitivities to where a model with the new parameters would be.
//!
//! **What is no noise** is the same at the next sample: the error of the tangent far from the truth, and what no parameter
//! explains (an effect that is not modelled, hum). Counted as independent it makes P small while θ̂ is wrong. With β times the
//! larger of both in r, an e-fold of what is known takes β samples at least, and a wrong model makes the law slow. On a true model
//! both vanish.
//! **What the motion does not tell is held**: neither θ̂ nor P moves along a direction outside Π, but for the drift, which brings P
//! back to what was known at the start, never beyond.
//! Assumptions: field, rod and magnetostriction known. Of known effects, the sensor's that are not linear and a load that
//! stiffens are in ŷ and not in φ; creep and sensor are not moved when θ̂ is: they follow in their own time.
//! Source: Jazwinski, Stochastic Processes and Filtering Theory (1970), chapter 8; Π and r are this project's.

mod coordinates;
mod directions;

use crate::law::is_credible;
use crate::{Correction, EstimatorError, Excitation, MultiParameterSettings};
use anhyst_model::{Hysteresis, HysteresisParameter, Magnetostriction, SensitiveState};
use coordinates::{COUNT, Coordinates};
use directions::{BLOCK, Directions};
use serde::{Deserialize, Serialize};

/// A value and its derivatives by all five parameters.
pub(crate) const COLUMNS: usize = 1 + COUNT;
const SHAPE: usize = HysteresisParameter::Shape.index();

/// Share of σ² by which s² scatters, so that noise is not taken for a misfit.
const SCATTER: f64 = 1.1;

/// What is known of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterEstimates {
    /// The material at the estimate.
    pub hysteresis: Hysteresis,
    /// Standard deviations in the order of [`HysteresisParameter::ALL`], each in its unit; 0 for those held.
    pub deviations: [f64; COUNT],
    /// Directions of the parameters that the recent motion tells.
    pub informed_directions: u32,
}

/// The model with its derivatives, and the law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct MultiParameter {
    coordinates: Coordinates,
    noise_variance_m2: f64,
    annealing_samples: f64,
    /// e_i of a block.
    keeps: [f64; COUNT],
    /// Of s², in a tick.
    keep: f64,
    misfit_m2: f64,
    covariance: [[f64; COUNT]; COUNT],
    directions: Directions,
    ticks: u32,
    hysteresis: Hysteresis,
    state: SensitiveState,
    columns: [f64; COLUMNS],
}

/// What one measurement has taught.
pub(crate) struct Learned {
    pub correction: Correction,
    pub excitation: Excitation,
    pub estimates: ParameterEstimates,
    /// Of all five parameters, in their units: what stands behind the model is to move by its derivatives times this.
    pub change: [f64; COUNT],
}

impl MultiParameter {
    /// A demagnetised material; `memory_s` is that of the excitation.
    ///
    /// # Errors
    /// A start that is no material.
    pub fn new(
        settings: &MultiParameterSettings,
        material: Hysteresis,
        memory_s: f64,
        tick_s: f64,
    ) -> Result<Self, EstimatorError> {
        let hysteresis = material.with_shape(settings.start_a_per_m);
        hysteresis.validate()?;
        let keeps = settings.parameters().map(|own| {
            let rate_per_s = if own.share > 0.0 {
                (own.drift / own.share).powi(2)
            } else {
                0.0
            };
            libm::exp(-0.5 * rate_per_s * f64::from(BLOCK) * tick_s)
        });
        Ok(Self {
            coordinates: Coordinates::new(settings, &hysteresis),
            noise_variance_m2: settings.noise_m * settings.noise_m,
            annealing_samples: settings.annealing_samples,
            keeps,
            keep: libm::exp(-tick_s / memory_s),
            misfit_m2: 0.0,
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)))),
            directions: Directions::new(memory_s, settings.noise_m, settings.worst_deviation, tick_s),
            ticks: 0,
            hysteresis,
            state: SensitiveState::default(),
            columns: [0.0; COLUMNS],
        })
    }

    /// Follows the field to the next tick; M and ∂M/∂θ.
    pub fn advance(&mut self, field_a_per_m: f64, pinning_factor: f64) {
        let hysteresis = self.hysteresis.pinned(pinning_factor);
        self.state = hysteresis.advance_with_sensitivities(self.state, field_a_per_m);
        self.columns[0] = self.state.magnetization_a_per_m;
        self.columns[1..].copy_from_slice(&self.state.derivatives);
    }

    /// M (A/m) and ∂M/∂θ at this tick.
    pub fn columns(&self) -> &[f64] {
        &self.columns
    }

    /// λ and ∂λ/∂θ of M and ∂M/∂θ. λ keeps the Ms that it was measured with, so Ms acts through M alone.
    pub fn strains(law: &Magnetostriction, saturation_a_per_m: f64, magnetizations: &[f64], strains: &mut [f64]) {
        let slope = law.slope(magnetizations[0], saturation_a_per_m);
        for (strain, magnetization) in strains.iter_mut().zip(magnetizations) {
            *strain = slope * magnetization;
        }
        strains[0] = law.strain(magnetizations[0], saturation_a_per_m);
    }

    /// M at this tick, after the correction, A/m.
    pub fn magnetization_a_per_m(&self) -> f64 {
        self.state.magnetization_a_per_m
    }

    /// Learns from ŷ and ∂ŷ/∂θ (`outputs`) and a measurement, m.
    pub fn correct(&mut self, outputs: &[f64], measured_m: f64) -> Learned {
        let units = self.coordinates.units(&self.hysteresis);
        let slopes: [f64; COUNT] = std::array::from_fn(|index| outputs[1 + index] * units[index]);
        let measured = is_credible(measured_m);
        self.directions.observe(&slopes, measured);
        self.ticks += 1;
        if self.ticks == BLOCK {
            self.ticks = 0;
            self.directions.look();
            self.wander();
        }
        let held = !measured || self.directions.count() == 0;
        let mut change = [0.0; COUNT];
        let error_m = if measured { measured_m - outputs[0] } else { 0.0 };
        if measured {
            self.misfit_m2 = self.keep * self.misfit_m2 + (1.0 - self.keep) * error_m * error_m;
        }
        if !held {
            let step = self.step(&slopes, error_m);
            change = self.moved(&step);
        }
        let shape_a_per_m = self.hysteresis.shape_a_per_m;
        let deviations: [f64; COUNT] =
            std::array::from_fn(|index| units[index] * self.covariance[index][index].max(0.0).sqrt());
        let correction = Correction {
            shape_a_per_m,
            output_error_m: -error_m,
            predicted_output_m: outputs[0],
            lower_cover_m: outputs[0],
            upper_cover_m: outputs[0],
            slope_m_per_a_per_m: outputs[1 + SHAPE],
            standard_deviation_a_per_m: deviations[SHAPE],
            adapting: change != [0.0; COUNT],
            at_edge: self.coordinates.at_edge(&self.hysteresis),
            held,
            fixed: false,
        };
        let information = if units[SHAPE] > 0.0 {
            self.directions.information(SHAPE) / (units[SHAPE] * units[SHAPE])
        } else {
            0.0
        };
        let excitation = Excitation {
            information_per_a2_per_m2: information,
            deviation_bound_a_per_m: 1.0 / information.sqrt(),
            informed: self.directions.count() > 0,
            ..Excitation::default()
        };
        Learned {
            correction,
            excitation,
            estimates: ParameterEstimates {
                hysteresis: self.hysteresis,
                deviations,
                informed_directions: self.directions.count(),
            },
            change,
        }
    }

    /// Π K(y − ŷ); P follows.
    fn step(&mut self, slopes: &[f64; COUNT], error_m: f64) -> [f64; COUNT] {
        let told = self.directions.along(slopes);
        let seen: [f64; COUNT] = std::array::from_fn(|row| dot(&self.covariance[row], &told));
        let known = dot(&seen, &told);
        let misfit = self.misfit_m2 - SCATTER * self.noise_variance_m2;
        let variance = self.noise_variance_m2 + self.annealing_samples * known.max(misfit).max(0.0);
        let expected = variance + known;
        for (row, one) in self.covariance.iter_mut().zip(&seen) {
            for (entry, other) in row.iter_mut().zip(&seen) {
                *entry -= one * other / expected;
            }
        }
        self.directions.along(&seen.map(|seen| seen / expected * error_m))
    }

    /// Moves the estimate, and the model's state with it.
    fn moved(&mut self, step: &[f64; COUNT]) -> [f64; COUNT] {
        let moved = self.coordinates.moved(&self.hysteresis, step);
        let by = dot(&self.state.derivatives, &moved.change);
        // A first-order move may not leave what the material can hold.
        let saturation = moved.hysteresis.saturation_magnetization_a_per_m;
        let magnetization = &mut self.state.magnetization_a_per_m;
        *magnetization = (*magnetization + by).max(-saturation).min(saturation);
        self.hysteresis = moved.hysteresis;
        moved.change
    }

    /// What a block of ticks lets be forgotten.
    fn wander(&mut self) {
        for (i, row) in self.covariance.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry *= self.keeps[i] * self.keeps[j];
            }
            row[i] += 1.0 - self.keeps[i] * self.keeps[i];
        }
    }
}

fn dot(one: &[f64; COUNT], other: &[f64; COUNT]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}
