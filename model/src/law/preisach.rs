//! y = Σ_{i≥j} w_ij s_ij,  s_ij ← min(max(s_ij, L_i(v)), L_j(v)),  L_i(v) = clamp((v − l_i)/(l_{i+1} − l_i), 0, 1).
//!
//! Preisach's half plane α ≥ β, cut into cells by levels l_0 < … < l_n of the input: a cell switches up as v rises through its
//! row and down as v falls through its column, continuously over a level's width (a relay would jump). w_ij ≥ 0: its weight.
//! Weights are given one by one, or by a density of few numbers ([`Density`]).
//! Properties for w ≥ 0: monotone, return-point memory, wiping-out and congruent minor loops, to the bit. Without history:
//! demagnetised, the cells with α + β < 0 up, those above down.
//! A rising input touches the rows whose ramp it passes, a falling one the columns: the sums of other rows are kept.
//! Sources: Preisach (1935); Mayergoyz, *Mathematical Models of Hysteresis* (1991); the ramp: Krasnosel'skii and Pokrovskii
//! (1989).

use serde::{Deserialize, Serialize};

use super::density::{Density, cells_of};
use super::sums::{sum, sum_of_products};
use super::{HysteresisLaw, LawParameter};
use crate::ModelError;

/// Levels that a step passes have their ramp worked out once, the others once a row.
const NEAR: usize = 8;

/// The law with its cells worked out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Density", into = "Density")]
pub struct Preisach {
    density: Density,
    levels: Vec<f64>,
    weights: Vec<f64>,
}

impl From<Density> for Preisach {
    /// A density that [`Preisach::validate`] refuses has no cells.
    fn from(density: Density) -> Self {
        let (levels, weights) = if density.validate().is_ok() {
            density.cells()
        } else {
            (Vec::new(), Vec::new())
        };
        Preisach {
            density,
            levels,
            weights,
        }
    }
}

impl From<Preisach> for Density {
    fn from(law: Preisach) -> Density {
        law.density
    }
}

/// Where the cells are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreisachState {
    /// v.
    pub input: f64,
    /// s of every cell, row by row.
    pub cells: Vec<f64>,
    /// Σ_j w_ij s_ij of every row, as the last step that touched it left it.
    row_sums: Vec<f64>,
}

impl Preisach {
    /// Levels of the input, one more than rows.
    pub fn levels(&self) -> &[f64] {
        &self.levels
    }

    /// Weights of all cells, row by row, row i with columns 0 to i.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The weights that are free: of every cell, or the amplitude.
    pub(super) fn free_weights(&self) -> &[f64] {
        match &self.density {
            Density::Cells { weights, .. } => weights,
            Density::Lorentz { amplitude, .. } | Density::Logistic { amplitude, .. } => std::slice::from_ref(amplitude),
        }
    }

    pub(super) fn set_free_weights(&mut self, to: &[f64]) {
        match &mut self.density {
            Density::Cells { weights, .. } => {
                weights.copy_from_slice(to);
                self.weights.copy_from_slice(to);
            }
            Density::Lorentz { amplitude, .. } | Density::Logistic { amplitude, .. } => {
                *amplitude = to[0];
                *self = self.density.clone().into();
            }
        }
    }

    /// Sums of a state at the present weights.
    pub(super) fn reweigh(&self, state: &mut PreisachState) {
        let below = self.columns_below(state.input);
        for (row, sum) in state.row_sums.iter_mut().enumerate() {
            *sum = self.row_sum(row, &state.cells[Self::row(row)], below);
        }
    }

    pub(super) fn regressors(&self, state: &PreisachState, into: &mut Vec<f64>) {
        match &self.density {
            Density::Cells { .. } => into.extend(&state.cells),
            Density::Lorentz { amplitude, .. } | Density::Logistic { amplitude, .. } => {
                into.push(self.output(state) / amplitude)
            }
        }
    }

    fn rows(&self) -> usize {
        self.levels.len().saturating_sub(1)
    }

    /// L of a level.
    #[inline]
    fn ramp(&self, level: usize, input: f64) -> f64 {
        let low = self.levels[level];
        ((input - low) / (self.levels[level + 1] - low)).clamp(0.0, 1.0)
    }

    /// Levels whose ramp has a part between two inputs.
    fn between(&self, from: f64, to: f64) -> std::ops::Range<usize> {
        let (low, high) = if from < to { (from, to) } else { (to, from) };
        let begin = self.levels[1..].partition_point(|end| *end <= low);
        let end = self.levels[..self.rows()].partition_point(|level| *level < high);
        begin.min(end)..end
    }

    fn row(row: usize) -> std::ops::Range<usize> {
        cells_of(row)..cells_of(row + 1)
    }

    /// Moves the cells, and tells which row has changed.
    fn move_cells(&self, cells: &mut [f64], from: f64, to: f64, mut changed: impl FnMut(usize, &[f64])) {
        let levels = self.between(from, to);
        if to > from {
            for row in levels {
                let ramp = self.ramp(row, to);
                let own = &mut cells[Self::row(row)];
                own.iter_mut()
                    .for_each(|cell| *cell = if *cell < ramp { ramp } else { *cell });
                changed(row, own);
            }
        } else if !levels.is_empty() {
            for column in levels.clone() {
                let ramp = self.ramp(column, to);
                for row in column..self.rows() {
                    let cell = &mut cells[cells_of(row) + column];
                    *cell = if *cell > ramp { ramp } else { *cell };
                }
            }
            for row in levels.start..self.rows() {
                changed(row, &cells[Self::row(row)]);
            }
        }
    }

