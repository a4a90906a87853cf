//! y = model + Σ g_j(s_j): what nothing in the library explains, as curves over the model's own signals.
//!
//! s_j is a signal of the simulated run: field on rising or falling branches, its rate, field and rate together, magnetization, output,
//! velocity, and slow memories of the magnetization; g_j a piecewise linear curve (hats on knots), or a surface for a pair.
//! Coefficients by ridge regression, min |r − Σ g|² + λ Σ (second differences)²; λ and the choice of curves by the held-out
//! rows: curves are added one by one while the best further one lowers the held-out energy by `WORTH` of the gap.
//! It is usable wherever the signals stay within the knots; beyond them it keeps its end values.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::observation::Observation;
use super::statistics::{quantile, rms, sorted};
use super::system::{ChannelKind, Signals};

/// A further curve must explain this share of the gap's energy.
const WORTH: f64 = 0.02;
const MOST_CURVES: usize = 4;
const SMOOTHINGS: [f64; 6] = [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6];
const MEMORIES_S: [f64; 3] = [0.03, 0.3, 3.0];

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

/// One fitted curve or surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeCurve {
    pub over: Over,
    pub knots: Vec<f64>,
    /// Of the second signal of a surface; empty for a curve.
    pub second_knots: Vec<f64>,
    /// In the output's unit, second signal fastest.
    pub values: Vec<f64>,
    /// Rms of its contribution.
    pub rms: f64,
}

/// The free-form term of an output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnknownTerm {
    pub curves: Vec<FreeCurve>,
    /// Held-out rms of the output without and with it, noise included.
    pub held_out_rms_before: f64,
    pub held_out_rms_after: f64,
    /// Of the gap's energy on held-out rows, noise taken off.
    pub share_of_energy_explained: f64,
}

struct Hats {
    over: Over,
    knots: Vec<f64>,
    second_knots: Vec<f64>,
    /// By run and row: first signal, second signal, whether the curve counts there.
    places: Vec<Vec<(f64, f64, bool)>>,
}

/// Fits curves to an output residual (in its unit); None where nothing is left to explain.
pub(super) fn free_form(observation: &Observation, residual: &[f64], signals: &[Signals]) -> Option<UnknownTerm> {
    let all: Vec<Hats> = overs(signals)
        .into_iter()
        .filter_map(|over| Hats::of(over, signals))
        .collect();
    let normal = Normal::of(observation, residual, &all);
    let noise = normal.noise_energy;
    let before = normal.held_out_square;
    if before <= noise {
        return None;
    }
    let mut chosen: Vec<usize> = Vec::new();
    let mut best: Option<(f64, DVector<f64>)> = None;
    while chosen.len() < MOST_CURVES {
        let mut further: Option<(usize, f64, DVector<f64>)> = None;
        for candidate in (0..all.len()).filter(|own| !chosen.contains(own)) {
            let mut set = chosen.clone();
            set.push(candidate);
            let Some((energy, coefficients)) = normal.best(&all, &set) else {
                continue;
            };
            if further.as_ref().is_none_or(|(_, least, _)| energy < *least) {
                further = Some((candidate, energy, coefficients));
            }
        }
        let Some((candidate, energy, coefficients)) = further else {
            break;
        };
        let present = best.as_ref().map_or(before, |(energy, _)| *energy);
        if present - energy < WORTH * (before - noise) {
            break;
        }
        chosen.push(candidate);
        best = Some((energy, coefficients));
    }
    let (energy, coefficients) = best?;
    let rows = normal.held_out_rows.max(1.0);
    let mut from = 0;
    let curves = chosen.iter().map(|&index| {
        let hats = &all[index];
        let values = coefficients.as_slice()[from..from + hats.size()].to_vec();
        from += hats.size();
        let contribution = hats.places.iter().flatten().map(|place| hats.value(*place, &values));
        FreeCurve {
            over: hats.over,
            rms: rms(contribution),
            knots: hats.knots.clone(),
            second_knots: hats.second_knots.clone(),
            values,
        }
    });
    Some(UnknownTerm {
        curves: curves.collect(),
        held_out_rms_before: (before / rows).sqrt(),
        held_out_rms_after: (energy / rows).sqrt(),
        share_of_energy_explained: (before - energy) / (before - noise),
    })
}

