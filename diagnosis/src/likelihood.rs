//! J = ½ Σ_b N_b ln(Σ_{f∈b} |Z(f)|² / N_b) + ½ Σ ((q − μ)/σ)²: how badly a composition explains the measurement.
//!
//! Z spectrum of measured − simulated(q) − linear nuisance, N_b numbers in band b (`spectrum.rs`), q the unknowns with their priors.
//! It is −ln of Whittle's likelihood (1953) with the noise level of every band profiled out, so noise of any colour costs
//! nothing and a misfit weighs by what it stands out of its own band. The nuisance that enters linearly (drift, lines, gain of the
//! field probe, what creep remembers of before the run) is profiled out too, by least squares under the same levels.

use std::sync::Arc;

use anhyst_model::ActuatorOutputs;

use crate::bands::{ERRORS, bands};
use crate::channel::Channel;
use crate::composition::Composition;
use crate::nuisance::{Nuisance, linear};
use crate::plant::{Plant, Steps};
use crate::products::Products;

/// Rounds in which levels and linear nuisance settle on each other.
const ROUNDS: usize = 2;

/// A plant and its measurement, ready to be fitted.
pub(crate) struct Bench {
    pub plant: Plant,
    pub measured: Vec<f64>,
    /// Places of each band among the stacked spectra.
    pub bands: Vec<Vec<usize>>,
    /// Independent numbers of each.
    pub counts: Vec<f64>,
    /// Variance that is never quite nothing.
    floors: Vec<f64>,
    pub threads: usize,
}

/// A composition simulated and held against the measurement.
#[derive(Clone)]
pub(crate) struct Point {
    pub composition: Composition,
    pub runs: Vec<ActuatorOutputs>,
    /// Stacked spectra of the simulation.
    pub simulated: Vec<f64>,
    /// Of what is left; the means are taken out.
    pub residual: Vec<f64>,
    pub nuisance: Nuisance,
    /// Variance of each band.
    pub levels: Vec<f64>,
    pub cost: f64,
}

impl Point {
    pub fn with<'a>(&'a self, columns: &'a [Arc<Vec<f64>>]) -> Vec<&'a [f64]> {
        let more = columns.iter().chain(&self.nuisance.columns);
        let left = std::iter::once(self.residual.as_slice());
        left.chain(more.map(|own| own.as_slice())).collect()
    }
}

impl Bench {
    pub fn new(plant: Plant, threads: usize) -> Self {
        let (bands, errors) = bands(&plant);
        let from = bands.len() - errors;
        let count = |(index, band): (usize, &Vec<usize>)| {
            if index < from { band.len() as f64 } else { ERRORS }
        };
        let floor = |band: &Vec<usize>| {
            let channel = plant.channels.iter().find(|own| own.places.contains(&band[0]));
            channel.map_or(0.0, |own| (1e-3 * own.noise_rms).powi(2))
        };
        Bench {
            floors: bands.iter().map(floor).collect(),
            measured: plant.measured_spectra(),
            counts: bands.iter().enumerate().map(count).collect(),
            bands,
            plant,
            threads,
        }
    }

    /// Spectra of a composition and the runs behind them.
    pub fn simulate(&self, composition: &Composition, steps: Steps) -> Option<(Vec<ActuatorOutputs>, Vec<f64>)> {
        let runs = self.plant.simulate(composition, steps)?;
        let spectra = self.plant.spectra(&runs)?;
        Some((runs, spectra))
    }

    /// What changes in the spectra where a composition takes the place of a point's; means are the zero's.
    pub fn change(&self, here: &Point, moved: &Composition) -> Option<Vec<f64>> {
        self.change_from(&here.simulated, moved, Steps::Made)
    }

    /// The same from the spectra of any.
    pub fn change_from(&self, spectra: &[f64], moved: &Composition, steps: Steps) -> Option<Vec<f64>> {
        let (_, mut change) = self.simulate(moved, steps)?;
        for (own, base) in change.iter_mut().zip(spectra) {
            *own -= base;
        }
        for channel in &self.plant.channels {
            change[channel.places.start] = 0.0;
        }
        Some(change)
    }

    /// A composition held against the measurement.
    pub fn point(&self, composition: &Composition) -> Option<Point> {
        let (runs, simulated) = self.simulate(composition, Steps::Made)?;
        let raw: Vec<f64> = self.measured.iter().zip(&simulated).map(|(y, m)| y - m).collect();
        let (kinds, columns) = linear(&self.plant, composition, &simulated);
        let (residual, levels, coefficients) = self.profiled(raw, &columns);
        let prior: f64 = composition.unknowns.iter().map(|own| own.surprise().powi(2)).sum();
        let cost = self.cost(&levels) + 0.5 * prior;
        cost.is_finite().then(|| Point {
            composition: composition.clone(),
            runs,
            simulated,
            residual,
            nuisance: Nuisance {
                kinds,
                columns,
                coefficients,
            },
            levels,
            cost,
        })
    }

    /// Σ |Z|² over the outputs.
    pub fn output_energy(&self, spectra: &[f64]) -> f64 {
        let numbers = self.plant.outputs().flat_map(|(_, own)| &spectra[own.places.clone()]);
        numbers.map(|z| z * z).sum()
    }

    /// ½ Σ N_b ln level.
    pub fn cost(&self, levels: &[f64]) -> f64 {
        let bands = self.counts.iter().zip(levels);
        0.5 * bands.map(|(count, level)| count * level.ln()).sum::<f64>()
    }

    /// Mean square of each band by its energy, never quite nothing.
    pub fn levels(&self, energies: &[f64]) -> Vec<f64> {
        let bands = self.bands.iter().zip(&self.floors).zip(energies);
        bands
            .map(|((band, floor), energy)| (energy / band.len() as f64).max(*floor))
            .collect()
    }

    /// What a number's square counts in each band: 1/level.
    pub fn weights(&self, levels: &[f64]) -> Vec<f64> {
        let bands = self.bands.iter().zip(&self.counts).zip(levels);
        bands
            .map(|((band, count), level)| count / (band.len() as f64 * level))
            .collect()
    }

    /// Takes linear columns out of a difference, under the levels of what remains.
    fn profiled(&self, mut residual: Vec<f64>, columns: &[Arc<Vec<f64>>]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let all = std::iter::once(residual.as_slice()).chain(columns.iter().map(|own| own.as_slice()));
        let products = Products::of(&self.bands, &all.collect::<Vec<_>>());
        let mut coefficients = vec![0.0; columns.len()];
        let mut levels = self.levels(&products.left(&coefficients));
        for _ in 0..ROUNDS {
            if columns.is_empty() {
                break;
            }
            let system = products.normal(&self.weights(&levels));
            coefficients = system.solve(&vec![0.0; columns.len()]);
            levels = self.levels(&products.left(&coefficients));
        }
        for (column, coefficient) in columns.iter().zip(&coefficients) {
            for (z, own) in residual.iter_mut().zip(column.iter()) {
                *z -= coefficient * own;
            }
        }
        for channel in &self.plant.channels {
            residual[channel.places.start] = 0.0;
        }
        (residual, levels, coefficients)
    }

    /// What a channel's output has left, in its unit and by row.
    pub fn left(&self, point: &Point, channel: &Channel) -> Vec<f64> {
        channel.spectrum.back(&point.residual[channel.places.clone()])
    }
}
