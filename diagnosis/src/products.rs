//! Inner products of columns, band by band: a fit under any levels is then algebra of small matrices.
//!
//! G_b = AᵀA over the numbers of band b. Under levels S the normal equations are Σ_b G_b w_b, and what a band has left of r − Aq is
//! (1, −q) G_b (1, −q)ᵀ where r is the first of the columns. So the long columns are gone through once, and not for every weight, multiple or level.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::normal::Normal;

/// Rows that are worked on together: those of all columns stay in the nearest caches.
const BLOCK: usize = 256;
const LANES: usize = 8;

/// Of columns over all bands.
#[derive(Clone)]
pub(crate) struct Products {
    bands: Vec<DMatrix<f64>>,
}

impl Products {
    pub fn of(bands: &[Vec<usize>], columns: &[&[f64]]) -> Self {
        let of_band = |band: &Vec<usize>| products(band, columns, DMatrix::zeros(0, 0));
        Products {
            bands: bands.iter().map(of_band).collect(),
        }
    }

    /// The same of `columns`, of which the first are those that these products are of.
    pub fn with_further(&self, bands: &[Vec<usize>], columns: &[&[f64]]) -> Self {
        let all = bands.iter().zip(&self.bands);
        Products {
            bands: all
                .map(|(band, known)| products(band, columns, known.clone()))
                .collect(),
        }
    }

    /// Energy of each band in the first column less multiples of the others.
    pub fn left(&self, multiples: &[f64]) -> Vec<f64> {
        let size = multiples.len() + 1;
        let weights = DVector::from_fn(size, |row, _| if row == 0 { 1.0 } else { -multiples[row - 1] });
        let energy = |own: &DMatrix<f64>| weights.dot(&(own.view((0, 0), (size, size)) * &weights)).max(0.0);
        self.bands.iter().map(energy).collect()
    }

    /// Normal equations for the first column by the others, each band under its weight.
    pub fn normal(&self, weights: &[f64]) -> Normal {
        let size = self.bands.first().map_or(1, DMatrix::nrows);
        let mut sum = DMatrix::zeros(size, size);
        for (own, weight) in self.bands.iter().zip(weights) {
            sum += own * *weight;
        }
        Normal {
            matrix: sum.view((1, 1), (size - 1, size - 1)).into_owned(),
            right: sum.view((1, 0), (size - 1, 1)).column(0).into_owned(),
        }
    }
}

/// Products of all columns over a band, those of the first of them `known`.
fn products(band: &[usize], columns: &[&[f64]], known: DMatrix<f64>) -> DMatrix<f64> {
    let (from, size) = (known.nrows(), columns.len());
    let places = band
        .first()
        .zip(band.last())
        .map_or(0..0, |(first, last)| *first..last + 1);
    let is_whole = places.len() == band.len();
    // Most columns answer in one channel only; of a known one its energy tells.
    let answers = |index: &usize| {
        let column = columns[*index];
        match is_whole {
            _ if *index < from => known[(*index, *index)] != 0.0,
            // A column of nothing is gone through to its end: by blocks, not number by number.
            true => column[places.clone()]
                .chunks(BLOCK)
                .any(|own| own.iter().fold(0, |bits, own| bits | own.to_bits() << 1) != 0),
            false => band.iter().any(|place| column[*place] != 0.0),
        }
    };
    let used: Vec<usize> = (0..size).filter(answers).collect();
    let mut all = known.resize(size, size, 0.0);
    let mut gathered = vec![0.0; if is_whole { 0 } else { BLOCK * used.len() }];
    for start in (0..band.len()).step_by(BLOCK) {
        let rows = start..band.len().min(start + BLOCK);
        let block: Vec<&[f64]> = if is_whole {
            let at = places.start + rows.start..places.start + rows.end;
            used.iter().map(|index| &columns[*index][at.clone()]).collect()
        } else {
            for (own, index) in gathered.chunks_mut(BLOCK).zip(&used) {
                for (value, place) in own.iter_mut().zip(&band[rows.clone()]) {
                    *value = columns[*index][*place];
                }
            }
            gathered.chunks(BLOCK).map(|own| &own[..rows.len()]).collect()
        };
        for (place, column) in used.iter().enumerate().filter(|(_, column)| **column >= from) {
            add_dots(&block, place, &mut |other, dot| all[(used[other], *column)] += dot);
        }
    }
    for column in from..size {
        for row in 0..column {
            all[(column, row)] = all[(row, column)];
        }
    }
    all
}

