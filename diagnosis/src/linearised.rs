//! A fit about its values: what further columns would gain beside all that is in it.

use nalgebra::{DMatrix, DVector};

use crate::channel::Channel;
use crate::evidence::Evidence;
use crate::likelihood::{Bench, Fitted};
use crate::normal::{Normal, weighted};

/// A term that promises a smaller fall of J is not fitted.
pub(crate) const PROMISES: f64 = 10.0;
/// Share of what is left that a term may be looked for in: the levels hold noise and misfit together.
const MISFIT: f64 = 0.3;

/// A fit in which every column answers linearly.
pub(crate) struct Linearised<'a> {
    bench: &'a Bench,
    base: &'a Fitted,
    weights: Vec<f64>,
    /// All columns of the fit, weighted.
    weighted: DMatrix<f64>,
    normal: Normal,
    pull: Vec<f64>,
    evidence: Evidence<'a>,
}

impl<'a> Linearised<'a> {
    /// Under the levels that the fit has, or others.
    pub fn new(bench: &'a Bench, base: &'a Fitted, levels: &[f64]) -> Self {
        let here = &base.point;
        let all: Vec<&Vec<f64>> = base.columns.iter().chain(&here.nuisance.columns).collect();
        let weights = bench.weights(levels);
        let weighted = weighted(&weights, &all);
        let mut normal = Normal::of_weighted(&weighted, &weights, &here.residual);
        let pull = normal.believe(&here.composition.unknowns);
        Linearised {
            bench,
            base,
            weights,
            weighted,
            normal,
            pull,
            evidence: Evidence::new(bench, here),
        }
    }

    /// What promises so little is not looked for any further: noise is left, and nothing large can hide in it.
    pub fn is_hopeless(&self, gain: f64) -> bool {
        gain < PROMISES && !self.evidence.is_misfit && !self.bench.plant.fitted
    }

    /// The same of what is left, as far as it may be a misfit.
    pub fn misfit(&self) -> f64 {
        MISFIT * self.energy(&self.base.point.residual)
    }

    /// Σ D²/S of a change of the spectra.
    pub fn energy(&self, change: &[f64]) -> f64 {
        let own = change.iter().zip(&self.weights);
        own.map(|(value, weight)| (value * weight).powi(2)).sum()
    }

    /// Falls of J and E with further columns, their multiples, and the levels then. `ridge` holds the multiples back.
    pub fn gain(&self, further: &[Vec<f64>], ridge: f64) -> (Gain, Vec<f64>, Vec<f64>) {
        let here = &self.base.point;
        let (own, size) = (self.pull.len(), self.pull.len() + further.len());
        let more = weighted(&self.weights, further);
        let (across, within) = (self.weighted.tr_mul(&more), more.tr_mul(&more));
        let mut bordered = Normal {
            matrix: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
        };
        bordered
            .matrix
            .view_mut((0, 0), (own, own))
            .copy_from(&self.normal.matrix);
        bordered
            .matrix
            .view_mut((0, own), (own, further.len()))
            .copy_from(&across);
        bordered
            .matrix
            .view_mut((own, 0), (further.len(), own))
            .copy_from(&across.transpose());
        bordered
            .matrix
            .view_mut((own, own), (further.len(), further.len()))
            .copy_from(&within);
        bordered.right.rows_mut(0, own).copy_from(&self.normal.right);
        let left = weighted(&self.weights, std::slice::from_ref(&here.residual));
        bordered
            .right
            .rows_mut(own, further.len())
            .copy_from(&more.tr_mul(&left).column(0));
        for index in own..size {
            bordered.matrix[(index, index)] += ridge * bordered.matrix[(index, index)];
        }
        let mut pull = self.pull.clone();
        pull.resize(size, 0.0);
        let solution = bordered.solve(&pull);
        let mut residual = here.residual.clone();
        subtract(&mut residual, further, &solution[own..]);
        let (gain, levels) = self.gained(residual, &solution);
        (gain, solution[own..].to_vec(), levels)
    }

    /// The same of a change of the spectra just as it is.
    pub fn gain_of(&self, change: &[f64]) -> Gain {
        let mut residual = self.base.point.residual.clone();
        subtract(&mut residual, std::slice::from_ref(&change), &[1.0]);
        let left = weighted(&self.weights, std::slice::from_ref(&residual));
        let normal = Normal {
            matrix: self.normal.matrix.clone(),
            right: self.weighted.tr_mul(&left).column(0).into_owned(),
        };
        let solution = normal.solve(&self.pull);
        self.gained(residual, &solution).0
    }

    fn size(&self, residual: &[f64]) -> f64 {
        let energy = |own: &Channel| residual[own.places.clone()].iter().map(|z| z * z).sum::<f64>();
        let channels = self.bench.plant.channels.iter();
        channels.map(|own| energy(own).max(f64::MIN_POSITIVE).ln()).sum()
    }

    /// What is gained, and the levels, where the fit's own columns move by the first numbers of a solution.
    fn gained(&self, mut residual: Vec<f64>, solution: &[f64]) -> (Gain, Vec<f64>) {
        let here = &self.base.point;
        subtract(&mut residual, &self.base.columns, solution);
        subtract(
            &mut residual,
            &here.nuisance.columns,
            &solution[self.base.columns.len()..],
        );
        let levels = self.bench.levels(&residual);
        let unknowns = here.composition.unknowns.iter().zip(solution);
        let surprises = unknowns.map(|(own, step)| own.surprise() + own.surprise_slope() * step);
        let prior: f64 = surprises.map(|surprise| 0.5 * surprise * surprise).sum();
        let gain = Gain {
            likelihood: here.cost - self.bench.cost(&levels) - prior,
            evidence: self.evidence.cost(here) - self.evidence.cost_of(&levels) - prior,
            size: self.size(&here.residual) - self.size(&residual),
        };
        (gain, levels)
    }
}

/// By how much something explains a measurement better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    /// Fall of J.
    pub likelihood: f64,
    /// Fall of E.
    pub evidence: f64,
    /// Fall of Σ ln |Z|² over the channels: kinks that are nearly in their place leave little and stand out of every band.
    pub size: f64,
}

impl Gain {
    /// Of what cannot be.
    pub const NONE: Gain = Gain {
        likelihood: f64::NEG_INFINITY,
        evidence: f64::NEG_INFINITY,
        size: f64::NEG_INFINITY,
    };

    /// What is worth a fit: most by one measure or the other.
    pub fn either(self) -> f64 {
        self.likelihood.max(self.evidence)
    }
}

fn subtract<C: AsRef<[f64]>>(residual: &mut [f64], columns: &[C], multiples: &[f64]) {
    for (column, multiple) in columns.iter().zip(multiples) {
        for (z, own) in residual.iter_mut().zip(column.as_ref()) {
            *z -= multiple * own;
        }
    }
}
