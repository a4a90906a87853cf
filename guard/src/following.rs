//! y = g·p(t − s) + z: how the measured field y follows p, what the believed amplifier makes of the fields given (A/m).
//!
//! p: the field given, late by the believed delay and behind the believed lag, exact for straight lines between ticks. Gain g, shift s (ticks) and
//! zero z (A/m) by least squares of y on (p, d = p_k − p_{k−1}, d_k − d_{k−1}, 1) that forgets exponentially; deviations from its own residual.

use crate::believed::BelievedCoil;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Fewer ticks tell nothing.
const LEAST_TICKS: f64 = 80.0;
/// Determinant of three columns, as a part of the product of their squares, below which they are parallel.
const PARALLEL: f64 = 1e-9;
const MEASURED: usize = 3;

/// The believed amplifier and what was heard of the coil.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Following {
    memory_ticks: u64,
    /// e^{−T/τ}, and the share of a tick's change that has come at its end.
    kept: f64,
    straight: f64,
    on_the_way: VecDeque<f64>,
    asked_a_per_m: f64,
    /// p.
    pub(crate) field_a_per_m: f64,
    /// In the last tick.
    change_a_per_m: f64,
    fit: Fit,
}

/// How the coil follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainAndShift {
    /// g.
    pub gain: f64,
    /// Its standard deviation.
    pub gain_deviation: f64,
    /// s: positive if late.
    pub shift_ticks: f64,
    /// Its standard deviation.
    pub shift_deviation: f64,
    /// Of d_k − d_{k−1}, over g: s(s − 1)/2 for a delay, s² − s/2 for a lag.
    pub bend: f64,
    /// What neither explains, rms, as a part of the measured field.
    pub left: f64,
}

/// Means that forget: weight, of p, d, d_k − d_{k−1}, y, and of their products.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Fit {
    n: f64,
    of: [f64; 4],
    products: [[f64; 4]; 4],
}

impl Following {
    /// A coil at rest.
    pub fn new(believed: BelievedCoil, tick_s: f64, memory_ticks: u64) -> Self {
        let turns = tick_s / believed.lag_s;
        let (kept, straight) = if believed.lag_s > 0.0 {
            let kept = libm::exp(-turns);
            (kept, 1.0 - (1.0 - kept) / turns)
        } else {
            (0.0, 1.0)
        };
        Self {
            memory_ticks,
            kept,
            straight,
            on_the_way: vec![0.0; 1 + believed.delay_ticks as usize].into(),
            asked_a_per_m: 0.0,
            field_a_per_m: 0.0,
            change_a_per_m: 0.0,
            fit: Fit::default(),
        }
    }

    /// Takes the field given in the tick before and, if there is one, the field measured in this; without one all is heard anew.
    pub fn hear(&mut self, given_a_per_m: f64, measured_a_per_m: Option<f64>) {
        self.on_the_way.push_back(given_a_per_m);
        let asked = self.on_the_way.pop_front().unwrap_or_default();
        let from = std::mem::replace(&mut self.asked_a_per_m, asked);
        let before = self.field_a_per_m;
        self.field_a_per_m = self.kept * before + (1.0 - self.kept) * from + self.straight * (asked - from);
        match measured_a_per_m {
            Some(measured) => {
                let change = self.field_a_per_m - before;
                let values = [self.field_a_per_m, change, change - self.change_a_per_m, measured];
                self.fit.take(values, 1.0 / self.memory_ticks as f64);
            }
            None => self.fit = Fit::default(),
        }
        self.change_a_per_m = self.field_a_per_m - before;
    }

    /// None while p moves by less than this rms (A/m), or fewer than `LEAST_TICKS` ticks were heard.
    pub fn gain_and_shift(&self, motion_a_per_m: f64) -> Option<GainAndShift> {
        let fit = &self.fit;
        // The first tick counts as if it had always been: divided out.
        let mean = |index: usize| fit.of[index] / fit.n;
        let spread = |row: usize, column: usize| fit.products[row][column] / fit.n - mean(row) * mean(column);
        let ticks = fit.n * self.memory_ticks as f64;
        if ticks < LEAST_TICKS || spread(0, 0) < motion_a_per_m * motion_a_per_m {
            return None;
        }
        let inverse = inverse([0, 1, 2].map(|row| [0, 1, 2].map(|column| spread(row, column))))?;
        let to = [0, 1, 2].map(|row| spread(row, MEASURED));
        let [gain, slope, bend] = inverse.map(|row| row.iter().zip(to).map(|(own, to)| own * to).sum::<f64>());
        let measured = spread(MEASURED, MEASURED);
        let left = (measured - gain * to[0] - slope * to[1] - bend * to[2]).max(0.0);
        let deviation = |row: usize| (left / ticks * inverse[row][row]).max(0.0).sqrt();
        Some(GainAndShift {
            gain,
            gain_deviation: deviation(0),
            shift_ticks: -slope / gain,
            shift_deviation: deviation(1) / gain.abs(),
            bend: bend / gain,
            left: (left / measured.max(f64::MIN_POSITIVE)).sqrt(),
        })
    }
}

/// Of a symmetric matrix, by its cofactors; none where its columns are as good as parallel.
fn inverse(own: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let minor = |row: usize, column: usize| {
        let [(a, b), (c, d)] = [row, column].map(|left_out| ((left_out + 1) % 3, (left_out + 2) % 3));
        own[a][c] * own[b][d] - own[a][d] * own[b][c]
    };
    let determinant: f64 = (0..3).map(|column| own[0][column] * minor(0, column)).sum();
    let scale = own[0][0] * own[1][1] * own[2][2];
    (determinant > PARALLEL * scale)
        .then(|| [0, 1, 2].map(|row| [0, 1, 2].map(|column| minor(row, column) / determinant)))
}

impl Fit {
    fn take(&mut self, values: [f64; 4], forget: f64) {
        self.n = (1.0 - forget) * self.n + forget;
        for (row, value) in values.into_iter().enumerate() {
            self.of[row] += forget * (value - self.of[row]);
            for (column, other) in values.into_iter().enumerate() {
                let own = &mut self.products[row][column];
                *own += forget * (value * other - *own);
            }
        }
    }
}
