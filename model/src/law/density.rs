//! μ(α, β): how much of Preisach's half plane switches up at α and down at β, as weights of cells.
//!
//! Cell by cell, or a product of two distributions of few numbers:
//! μ = A p((α − h₀)/σ) p((β + h₀)/σ), p(x) = 1/(1 + x²): Lorentz, of coercivity h₀ and width σ, as magnets have it;
//! μ = A q((α − α₀)/σ₁) q((β − β₀)/σ₂), q(x) = 1/cosh² x: logistic, as a wire has it that remembers its shape: it changes over
//! at one temperature and back at another, neither about 0 nor alike.
//! Sources: the product form: Bertotti, *Hysteresis in Magnetism* (1998), ch. 14; shape memory: Hughes and Wen, Smart Materials and
//! Structures 6 (1997) 287.

use serde::{Deserialize, Serialize};

use super::LawParameter;
use crate::ModelError;
use crate::error::{require, require_not_negative, require_positive};

/// w over the half plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Density {
    /// Every cell has its own weight.
    Cells {
        /// Rising; one more than rows. Unit of the input.
        levels: Vec<f64>,
        /// Row by row, row i with columns 0 to i. Unit of the output.
        weights: Vec<f64>,
    },
    /// A product of two Lorentz distributions.
    Lorentz {
        /// The sum of all weights ≥ 0, unit of the output.
        amplitude: f64,
        /// h₀ ≥ 0, unit of the input.
        coercivity: f64,
        /// σ > 0, unit of the input.
        width: f64,
        /// The levels go from −reach to reach, > 0, unit of the input; beyond, nothing switches.
        reach: f64,
        /// Rows; closer together about 0.
        rows: usize,
    },
    /// A product of two logistic distributions: one over where cells switch up, one over where they switch down.
    Logistic {
        /// The sum of all weights ≥ 0, unit of the output.
        amplitude: f64,
        /// α₀ and its width > 0, unit of the input.
        up: [f64; 2],
        /// β₀ and its width > 0, unit of the input.
        down: [f64; 2],
        /// The levels go at equal distances from the first to the second, unit of the input; beyond, nothing switches.
        between: [f64; 2],
        /// Rows.
        rows: usize,
    },
}

/// Levels by a sinh are closer about 0 by this power of e.
const CROWDING: f64 = 3.0;
/// More rows than this are a step too slow for any loop.
const MAX_ROWS: usize = 512;

impl Density {
    /// Levels from −reach to reach, symmetric, closer together about 0.
    pub fn crowded_levels(reach: f64, rows: usize) -> Vec<f64> {
        let at = |level: usize| (2 * level) as f64 / rows as f64 - 1.0;
        let scale = reach / libm::sinh(CROWDING);
        (0..=rows)
            .map(|level| scale * libm::sinh(CROWDING * at(level)))
            .collect()
    }

    /// Levels at equal distances.
    pub fn even_levels([low, high]: [f64; 2], rows: usize) -> Vec<f64> {
        (0..=rows)
            .map(|level| low + (high - low) * level as f64 / rows as f64)
            .collect()
    }

    pub(super) fn parameters(&self) -> Vec<LawParameter> {
        match self {
            Density::Cells { weights, .. } => {
                let named = weights.iter().enumerate();
                named
                    .map(|(cell, weight)| LawParameter::weight(format!("weight of cell {cell}"), *weight))
                    .collect()
            }
            Density::Lorentz {
                amplitude,
                coercivity,
                width,
                ..
            } => vec![
                LawParameter::weight("amplitude", *amplitude),
                LawParameter::weight("coercivity", *coercivity),
                LawParameter::weight("width", *width),
            ],
            Density::Logistic {
                amplitude, up, down, ..
            } => {
                let any = [f64::NEG_INFINITY, f64::INFINITY];
                vec![
                    LawParameter::weight("amplitude", *amplitude),
                    LawParameter::new("switches up at", up[0], any),
                    LawParameter::weight("width of switching up", up[1]),
                    LawParameter::new("switches down at", down[0], any),
                    LawParameter::weight("width of switching down", down[1]),
                ]
            }
        }
    }

