//! Hats on knots over the signals of a simulated run: what free-form curves and surfaces are made of.
//!
//! g(s) = Σ c_i h_i(s): h_i is 1 on knot i, 0 on its neighbours and straight between; for two signals s, t the products
//! h_i(s) h_j(t). Beyond the knots the end values stay. Roughness is Σ (second differences of c)².

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::statistics::{quantile, sorted};
use crate::system::Signals;

/// Over what a curve stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Over {
    FieldRising,
    FieldFalling,
    Rate,
    FieldAndRate,
    Magnetization,
    Output,
    Velocity,
    /// Magnetization through a first-order lag.
    Memory {
        time_constant_s: f64,
    },
}

impl Over {
    pub fn name(self) -> String {
        match self {
            Over::FieldRising => "field, rising".to_owned(),
            Over::FieldFalling => "field, falling".to_owned(),
            Over::Rate => "rate of the field".to_owned(),
            Over::FieldAndRate => "field and its rate".to_owned(),
            Over::Magnetization => "magnetization".to_owned(),
            Over::Output => "output itself".to_owned(),
            Over::Velocity => "velocity of the output".to_owned(),
            Over::Memory { time_constant_s } => format!("magnetization remembered for {time_constant_s} s"),
        }
    }
}

/// A curve or surface without its coefficients.
pub(crate) struct Hats {
    pub over: Over,
    pub knots: Vec<f64>,
    pub second_knots: Vec<f64>,
    /// By run and row: first signal, second signal, whether the curve counts there.
    pub places: Vec<Vec<(f64, f64, bool)>>,
}

/// The signal (or two) that a curve stands over, and where it counts.
pub(crate) fn places(over: Over, run: &Signals) -> Vec<(f64, f64, bool)> {
    let change = |series: &[f64], k: usize| series[k] - series[k.saturating_sub(1)];
    let per_row = run.tick_s.unwrap_or(1.0);
    let rate = |k: usize| change(&run.field, k) / per_row;
    let rows = 0..run.field.len();
    match over {
        Over::FieldRising => rows.map(|k| (run.field[k], 0.0, rate(k) >= 0.0)).collect(),
        Over::FieldFalling => rows.map(|k| (run.field[k], 0.0, rate(k) < 0.0)).collect(),
        Over::Rate => rows.map(|k| (rate(k), 0.0, true)).collect(),
        Over::FieldAndRate => rows.map(|k| (run.field[k], rate(k), true)).collect(),
        Over::Magnetization => run.magnetization.iter().map(|m| (*m, 0.0, true)).collect(),
        Over::Output => run.output.iter().map(|x| (*x, 0.0, true)).collect(),
        Over::Velocity => rows.map(|k| (change(&run.output, k) / per_row, 0.0, true)).collect(),
        Over::Memory { time_constant_s } => {
            let decay = (-per_row / time_constant_s).exp();
            let mut memory = run.magnetization.first().copied().unwrap_or(0.0);
            run.magnetization
                .iter()
                .map(|m| {
                    memory = decay * memory + (1.0 - decay) * m;
                    (memory, 0.0, true)
                })
                .collect()
        }
    }
}

impl Hats {
    pub fn of(over: Over, signals: &[Signals]) -> Option<Self> {
        let places: Vec<Vec<(f64, f64, bool)>> = signals.iter().map(|run| places(over, run)).collect();
        let first = sorted(places.iter().flatten().filter(|place| place.2).map(|place| place.0));
        let second = sorted(places.iter().flatten().map(|place| place.1));
        let (count, by_quantile) = match over {
            Over::Output => (161, false),
            Over::FieldRising | Over::FieldFalling | Over::Magnetization => (49, false),
            Over::FieldAndRate => (13, false),
            Over::Memory { .. } => (9, false),
            Over::Rate | Over::Velocity => (25, true),
        };
        let knots = knots(&first, count, by_quantile);
        let second_knots = if over == Over::FieldAndRate {
            self::knots(&second, 7, true)
        } else {
            Vec::new()
        };
        let enough = knots.len() > 2 && (over != Over::FieldAndRate || second_knots.len() > 2);
        enough.then_some(Hats {
            over,
            knots,
            second_knots,
            places,
        })
    }

    pub fn size(&self) -> usize {
        self.knots.len() * self.second_knots.len().max(1)
    }

    /// Coefficients that count at a place, with their weights.
    pub fn weights(&self, (first, second, counts): (f64, f64, bool)) -> [(usize, f64); 4] {
        if !counts {
            return [(0, 0.0); 4];
        }
        let (low, share) = between(&self.knots, first);
        if self.second_knots.is_empty() {
            return [(low, 1.0 - share), (low + 1, share), (0, 0.0), (0, 0.0)];
        }
        let (low_2, share_2) = between(&self.second_knots, second);
        let width = self.second_knots.len();
        let at = |i: usize, j: usize| (low + i) * width + low_2 + j;
        [
            (at(0, 0), (1.0 - share) * (1.0 - share_2)),
            (at(0, 1), (1.0 - share) * share_2),
            (at(1, 0), share * (1.0 - share_2)),
            (at(1, 1), share * share_2),
        ]
    }

    pub fn value(&self, place: (f64, f64, bool), values: &[f64]) -> f64 {
        self.weights(place)
            .iter()
            .map(|(index, weight)| weight * values[*index])
            .sum()
    }

    /// Second differences along each direction, squared, onto the diagonal block.
    pub fn smooth(&self, matrix: &mut DMatrix<f64>, offset: usize, strength: f64) {
        let (length, width) = (self.knots.len(), self.second_knots.len().max(1));
        let mut add = |places: [usize; 3]| {
            for (a, weight_a) in places.iter().zip([1.0, -2.0, 1.0]) {
                for (b, weight_b) in places.iter().zip([1.0, -2.0, 1.0]) {
                    matrix[(offset + a, offset + b)] += strength * weight_a * weight_b;
                }
            }
        };
        for i in 1..length - 1 {
            for j in 0..width {
                add([(i - 1) * width + j, i * width + j, (i + 1) * width + j]);
            }
        }
        for i in 0..length {
            for j in 1..width.saturating_sub(1) {
                add([i * width + j - 1, i * width + j, i * width + j + 1]);
            }
        }
        for index in 0..self.size() {
            matrix[(offset + index, offset + index)] += 1e-6 * strength + 1e-9;
        }
    }
}

/// Lower neighbour and the share of the way to the upper one; ends are kept.
fn between(knots: &[f64], value: f64) -> (usize, f64) {
    let low = knots.partition_point(|knot| *knot <= value).clamp(1, knots.len() - 1) - 1;
    let share = (value - knots[low]) / (knots[low + 1] - knots[low]);
    (low, share.clamp(0.0, 1.0))
}

fn knots(sorted: &[f64], count: usize, by_quantile: bool) -> Vec<f64> {
    let (Some(low), Some(high)) = (sorted.first(), sorted.last()) else {
        return Vec::new();
    };
    let count = count.min(sorted.len() / 8).max(2);
    let mut knots: Vec<f64> = (0..count)
        .map(|knot| {
            let share = knot as f64 / (count - 1) as f64;
            if by_quantile {
                quantile(sorted, share)
            } else {
                low + share * (high - low)
            }
        })
        .collect();
    let least = 1e-9 * (high - low);
    knots.dedup_by(|next, before| *next - *before <= least);
    knots
}
