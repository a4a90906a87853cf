//! min over u, β of |z − m(u) − Lβ|² + Σ ((v_i − p_i)/s_i)²: Levenberg-Marquardt between bounds.
//!
//! z measured, m model, L linear columns, all over their noise, so χ² is in units of one; v values of the coordinates u
//! (v = u·scale, or v = e^u where sizes spread by ratio), p and s mean and standard deviation of a prior.
//! m is a free-running simulation; its derivative is a forward difference. A coordinate that stands at a bound and would leave it
//! is held for that step. A simulation that the model refuses counts as a step too far. It stops when a step promises less
//! than `SMALLEST_GAIN` of χ²: less than chance moves it by.
//! Source: Marquardt (1963); standard deviations from the inverse of JᵀJ.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::coordinate::Coordinate;
use anhyst_identify::parallel;

/// A decrease of χ² that is not worth another simulation.
const SMALLEST_GAIN: f64 = 0.02;
/// Most steps; ill-conditioned problems crawl for ever.
const MOST_STEPS: usize = 30;

/// What is to be fitted.
pub(crate) struct Problem<'a> {
    pub measured: &'a [f64],
    /// Rows that count; the others are only predicted.
    pub training: &'a [Range<usize>],
    pub linear: &'a [Vec<f64>],
    pub coordinates: &'a [Coordinate],
    /// The model over its noise; None where it refuses the values.
    pub model: &'a (dyn Fn(&[f64]) -> Option<Vec<f64>> + Sync),
    pub threads: usize,
}

/// What was found.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub values: Vec<f64>,
    /// z − m − Lβ on all rows.
    pub residual: Vec<f64>,
    /// d(m + Lβ)/du and /dβ on all rows: what the fit could move.
    pub columns: Vec<Vec<f64>>,
    /// On the training rows, without the prior's share.
    pub chi_square: f64,
    /// Of values and then linear coefficients; infinite where the data say nothing.
    pub standard_deviations: Vec<f64>,
}

/// Inner product over the training rows.
pub(crate) fn dot(training: &[Range<usize>], a: &[f64], b: &[f64]) -> f64 {
    training
        .iter()
        .map(|range| dot_all(&a[range.clone()], &b[range.clone()]))
        .sum()
}

