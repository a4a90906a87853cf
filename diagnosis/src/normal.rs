//! Columns under the levels of their bands: the normal equations of a step, and what further columns would gain.
//!
//! A is weighted by 1/√S, S the level of the band; H = AᵀS⁻¹A + 1/σ². Columns are scaled to unit length before they are solved for, so that
//! numbers of any unit stand side by side and none is held back by rounding.

use nalgebra::{DMatrix, DVector};

use crate::likelihood::{Bench, Fitted, Point};

/// Below this share of a column's own square, what the others leave of it is rounding.
const RANK_TOLERANCE: f64 = 1e-11;

/// A fit about its values: every column answers linearly, so what further columns would gain is quickly told.
pub(crate) struct Linearised<'a> {
    bench: &'a Bench,
    base: &'a Fitted,
    weights: Vec<f64>,
    /// All columns of the fit, weighted.
    weighted: DMatrix<f64>,
    normal: Normal,
    pull: Vec<f64>,
}

impl<'a> Linearised<'a> {
    /// Under the levels that the fit has, or others.
    pub fn new(bench: &'a Bench, base: &'a Fitted, levels: &[f64]) -> Self {
        let here = &base.point;
        let all: Vec<&Vec<f64>> = base.columns.iter().chain(&here.nuisance.columns).collect();
        let weights = weights(bench, levels);
        let weighted = weighted(&weights, &all);
        let mut normal = Normal::of_weighted(&weighted, &weights, &here.residual);
        let pull = normal.believe(here);
        Linearised {
            bench,
            base,
            weights,
            weighted,
            normal,
            pull,
        }
    }

    /// The same of what is left beyond noise at the level of its band's quietest tenth.
    pub fn misfit(&self) -> f64 {
        0.3 * self.energy(&self.base.point.residual)
    }

    /// Σ D²/S of a change of the spectra.
    pub fn energy(&self, change: &[f64]) -> f64 {
        let own = change.iter().zip(&self.weights);
        own.map(|(value, weight)| (value * weight).powi(2)).sum()
    }

    /// Fall of J with further columns, their multiples, and the levels then. `ridge` holds the multiples back.
    pub fn gain(&self, further: &[Vec<f64>], ridge: f64) -> (f64, Vec<f64>, Vec<f64>) {
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
        let all = self.base.columns.iter().chain(&here.nuisance.columns).chain(further);
        for (column, multiple) in all.zip(&solution) {
            for (z, own) in residual.iter_mut().zip(column) {
                *z -= multiple * own;
            }
        }
        let levels = self.bench.levels(&residual);
        let unknowns = here.composition.unknowns.iter().zip(&solution);
        let prior = |surprise: f64| 0.5 * surprise * surprise;
        let prior: f64 = unknowns
            .map(|(own, step)| prior(own.surprise() + own.surprise_slope() * step))
            .sum();
        let gain = here.cost - self.bench.cost(&levels) - prior;
        (gain, solution[own..].to_vec(), levels)
    }
}

/// 1/√level of each number of the stacked spectra.
fn weights(bench: &Bench, levels: &[f64]) -> Vec<f64> {
    let mut weights = vec![0.0; bench.plant.length()];
    for ((band, count), level) in bench.bands.iter().zip(&bench.counts).zip(levels) {
        let weight = level.sqrt().recip() * (count / band.len() as f64).sqrt();
        band.iter().for_each(|place| weights[*place] = weight);
    }
    weights
}

fn weighted<C: AsRef<[f64]>>(weights: &[f64], columns: &[C]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(weights.len(), columns.len());
    for (index, column) in columns.iter().enumerate() {
        let mut own = matrix.column_mut(index);
        for ((own, value), weight) in own.as_mut_slice().iter_mut().zip(column.as_ref()).zip(weights) {
            *own = value * weight;
        }
    }
    matrix
}

/// AᵀS⁻¹A and AᵀS⁻¹Z.
pub(crate) struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Normal {
    pub fn of<C: AsRef<[f64]>>(bench: &Bench, levels: &[f64], columns: &[C], residual: &[f64]) -> Self {
        let weights = weights(bench, levels);
        Self::of_weighted(&weighted(&weights, columns), &weights, residual)
    }

    fn of_weighted(matrix: &DMatrix<f64>, weights: &[f64], residual: &[f64]) -> Self {
        let right = weighted(weights, &[residual]);
        Normal {
            right: matrix.tr_mul(&right).column(0).into_owned(),
            matrix: matrix.tr_mul(matrix),
        }
    }

    /// Adds what is believed of the unknowns, the first columns, and gives their pull.
    pub fn believe(&mut self, here: &Point) -> Vec<f64> {
        let mut pull = vec![0.0; self.right.len()];
        for (index, unknown) in here.composition.unknowns.iter().enumerate() {
            let slope = unknown.surprise_slope();
            self.matrix[(index, index)] += slope * slope;
            pull[index] = -slope * unknown.surprise();
        }
        pull
    }

    /// Solution of (matrix) x = right + pull; a column that the others make up gets nothing.
    pub fn solve(&self, pull: &[f64]) -> Vec<f64> {
        self.damped(pull, 0.0, 0, &vec![false; pull.len()])
    }

    /// The same with Marquardt's damping on the first `damped` columns, some of all held at 0.
    pub fn damped(&self, pull: &[f64], damping: f64, damped: usize, held: &[bool]) -> Vec<f64> {
        let size = pull.len();
        let scale: Vec<f64> = (0..size)
            .map(|index| self.matrix[(index, index)].max(0.0).sqrt())
            .collect();
        let used = |index: usize| !held[index] && scale[index] > 0.0;
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            if row == column {
                1.0 + RANK_TOLERANCE + if row < damped { damping } else { 0.0 }
            } else if used(row) && used(column) {
                self.matrix[(row, column)] / (scale[row] * scale[column])
            } else {
                0.0
            }
        });
        let right = DVector::from_fn(size, |row, _| {
            if used(row) {
                (self.right[row] + pull[row]) / scale[row]
            } else {
                0.0
            }
        });
        let Some(factor) = scaled.cholesky() else {
            return vec![0.0; size];
        };
        let solution = factor.solve(&right);
        (0..size)
            .map(|row| if used(row) { solution[row] / scale[row] } else { 0.0 })
            .collect()
    }

    pub fn inverse(&self) -> DMatrix<f64> {
        let size = self.right.len();
        let scale: Vec<f64> = (0..size)
            .map(|index| self.matrix[(index, index)].max(0.0).sqrt())
            .collect();
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            let product = scale[row] * scale[column];
            let own = if product > 0.0 {
                self.matrix[(row, column)] / product
            } else {
                0.0
            };
            own + if row == column { RANK_TOLERANCE } else { 0.0 }
        });
        let inverse = scaled
            .cholesky()
            .map_or_else(|| DMatrix::zeros(size, size), |factor| factor.inverse());
        DMatrix::from_fn(size, size, |row, column| {
            let product = scale[row] * scale[column];
            if product > 0.0 {
                inverse[(row, column)] / product
            } else {
                0.0
            }
        })
    }
}
