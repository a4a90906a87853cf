//! y = model + Σ g_j(s_j): what nothing in the library explains, as curves over the model's own signals.
//!
//! s_j is a signal of the simulated run: field on rising or falling branches, its rate, field and rate together, magnetization, output,
//! velocity, and slow memories of the magnetization; g_j a piecewise linear curve (hats on knots), or a surface for a pair.
//! Coefficients by ridge regression, min |r − Σ g|² + λ Σ (second differences)²; λ and the choice of curves by the held-out
//! rows: curves are added one by one while the best further one lowers the held-out energy by `WORTH` of the gap.
//! It is usable wherever the signals stay within the knots; beyond them it keeps its end values.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::hats::{Hats, Over, places};
use crate::observation::Observation;
use crate::statistics::rms;
use crate::system::{ChannelKind, Signals};

/// A further curve must explain this share of the gap's energy.
const WORTH: f64 = 0.02;
const MOST_CURVES: usize = 4;
const SMOOTHINGS: [f64; 6] = [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6];
const MEMORIES_S: [f64; 3] = [0.03, 0.3, 3.0];

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

/// Fits curves to an output residual (whitened); None where nothing is left to explain.
pub(crate) fn free_form(observation: &Observation, residual: &[f64], signals: &[Signals]) -> Option<UnknownTerm> {
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
        // The curves are added to the output, so they are fitted in its unit and not behind the filter that whitens.
        let gaps = observation.unwhiten(residual.to_vec());
        for channel in observation.of_kind(ChannelKind::Output) {
            for (rows, held_out) in [(&observation.training, false), (&observation.held_out, true)] {
                for range in observation.rows_in(channel, rows) {
                    for row in range {
                        let gap = gaps[row];
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
    pub(crate) fn along(&self, run: &Signals) -> Vec<f64> {
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
    use super::*;
    use crate::system::Channel;

    /// Guards "unknown": a ripple over the displacement is found as a curve over the output, and predicts what was held out, in the
    /// output's own unit whatever the colour of the noise.
    #[test]
    fn a_ripple_over_the_output_is_found_and_predicts() {
        for colour in [0.0, 0.8] {
            ripple_in_noise_of(colour);
        }
    }

    fn ripple_in_noise_of(colour: f64) {
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
        let mut random = anhyst_model::Noise::new(1, 0);
        let mut noise = random.normal();
        let gap: Vec<f64> = output
            .iter()
            .map(|x| {
                noise = colour * noise + (1.0 - colour * colour).sqrt() * random.normal();
                0.5 * (40.0 * x).sin() + 0.1 * noise
            })
            .collect();
        let channel = Channel {
            run: 0,
            kind: ChannelKind::Output,
            rows: 0..rows as usize,
            noise_rms: 0.1,
            autoregression: colour,
            free_zero: false,
            settling_rows: 0,
        };
        let observation = Observation::new(vec![channel], gap.clone());
        let found = free_form(&observation, &observation.whitened, std::slice::from_ref(&signals)).unwrap();
        assert_eq!(found.curves[0].over, Over::Output);
        assert!(found.share_of_energy_explained > 0.95, "{found:?}");
        let before = rms(gap.iter().copied());
        assert!((found.held_out_rms_before / before - 1.0).abs() < 0.05, "{found:?}");
        let left = rms(gap.iter().zip(found.along(&signals)).map(|(gap, own)| gap - own));
        assert!(left < 0.11, "colour {colour}: {left}");
    }
}