fn overs(signals: &[Signals]) -> Vec<Over> {
    let mut overs = vec![Over::FieldRising, Over::FieldFalling, Over::Magnetization, Over::Output];
    if signals.iter().all(|run| run.tick_s.is_some()) {
        overs.extend([Over::Rate, Over::FieldAndRate, Over::Velocity]);
        overs.extend(MEMORIES_S.map(|time_constant_s| Over::Memory { time_constant_s }));
    }
    overs
}

/// The signal (or two) that a curve stands over, and where it counts.
fn places(over: Over, run: &Signals) -> Vec<(f64, f64, bool)> {
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
    fn of(over: Over, signals: &[Signals]) -> Option<Self> {
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

    fn size(&self) -> usize {
        self.knots.len() * self.second_knots.len().max(1)
    }

    /// Coefficients that count at a place, with their weights.
    fn weights(&self, (first, second, counts): (f64, f64, bool)) -> [(usize, f64); 4] {
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

    fn value(&self, place: (f64, f64, bool), values: &[f64]) -> f64 {
        self.weights(place)
            .iter()
            .map(|(index, weight)| weight * values[*index])
            .sum()
    }

    /// Second differences along each direction, squared, onto the diagonal block.
    fn smooth(&self, matrix: &mut DMatrix<f64>, offset: usize, strength: f64) {
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

/// Normal equations of all curves at once, on training and held-out rows apart.
struct Normal {
    training: (DMatrix<f64>, DVector<f64>),
    held_out: (DMatrix<f64>, DVector<f64>),
    held_out_square: f64,
    held_out_rows: f64,
    noise_energy: f64,
    offsets: Vec<usize>,
}

impl Normal {
    fn of(observation: &Observation, residual: &[f64], all: &[Hats]) -> Self {
        let mut offsets = vec![0];
        for hats in all {
            offsets.push(offsets[offsets.len() - 1] + hats.size());
        }
        let size = offsets[offsets.len() - 1];
        let empty = || (DMatrix::zeros(size, size), DVector::zeros(size));
        let mut normal = Normal {
            training: empty(),
            held_out: empty(),
            held_out_square: 0.0,
            held_out_rows: 0.0,
            noise_energy: 0.0,
            offsets,
        };
        for channel in observation.of_kind(ChannelKind::Output) {
            for (rows, held_out) in [(&observation.training, false), (&observation.held_out, true)] {
                for range in observation.rows_in(channel, rows) {
                    for row in range {
                        let gap = residual[row] * channel.noise_rms;
                        if held_out {
                            normal.held_out_square += gap * gap;
                            normal.held_out_rows += 1.0;
                            normal.noise_energy += channel.noise_rms * channel.noise_rms;
                        }
                        normal.add(all, channel.run, row - channel.rows.start, gap, held_out);
                    }
                }
            }
        }
        normal
    }

    fn add(&mut self, all: &[Hats], run: usize, row: usize, gap: f64, held_out: bool) {
        let mut weights: Vec<(usize, f64)> = Vec::with_capacity(4 * all.len());
        for (hats, offset) in all.iter().zip(&self.offsets) {
            let own = hats.weights(hats.places[run][row]);
            weights.extend(
                own.iter()
                    .filter(|(_, weight)| *weight != 0.0)
                    .map(|(index, weight)| (offset + index, *weight)),
            );
        }
        let (matrix, right) = if held_out {
            &mut self.held_out
        } else {
            &mut self.training
        };
        for (a, weight_a) in &weights {
            right[*a] += weight_a * gap;
            for (b, weight_b) in &weights {
                matrix[(*b, *a)] += weight_a * weight_b;
            }
        }
    }

    fn part(&self, of: &(DMatrix<f64>, DVector<f64>), all: &[Hats], set: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let places: Vec<usize> = set
            .iter()
            .flat_map(|&index| self.offsets[index]..self.offsets[index] + all[index].size())
            .collect();
        let matrix = DMatrix::from_fn(places.len(), places.len(), |row, column| {
            of.0[(places[row], places[column])]
        });
        let right = DVector::from_fn(places.len(), |row, _| of.1[places[row]]);
        (matrix, right)
    }

    /// Least held-out energy over the smoothings, and the coefficients.
    fn best(&self, all: &[Hats], set: &[usize]) -> Option<(f64, DVector<f64>)> {
        let (matrix, right) = self.part(&self.training, all, set);
        let held_out = self.part(&self.held_out, all, set);
        let mut best: Option<(f64, DVector<f64>)> = None;
        for strength in SMOOTHINGS {
            let mut smooth = matrix.clone();
            let mut offset = 0;
            for &index in set {
                all[index].smooth(&mut smooth, offset, strength);
                offset += all[index].size();
            }
            let Some(factor) = smooth.cholesky() else { continue };
            let coefficients = factor.solve(&right);
            let energy = self.held_out_square - 2.0 * coefficients.dot(&held_out.1)
                + coefficients.dot(&(&held_out.0 * &coefficients));
            if best.as_ref().is_none_or(|(least, _)| energy < *least) {
                best = Some((energy, coefficients));
            }
        }
        best
    }
}

impl UnknownTerm {
    /// What the term adds to an output, in its unit.
    pub(super) fn along(&self, run: &Signals) -> Vec<f64> {
        let mut sum = vec![0.0; run.field.len()];
        for curve in &self.curves {
            let hats = Hats {
                over: curve.over,
                knots: curve.knots.clone(),
                second_knots: curve.second_knots.clone(),
                places: Vec::new(),
            };
            for (sum, place) in sum.iter_mut().zip(places(curve.over, run)) {
                *sum += hats.value(place, &curve.values);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::system::Channel;
    use super::*;

    /// Guards "unknown": a ripple over the displacement is found as a curve over the output, and predicts what was held out.
    #[test]
    fn a_ripple_over_the_output_is_found_and_predicts() {
        let rows = 8000;
        let output: Vec<f64> = (0..rows)
            .map(|k| (f64::from(k) * 0.003).sin() * (f64::from(k) * 0.0004).cos())
            .collect();
        let signals = Signals {
            field: output.iter().map(|x| 2.0 * x).collect(),
            magnetization: output.iter().map(|x| 3.0 * x.powi(3)).collect(),
            drive: vec![0.0; rows as usize],
            output: output.clone(),
            tick_s: Some(1e-3),
            temperature: None,
        };
        let mut noise = anhyst_model::Noise::new(1, 0);
        let gap: Vec<f64> = output
            .iter()
            .map(|x| 0.5 * (40.0 * x).sin() + 0.1 * noise.normal())
            .collect();
        let channel = Channel {
            run: 0,
            kind: ChannelKind::Output,
            rows: 0..rows as usize,
            noise_rms: 0.1,
            autoregression: 0.0,
            free_zero: false,
            settling_rows: 0,
        };
        let observation = Observation::new(vec![channel], gap.clone());
        let found = free_form(&observation, &observation.whitened, std::slice::from_ref(&signals)).unwrap();
        assert_eq!(found.curves[0].over, Over::Output);
        assert!(found.share_of_energy_explained > 0.95, "{found:?}");
        let left = rms(gap.iter().zip(found.along(&signals)).map(|(gap, own)| gap - own));
        assert!(left < 0.11, "{left}");
    }
}
