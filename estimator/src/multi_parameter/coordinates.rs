//! q_i = ln(θ_i/θ_i0)/(d_i/θ_i0) for Ms, a, k and c, q_i = (α − α_0)/d_i: the numbers in which the parameters are
//! searched.
//!
//! θ_0 start, d its standard deviation, so that q starts at 0 with deviation 1. What a loop fixes best are products and
//! quotients (its initial slope c·Ms/a, its height, its width): sums of logarithms, which a linear step keeps, where a
//! step linear in θ leaves them by its square. Logarithms keep positive parameters positive, too. α may have either
//! sign and stays linear.

use super::output::COUNT;
use super::settings::MultiParameterSettings;
use anhyst_model::{Hysteresis, HysteresisParameter};

/// One estimated parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    parameter: HysteresisParameter,
    /// d_i, in the parameter's unit.
    deviation: f64,
    /// d_i/θ_i0, or none where the axis is linear.
    logarithmic: Option<f64>,
    range: (f64, f64),
}

/// The estimated parameters, in the order of the settings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coordinates {
    axes: Vec<Axis>,
}

/// Where a step has led.
pub(super) struct Moved {
    pub hysteresis: Hysteresis,
    /// Change of all five parameters, in their units.
    pub change: [f64; COUNT],
}

impl Coordinates {
    pub fn new(settings: &MultiParameterSettings, nominal: &Hysteresis) -> Self {
        let axes = settings.parameters.iter().map(|estimated| Axis {
            parameter: estimated.parameter,
            deviation: estimated.start_deviation,
            logarithmic: (estimated.parameter != HysteresisParameter::Coupling)
                .then(|| estimated.start_deviation / estimated.parameter.of(nominal)),
            range: estimated.range,
        });
        Self { axes: axes.collect() }
    }

    pub fn count(&self) -> usize {
        self.axes.len()
    }

    pub fn parameters(&self) -> impl Iterator<Item = HysteresisParameter> {
        self.axes.iter().map(|axis| axis.parameter)
    }

    /// dθ_i/dq_i of axis `index` at a material.
    pub fn unit(&self, index: usize, hysteresis: &Hysteresis) -> f64 {
        let axis = &self.axes[index];
        axis.logarithmic
            .map_or(axis.deviation, |share| share * axis.parameter.of(hysteresis))
    }

    /// d_i of axis `index`.
    pub fn start_deviation(&self, index: usize) -> f64 {
        self.axes[index].deviation
    }

    /// Whether axis `index` stands at an edge of its range.
    pub fn at_edge(&self, index: usize, hysteresis: &Hysteresis) -> bool {
        let axis = &self.axes[index];
        let value = axis.parameter.of(hysteresis);
        value <= axis.range.0 || value >= axis.range.1
    }

    /// The material a step of q away, within the ranges; a step to an invalid material is halved, at last not made.
    pub fn moved(&self, from: &Hysteresis, step: &[f64; COUNT]) -> Moved {
        let mut part = 1.0;
        for _ in 0..6 {
            let hysteresis = self.within_ranges(from, step, part);
            if hysteresis.validate().is_ok() {
                let (old, new) = (from.parameters(), hysteresis.parameters());
                return Moved {
                    hysteresis,
                    change: std::array::from_fn(|index| new[index] - old[index]),
                };
            }
            part *= 0.5;
        }
        Moved {
            hysteresis: *from,
            change: [0.0; COUNT],
        }
    }

    fn within_ranges(&self, from: &Hysteresis, step: &[f64; COUNT], part: f64) -> Hysteresis {
        let mut parameters = from.parameters();
        for (axis, step) in self.axes.iter().zip(step) {
            let value = &mut parameters[axis.parameter.index()];
            let moved = match axis.logarithmic {
                Some(share) => *value * libm::exp(share * part * step),
                None => *value + axis.deviation * part * step,
            };
            let (low, high) = axis.range;
            *value = moved.max(low).min(high);
        }
        from.with_parameters(parameters)
    }
}