/// Inner product in eight lanes, so that it runs at the speed of memory.
pub(crate) fn dot_all(a: &[f64], b: &[f64]) -> f64 {
    let (a_chunks, b_chunks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_chunks
        .remainder()
        .iter()
        .zip(b_chunks.remainder())
        .map(|(a, b)| a * b)
        .sum();
    let mut lanes = [0.0; 8];
    for (a, b) in a_chunks.zip(b_chunks) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

impl Problem<'_> {
    /// From `start` values; None if the model refuses the start.
    pub fn solve(&self, start: &[f64]) -> Option<Solution> {
        let mut values: Vec<f64> = start
            .iter()
            .zip(self.coordinates)
            .map(|(v, c)| c.value(c.free(v.clamp(c.lower, c.upper))))
            .collect();
        let mut linear = vec![0.0; self.linear.len()];
        let mut model = (self.model)(&values)?;
        let mut residual = self.residual(&model, &linear);
        let mut cost = self.cost(&residual, &values);
        let mut damping = 1e-3;
        let mut columns = self.columns(&values, &model)?;
        let steps = if columns.is_empty() { 0 } else { MOST_STEPS };
        for _ in 0..steps {
            let (normal, gradient) = self.normal_equations(&columns, &residual, &values);
            let held = self.held(&values, &gradient);
            let mut moved = false;
            let mut promise = 0.0;
            for _ in 0..8 {
                let Some(step) = damped_step(&normal, &gradient, damping, &held) else {
                    damping *= 10.0;
                    continue;
                };
                let (tried, tried_linear) = self.stepped(&values, &linear, &step);
                promise = step.dot(&gradient);
                let candidate = (self.model)(&tried).map(|model| {
                    let residual = self.residual(&model, &tried_linear);
                    let cost = self.cost(&residual, &tried);
                    (model, residual, cost)
                });
                if let Some((tried_model, tried_residual, tried_cost)) = candidate
                    && tried_cost < cost
                {
                    let gain = cost - tried_cost;
                    (values, linear, model, residual, cost) =
                        (tried, tried_linear, tried_model, tried_residual, tried_cost);
                    damping = (damping * 0.1).max(1e-9);
                    moved = gain > SMALLEST_GAIN;
                    break;
                }
                if promise < SMALLEST_GAIN {
                    break;
                }
                damping *= 10.0;
            }
            if !moved || promise < SMALLEST_GAIN {
                break;
            }
            columns = self.columns(&values, &model)?;
        }
        Some(self.solution(values, residual, columns))
    }

    fn residual(&self, model: &[f64], linear: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = self.measured.iter().zip(model).map(|(z, m)| z - m).collect();
        for (column, coefficient) in self.linear.iter().zip(linear) {
            if *coefficient != 0.0 {
                for (r, c) in residual.iter_mut().zip(column) {
                    *r -= coefficient * c;
                }
            }
        }
        residual
    }

    fn cost(&self, residual: &[f64], values: &[f64]) -> f64 {
        let prior = values.iter().zip(self.coordinates).filter_map(|(value, coordinate)| {
            let (mean, deviation) = coordinate.prior?;
            Some(((value - mean) / deviation) * ((value - mean) / deviation))
        });
        dot(self.training, residual, residual) + prior.sum::<f64>()
    }

    /// Forward differences of the model, then the linear columns.
    fn columns(&self, values: &[f64], model: &[f64]) -> Option<Vec<Vec<f64>>> {
        let indices: Vec<usize> = (0..values.len()).collect();
        let differences = parallel::map(self.threads, &indices, |&index| {
            let coordinate = &self.coordinates[index];
            if coordinate.lower >= coordinate.upper {
                return Some(vec![0.0; model.len()]);
            }
            let free = coordinate.free(values[index]);
            let difference = |step: f64| {
                let mut moved = values.to_vec();
                moved[index] = coordinate.value(free + step);
                let mut column = (self.model)(&moved)?;
                let inverse = 1.0 / (coordinate.free(moved[index]) - free);
                for (c, m) in column.iter_mut().zip(model) {
                    *c = (*c - m) * inverse;
                }
                inverse.is_finite().then_some(column)
            };
            let step = coordinate.step(values[index]);
            difference(step).or_else(|| difference(-step))
        });
        let mut columns = differences.into_iter().collect::<Option<Vec<_>>>()?;
        columns.extend(self.linear.iter().cloned());
        Some(columns)
    }

    /// JᵀJ and Jᵀr with the prior's rows.
    fn normal_equations(&self, columns: &[Vec<f64>], residual: &[f64], values: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let size = columns.len();
        let mut normal = DMatrix::zeros(size, size);
        for row in 0..size {
            for column in row..size {
                let product = dot(self.training, &columns[row], &columns[column]);
                normal[(row, column)] = product;
                normal[(column, row)] = product;
            }
        }
        let mut gradient = DVector::from_iterator(size, columns.iter().map(|c| dot(self.training, c, residual)));
        for (index, (value, coordinate)) in values.iter().zip(self.coordinates).enumerate() {
            if let Some((mean, deviation)) = coordinate.prior {
                let slope = coordinate.slope(*value) / deviation;
                normal[(index, index)] += slope * slope;
                gradient[index] -= slope * (value - mean) / deviation;
            }
        }
        (normal, gradient)
    }

    /// Coordinates at a bound whose gradient points outwards.
    fn held(&self, values: &[f64], gradient: &DVector<f64>) -> Vec<bool> {
        let mut held: Vec<bool> = values
            .iter()
            .zip(self.coordinates)
            .enumerate()
            .map(|(index, (value, coordinate))| {
                (*value <= coordinate.lower && gradient[index] < 0.0)
                    || (*value >= coordinate.upper && gradient[index] > 0.0)
            })
            .collect();
        held.resize(values.len() + self.linear.len(), false);
        held
    }

    fn stepped(&self, values: &[f64], linear: &[f64], step: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
        let moved = values
            .iter()
            .zip(self.coordinates)
            .enumerate()
            .map(|(index, (value, coordinate))| {
                // A logarithmic coordinate moves by at most a factor of ten a step.
                let step = if coordinate.logarithmic {
                    step[index].clamp(-2.3, 2.3)
                } else {
                    step[index]
                };
                coordinate.value(coordinate.free(*value) + step)
            })
            .collect();
        let coefficients = linear
            .iter()
            .enumerate()
            .map(|(index, value)| value + step[values.len() + index]);
        (moved, coefficients.collect())
    }

    fn solution(&self, values: Vec<f64>, residual: Vec<f64>, columns: Vec<Vec<f64>>) -> Solution {
        let (normal, _) = self.normal_equations(&columns, &residual, &values);
        let size = columns.len();
        // Scaled to a unit diagonal, so that the inverse is as good as the data allow.
        let scales: Vec<f64> = (0..size).map(|index| normal[(index, index)].sqrt()).collect();
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            let scale = scales[row] * scales[column];
            if scale > 0.0 {
                normal[(row, column)] / scale
            } else {
                f64::from(u8::from(row == column))
            }
        });
        let inverse = scaled.try_inverse();
        let deviation = |index: usize| match &inverse {
            Some(inverse) if scales[index] > 0.0 && inverse[(index, index)] > 0.0 => {
                inverse[(index, index)].sqrt() / scales[index]
            }
            _ => f64::INFINITY,
        };
        let slope = |index: usize| {
            values
                .get(index)
                .zip(self.coordinates.get(index))
                .map_or(1.0, |(value, coordinate)| coordinate.slope(*value))
        };
        let standard_deviations = (0..size).map(|index| deviation(index) * slope(index)).collect();
        Solution {
            chi_square: dot(self.training, &residual, &residual),
            values,
            residual,
            columns,
            standard_deviations,
        }
    }
}

