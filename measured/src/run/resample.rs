//! Series put on a uniform clock: a cubic through the four samples around each tick.
//!
//! y(k) = Σ_j y_j Π_{i≠j} (k − u_i)/(u_j − u_i) over four neighbours, u their places in ticks (Lagrange). What drives an actuator is kept between its two
//! neighbours: beside a step the cubic overshoots, and a hysteresis would take that for a reversal.

use super::record::{INPUTS, OUTPUTS, Series};
use crate::quantity::Quantity;

/// Where measured samples stand, in ticks; increasing.
pub(super) struct Resampling {
    places: Vec<f64>,
}

impl Resampling {
    pub fn of(places: Vec<f64>) -> Self {
        Resampling { places }
    }

    /// Number of samples on the clock.
    pub fn samples(&self) -> usize {
        self.places.last().map_or(0, |last| last.round() as usize + 1)
    }

    /// The last measured sample not behind a tick.
    pub fn before(&self, tick: usize) -> usize {
        self.places
            .partition_point(|place| *place <= tick as f64)
            .saturating_sub(1)
    }

    pub fn of_series(&self, quantity: Quantity, values: &[f64]) -> Vec<f64> {
        let cubic = OUTPUTS.contains(&quantity);
        (0..self.samples()).map(|tick| self.at(tick, values, cubic)).collect()
    }

    fn at(&self, tick: usize, values: &[f64], cubic: bool) -> f64 {
        let (before, at) = (self.before(tick), tick as f64);
        if self.places[before] == at {
            return values[before];
        }
        let first = before.saturating_sub(1).min(values.len().saturating_sub(4));
        let four = first..values.len().min(first + 4);
        let weight = |j: usize| -> f64 {
            let others = four.clone().filter(|i| *i != j);
            others
                .map(|i| (at - self.places[i]) / (self.places[j] - self.places[i]))
                .product()
        };
        let value = four.clone().map(|j| values[j] * weight(j)).sum();
        let after = values[(before + 1).min(values.len() - 1)];
        if cubic {
            value
        } else {
            value.clamp(values[before].min(after), values[before].max(after))
        }
    }

    /// Energy of the third differences of all series, each in parts of its own range: what is sampled elsewhere than believed is rough.
    pub fn roughness(&self, series: &Series) -> f64 {
        let all = INPUTS.into_iter().chain(OUTPUTS);
        let of = |quantity: Quantity| {
            let values = self.of_series(quantity, series[quantity.index()].as_ref()?);
            let (low, high) = crate::sweep::extremes(&values);
            let rough = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).powi(2);
            Some(values.windows(4).map(rough).sum::<f64>() / (high - low).powi(2))
        };
        all.filter_map(of).fold(0.0, f64::max)
    }
}