    pub(super) fn validate(&self) -> Result<(), ModelError> {
        match self {
            Density::Cells { levels, weights } => {
                let rows = levels.len().saturating_sub(1);
                rows_in_range(rows)?;
                for pair in levels.windows(2) {
                    require_positive(pair[1] - pair[0], "distance of two levels", "(unit of the input)")?;
                }
                if weights.len() != cells_of(rows) {
                    return Err(ModelError::LengthsDiffer {
                        quantity: "weights of cells",
                        needed: cells_of(rows),
                        given: weights.len(),
                    });
                }
                let each = weights.iter();
                each.copied()
                    .try_for_each(|weight| require_not_negative(weight, "weight of a cell", "(unit of the output)"))
            }
            Density::Lorentz {
                amplitude,
                coercivity,
                width,
                reach,
                rows,
            } => {
                rows_in_range(*rows)?;
                require_not_negative(*amplitude, "amplitude of a density", "(unit of the output)")?;
                require_not_negative(*coercivity, "coercivity of a density", "(unit of the input)")?;
                require_positive(*width, "width of a density", "(unit of the input)")?;
                require_positive(*reach, "reach of a density", "(unit of the input)")
            }
            Density::Logistic {
                amplitude,
                up,
                down,
                between,
                rows,
            } => {
                rows_in_range(*rows)?;
                require_not_negative(*amplitude, "amplitude of a density", "(unit of the output)")?;
                for [middle, width] in [up, down] {
                    let named = "middle of a density";
                    require(true, named, *middle, "(unit of the input)", "finite")?;
                    require_positive(*width, "width of a density", "(unit of the input)")?;
                }
                require_positive(between[1] - between[0], "distance of two levels", "(unit of the input)")
            }
        }
    }

    /// Levels and weights.
    pub(super) fn cells(&self) -> (Vec<f64>, Vec<f64>) {
        match self {
            Density::Cells { levels, weights } => (levels.clone(), weights.clone()),
            Density::Lorentz {
                amplitude,
                coercivity,
                width,
                reach,
                rows,
            } => {
                let levels = Self::crowded_levels(*reach, *rows);
                let density = |about: f64| 1.0 / (1.0 + (about / width) * (about / width));
                let middle = |level: usize| 0.5 * (levels[level] + levels[level + 1]);
                let span = |level: usize| levels[level + 1] - levels[level];
                let up = (0..*rows).map(|row| density(middle(row) - coercivity) * span(row));
                let down = (0..*rows).map(|column| density(middle(column) + coercivity) * span(column));
                let weights = product(*amplitude, &up.collect::<Vec<_>>(), &down.collect::<Vec<_>>());
                (levels, weights)
            }
            Density::Logistic {
                amplitude,
                up,
                down,
                between,
                rows,
            } => {
                let levels = Self::even_levels(*between, *rows);
                // Of a cell the whole of its distribution, which may be narrower.
                let within = |[middle, width]: [f64; 2]| -> Vec<f64> {
                    let shares = levels.iter().map(|level| libm::tanh((level - middle) / width));
                    let shares: Vec<f64> = shares.collect();
                    shares.windows(2).map(|pair| pair[1] - pair[0]).collect()
                };
                let weights = product(*amplitude, &within(*up), &within(*down));
                (levels, weights)
            }
        }
    }
}

/// The cells' weights: one factor of the row, one of the column, in all an amplitude.
fn product(amplitude: f64, up: &[f64], down: &[f64]) -> Vec<f64> {
    let mut weights = Vec::with_capacity(cells_of(up.len()));
    for (row, of_row) in up.iter().enumerate() {
        for (column, of_column) in down[..=row].iter().enumerate() {
            // Of a cell on the diagonal the half plane has one half.
            let share = if row == column { 0.5 } else { 1.0 };
            weights.push(share * of_row * of_column);
        }
    }
    let sum: f64 = weights.iter().sum();
    // All of it beyond the levels: nothing switches.
    let scale = if sum > 0.0 { amplitude / sum } else { 0.0 };
    weights.iter_mut().for_each(|weight| *weight *= scale);
    weights
}

pub(super) fn cells_of(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

fn rows_in_range(rows: usize) -> Result<(), ModelError> {
    let accepted = (1..=MAX_ROWS).contains(&rows);
    require(
        accepted,
        "number of rows of a Preisach plane",
        rows as f64,
        "",
        "from 1 to 512",
    )
}