    /// Moves cells to an input: what a fit of the weights needs.
    pub fn follow(&self, cells: &mut [f64], from: f64, to: f64) {
        self.move_cells(cells, from, to, |_, _| {});
    }

    /// Columns that begin below an input; the others are down.
    fn columns_below(&self, input: f64) -> usize {
        self.levels[..self.rows()].partition_point(|level| *level < input)
    }

    /// Σ over one row with so many columns below the input, four of which are added at a time.
    fn row_sum(&self, row: usize, cells: &[f64], below: usize) -> f64 {
        let up = below.next_multiple_of(4).min(cells.len());
        sum_of_products(&self.weights[Self::row(row)][..up], &cells[..up])
    }

    /// Σ over one row with its cells moved on the way, and its slope there; `near`: ramps of the first of the levels.
    fn row_ahead(
        &self,
        state: &PreisachState,
        row: usize,
        to: f64,
        (levels, near): (&std::ops::Range<usize>, &[f64; NEAR]),
    ) -> (f64, f64) {
        let range = Self::row(row);
        let (cells, weights) = (&state.cells[range.clone()], &self.weights[range]);
        let inside = |level: usize| (self.levels[level]..self.levels[level + 1]).contains(&to);
        let steep = |level: usize| 1.0 / (self.levels[level + 1] - self.levels[level]);
        if to > state.input {
            let ramp = self.ramp(row, to);
            let (mut sum, mut moving) = (0.0, 0.0);
            for (cell, weight) in cells.iter().zip(weights) {
                sum += weight * if *cell < ramp { ramp } else { *cell };
                moving += if *cell <= ramp { *weight } else { 0.0 };
            }
            (sum, if inside(row) { moving * steep(row) } else { 0.0 })
        } else {
            let touched = levels.start..levels.end.min(row + 1);
            let (mut sum, mut slope) = (state.row_sums[row], 0.0);
            for column in touched {
                let ramp = match near.get(column - levels.start) {
                    Some(ramp) => *ramp,
                    None => self.ramp(column, to),
                };
                let (cell, weight) = (cells[column], weights[column]);
                if cell >= ramp {
                    sum -= weight * (cell - ramp);
                    slope += if inside(column) { weight * steep(column) } else { 0.0 };
                }
            }
            (sum, slope)
        }
    }
}

impl HysteresisLaw for Preisach {
    type State = PreisachState;

    fn rest(&self) -> PreisachState {
        let rows = self.rows();
        let middle = |level: usize| 0.5 * (self.levels[level] + self.levels[level + 1]);
        let mut cells = Vec::with_capacity(cells_of(rows));
        for row in 0..rows {
            for column in 0..=row {
                let sum = middle(row) + middle(column);
                let up = if sum < 0.0 {
                    1.0
                } else if sum > 0.0 {
                    0.0
                } else {
                    0.5
                };
                cells.push(f64::clamp(up, self.ramp(row, 0.0), self.ramp(column, 0.0)));
            }
        }
        let row_sums = (0..rows)
            .map(|row| self.row_sum(row, &cells[Self::row(row)], self.columns_below(0.0)))
            .collect();
        PreisachState {
            input: 0.0,
            cells,
            row_sums,
        }
    }

    fn parameters(&self) -> Vec<LawParameter> {
        self.density.parameters()
    }

    fn validate(&self) -> Result<(), ModelError> {
        self.density.validate()
    }

    fn input(state: &PreisachState) -> f64 {
        state.input
    }

    fn output(&self, state: &PreisachState) -> f64 {
        sum(state.row_sums.iter().copied())
    }

    fn advance(&self, state: &mut PreisachState, input_to: f64) {
        let below = self.columns_below(input_to);
        let PreisachState { input, cells, row_sums } = state;
        self.move_cells(cells, *input, input_to, |row, own| {
            row_sums[row] = self.row_sum(row, own, below)
        });
        *input = input_to;
    }

    fn ahead(&self, state: &PreisachState, input_to: f64) -> (f64, f64) {
        let levels = self.between(state.input, input_to);
        let rows = match (levels.is_empty(), input_to > state.input) {
            (true, _) => 0..0,
            (_, true) => levels.clone(),
            (_, false) => levels.start..self.rows(),
        };
        let mut near = [0.0; NEAR];
        for (ramp, level) in near.iter_mut().zip(levels.clone()) {
            *ramp = self.ramp(level, input_to);
        }
        let mut slope = 0.0;
        let output = sum((0..self.rows()).map(|row| {
            if !rows.contains(&row) {
                return state.row_sums[row];
            }
            let (own, own_slope) = self.row_ahead(state, row, input_to, (&levels, &near));
            slope += own_slope;
            own
        }));
        (output, slope)
    }

    fn slope(&self, state: &PreisachState, rising: bool) -> f64 {
        let inside = |level: &usize| {
            let (low, high) = (self.levels[*level], self.levels[*level + 1]);
            // On a level the side that the input goes to counts.
            if rising {
                low <= state.input && state.input < high
            } else {
                low < state.input && state.input <= high
            }
        };
        let Some(level) = (0..self.rows()).find(inside) else {
            return 0.0;
        };
        let ramp = self.ramp(level, state.input);
        let steep = 1.0 / (self.levels[level + 1] - self.levels[level]);
        let moving: f64 = if rising {
            let range = Self::row(level);
            let own = state.cells[range.clone()].iter().zip(&self.weights[range]);
            own.filter(|(cell, _)| **cell <= ramp).map(|(_, weight)| weight).sum()
        } else {
            let of_column = (level..self.rows()).map(|row| cells_of(row) + level);
            of_column
                .filter(|cell| state.cells[*cell] >= ramp)
                .map(|cell| self.weights[cell])
                .sum()
        };
        steep * moving
    }
}
