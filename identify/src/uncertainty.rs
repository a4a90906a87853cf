//! How well the data fix the five parameters, from the engine's covariance of what was searched.
//!
//! The derivatives by the searched numbers v (which part what one loop fixes from what it does not) become those by the parameters θ
//! as J_θ = J_v (dθ/dv)⁻¹; a_eff = a − αMs·s is a sum of parameters for small changes.

use anhyst_model::{Hysteresis, HysteresisParameter};
use nalgebra::DMatrix;

use crate::engine::Covariance;
use crate::residuals::Polished;

/// Step of the differences of θ(v), in the coordinates' own free numbers.
const DIFFERENCE_STEP: f64 = 1e-5;

/// What the data say about the free parameters.
#[derive(Clone, Debug)]
pub(crate) struct Uncertainty {
    pub free: Vec<HysteresisParameter>,
    /// Of the free parameters first.
    pub covariance: Covariance,
    pub effective_shape_standard_deviation_a_per_m: f64,
}

impl Uncertainty {
    pub fn of(fit: &Polished, hysteresis: &Hysteresis) -> Self {
        let free = fit.fitter.coordinates.free();
        let mut columns = fit.solution.columns.clone();
        by_parameters(fit, hysteresis, &free, &mut columns);
        let covariance = Covariance::of(&columns, &[], &fit.solution.residual, &fit.fitter.blocks);
        let slope = hysteresis.anhysteretic.initial_slope();
        let of_effective_shape = |parameter: &HysteresisParameter| match parameter {
            HysteresisParameter::SaturationMagnetization => -hysteresis.coupling * slope,
            HysteresisParameter::Shape => 1.0,
            HysteresisParameter::Coupling => -hysteresis.saturation_magnetization_a_per_m * slope,
            HysteresisParameter::Pinning | HysteresisParameter::Reversibility => 0.0,
        };
        let weights: Vec<f64> = free.iter().map(of_effective_shape).collect();
        Uncertainty {
            effective_shape_standard_deviation_a_per_m: covariance.standard_deviation_along(&weights),
            free,
            covariance,
        }
    }

    /// None for a parameter that was held.
    pub fn standard_deviation(&self, parameter: HysteresisParameter) -> Option<f64> {
        let index = self.free.iter().position(|free| *free == parameter)?;
        Some(self.covariance.standard_deviation(index))
    }

    /// Of the free parameters.
    pub fn correlation(&self) -> Vec<Vec<f64>> {
        let all = 0..self.free.len();
        let row = |i| all.clone().map(|j| self.covariance.correlation(i, j)).collect();
        all.clone().map(row).collect()
    }
}

/// Turns derivatives by the searched numbers into those by the free parameters, of which there are as many.
fn by_parameters(fit: &Polished, hysteresis: &Hysteresis, free: &[HysteresisParameter], columns: &mut [Vec<f64>]) {
    let numbers = fit.material_numbers();
    let moved = |index: usize| -> Option<Vec<f64>> {
        let coordinate = &fit.fitter.all[index];
        let mut moved = numbers.to_vec();
        // Beyond a bound is as good as within it.
        moved[index] += DIFFERENCE_STEP * coordinate.slope(numbers[index]);
        let by = moved[index] - numbers[index];
        let there = fit.fitter.coordinates.hysteresis(&moved)?;
        Some(
            free.iter()
                .map(|own| (own.of(&there) - own.of(hysteresis)) / by)
                .collect(),
        )
    };
    let Some(slopes) = (0..numbers.len()).map(moved).collect::<Option<Vec<_>>>() else {
        return;
    };
    let size = free.len();
    let Some(inverse) = DMatrix::from_fn(size, size, |row, column| slopes[column][row]).try_inverse() else {
        return;
    };
    let (own, _) = columns.split_at_mut(size);
    for row in 0..own[0].len() {
        let before: Vec<f64> = own.iter().map(|column| column[row]).collect();
        for (index, column) in own.iter_mut().enumerate() {
            column[row] = before
                .iter()
                .enumerate()
                .map(|(k, slope)| slope * inverse[(k, index)])
                .sum();
        }
    }
}