/// (JᵀJ + μ diag)⁻¹ Jᵀr with some coordinates held.
fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64, held: &[bool]) -> Option<DVector<f64>> {
    let size = gradient.len();
    let mut matrix = normal.clone();
    let mut right = gradient.clone();
    for index in 0..size {
        let diagonal = matrix[(index, index)];
        if held[index] || diagonal <= 0.0 {
            matrix.row_mut(index).fill(0.0);
            matrix.column_mut(index).fill(0.0);
            matrix[(index, index)] = 1.0;
            right[index] = 0.0;
        } else {
            matrix[(index, index)] = diagonal * (1.0 + damping);
        }
    }
    matrix.cholesky().map(|factor| factor.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: Coordinate = Coordinate {
        lower: 0.0,
        upper: 10.0,
        scale: 0.1,
        logarithmic: false,
        prior: None,
    };

    fn decay(values: &[f64]) -> Option<Vec<f64>> {
        Some(
            (0..200)
                .map(|k| 100.0 * values[0] * (-f64::from(k) * 0.02 * values[1]).exp())
                .collect(),
        )
    }

    /// Guards the engine under every verdict: amplitude, rate and a free zero are found from half the rows.
    #[test]
    fn a_decay_with_a_free_zero_is_found_from_half_the_rows() {
        let measured: Vec<f64> = decay(&[2.0, 3.0]).unwrap().iter().map(|m| m + 7.0).collect();
        let rate = Coordinate {
            logarithmic: true,
            lower: 1e-3,
            ..ANY
        };
        let problem = Problem {
            measured: &measured,
            training: &[0..50, 100..150],
            linear: &[vec![1.0; 200]],
            coordinates: &[ANY, rate],
            model: &decay,
            threads: 1,
        };
        let solution = problem.solve(&[0.5, 0.3]).unwrap();
        assert!((solution.values[0] - 2.0).abs() < 1e-4, "{:?}", solution.values);
        assert!((solution.values[1] - 3.0).abs() < 1e-3, "{:?}", solution.values);
        assert!(solution.residual.iter().all(|r| r.abs() < 0.01));
    }

    /// Guards sizes that cannot be negative: the fit stays at the bound and does not stall there.
    #[test]
    fn a_bound_holds_and_the_rest_goes_on() {
        let measured: Vec<f64> = decay(&[2.0, 3.0]).unwrap();
        let bounded = Coordinate { lower: 2.5, ..ANY };
        let problem = Problem {
            measured: &measured,
            training: &[0..100, 100..200],
            linear: &[],
            coordinates: &[bounded, ANY],
            model: &decay,
            threads: 2,
        };
        let solution = problem.solve(&[5.0, 1.0]).unwrap();
        assert_eq!(solution.values[0], 2.5);
        assert!((solution.values[1] - 4.0).abs() < 0.5, "{:?}", solution.values);
    }

    /// Guards priors: with data that say nothing, the fit is the prior and so is its standard deviation.
    #[test]
    fn without_data_the_prior_is_the_answer() {
        let known = Coordinate {
            prior: Some((1.5, 0.2)),
            ..ANY
        };
        let problem = Problem {
            measured: &[0.0; 10],
            training: &[0..5, 5..10],
            linear: &[],
            coordinates: &[known],
            model: &|_| Some(vec![0.0; 10]),
            threads: 1,
        };
        let solution = problem.solve(&[4.0]).unwrap();
        assert!((solution.values[0] - 1.5).abs() < 1e-6);
        assert!((solution.standard_deviations[0] - 0.2).abs() < 1e-6);
    }
}
