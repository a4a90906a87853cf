//! q_i = ln(θ_i/θ_i0)/d_i for Ms, a, k and c, q_i = (α − α_0)/(d_i |α_0|): the numbers in which the parameters are searched.
//!
//! θ_0 start, d its standard deviation as a share, so that q starts at 0 with deviation 1. What a loop fixes best are products
//! and quotients (its initial slope c·Ms/a, its height, its width): sums of logarithms, which a linear step keeps, where a
//! step linear in θ leaves them by its square. Logarithms keep positive parameters positive, too. α may have either
//! sign and stays linear. A parameter with d = 0 never moves.

use crate::MultiParameterSettings;
use anhyst_model::{Hysteresis, HysteresisParameter};
use serde::{Deserialize, Serialize};

/// Ms, a, k, c and α.
pub(crate) const COUNT: usize = HysteresisParameter::COUNT;

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Axis {
    /// d_i, and for α its product with |α_0|.
    unit: f64,
    is_logarithmic: bool,
    range: (f64, f64),
}

/// All five, in the order of [`HysteresisParameter::ALL`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Coordinates {
    axes: [Axis; COUNT],
}

/// Where a step has led.
pub(super) struct Moved {
    pub hysteresis: Hysteresis,
    /// Change of all five parameters, in their units.
    pub change: [f64; COUNT],
}

impl Coordinates {
    pub fn new(settings: &MultiParameterSettings, start: &Hysteresis) -> Self {
        let (said, values) = (settings.parameters(), start.parameters());
        let axes = HysteresisParameter::ALL.map(|parameter| {
            let (own, value) = (said[parameter.index()], values[parameter.index()]);
            let is_logarithmic = parameter != HysteresisParameter::Coupling;
            let (low, high) = MultiParameterSettings::range(own, value, is_logarithmic);
            Axis {
                unit: if is_logarithmic {
                    own.share
                } else {
                    own.share * value.abs()
                },
                is_logarithmic,
                range: if parameter == HysteresisParameter::Reversibility {
                    (low, high.min(0.99).max(value))
                } else {
                    (low, high)
                },
            }
        });
        Self { axes }
    }

    /// dθ_i/dq_i at a material.
    pub fn units(&self, hysteresis: &Hysteresis) -> [f64; COUNT] {
        let values = hysteresis.parameters();
        std::array::from_fn(|index| {
            let axis = &self.axes[index];
            if axis.is_logarithmic {
                axis.unit * values[index]
            } else {
                axis.unit
            }
        })
    }

    /// True if a parameter that is estimated stands at an end of its range.
    pub fn at_edge(&self, hysteresis: &Hysteresis) -> bool {
        let values = hysteresis.parameters();
        let mut all = self.axes.iter().zip(values);
        all.any(|(axis, value)| axis.unit > 0.0 && (value <= axis.range.0 || value >= axis.range.1))
    }

    /// The material a step of q away, within the ranges; a step to an invalid material is halved, at last not made.
    pub fn moved(&self, from: &Hysteresis, step: &[f64; COUNT]) -> Moved {
        let old = from.parameters();
        let mut part = 1.0;
        for _ in 0..6 {
            let new = std::array::from_fn(|index| {
                let (axis, value) = (&self.axes[index], old[index]);
                let by = axis.unit * part * step[index];
                if by == 0.0 {
                    return value;
                }
                let moved = if axis.is_logarithmic {
                    value * libm::exp(by)
                } else {
                    value + by
                };
                moved.max(axis.range.0).min(axis.range.1)
            });
            let hysteresis = from.with_parameters(new);
            if hysteresis.validate().is_ok() {
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
}