/// Products of one column with all up to it.
fn add_dots(block: &[&[f64]], place: usize, add: &mut impl FnMut(usize, f64)) {
    let mut other = 0;
    while other + 4 <= place + 1 {
        let four = [block[other], block[other + 1], block[other + 2], block[other + 3]];
        for (offset, dot) in dots(block[place], four).into_iter().enumerate() {
            add(other + offset, dot);
        }
        other += 4;
    }
    for other in other..=place {
        let [dot] = dots(block[place], [block[other]]);
        add(other, dot);
    }
}

/// On the widest instructions there are: the lanes are the same on all, and so are the bits.
fn dots<const N: usize>(one: &[f64], others: [&[f64]; N]) -> [f64; N] {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has it.
        return unsafe { dots_avx2(one, others) };
    }
    dots_in_lanes(one, others)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn dots_avx2<const N: usize>(one: &[f64], others: [&[f64]; N]) -> [f64; N] {
    dots_in_lanes(one, others)
}

#[inline(always)]
fn dots_in_lanes<const N: usize>(one: &[f64], others: [&[f64]; N]) -> [f64; N] {
    let mut sums = [[0.0; LANES]; N];
    let whole = one.len() - one.len() % LANES;
    let at = |from: usize| -> Range<usize> { from..from + LANES };
    for from in (0..whole).step_by(LANES) {
        let own = &one[at(from)];
        for (sum, other) in sums.iter_mut().zip(&others) {
            for ((lane, own), other) in sum.iter_mut().zip(own).zip(&other[at(from)]) {
                *lane += own * other;
            }
        }
    }
    std::array::from_fn(|index| {
        let rest = one[whole..].iter().zip(&others[index][whole..]);
        sums[index].iter().sum::<f64>() + rest.map(|(own, other)| own * other).sum::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards every fit: products by band, whole or with gaps, and further columns beside known ones, are those of the definition.
    #[test]
    fn products_are_sums_over_their_band() {
        let wave = |turns: f64| {
            (0..3000)
                .map(move |row| (turns * f64::from(row)).sin())
                .collect::<Vec<f64>>()
        };
        let mut columns: Vec<Vec<f64>> = (1..8).map(|own| wave(0.37 * f64::from(own))).collect();
        columns[3][100..].fill(0.0);
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let bands = [
            (1..17).collect::<Vec<usize>>(),
            (17..1900).collect(),
            (1900..3000).step_by(3).collect(),
        ];
        let all = Products::of(&bands, &columns[..3]).with_further(&bands, &columns);
        for (band, own) in bands.iter().zip(&all.bands) {
            for (row, one) in columns.iter().enumerate() {
                for (column, other) in columns.iter().enumerate() {
                    let sum: f64 = band.iter().map(|place| one[*place] * other[*place]).sum();
                    assert!((own[(row, column)] - sum).abs() < 1e-9, "{row}, {column}: {sum}");
                }
            }
        }
        let left = all.left(&[0.5, 0.0, 0.0, 0.0, 0.0, -2.0]);
        let energy: f64 = bands[1]
            .iter()
            .map(|place| (columns[0][*place] - 0.5 * columns[1][*place] + 2.0 * columns[6][*place]).powi(2))
            .sum();
        assert!((left[1] / energy - 1.0).abs() < 1e-12);
    }
}
