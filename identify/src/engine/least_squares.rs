//! min over u, β of |z − m(u) − Lβ|² + Σ ((v_i − p_i)/s_i)²: Levenberg-Marquardt between bounds, linear columns profiled out.
//!
//! z measured, m model, L linear columns, all over their noise, so χ² is in units of one; v values of the coordinates u
//! (v = u·scale, or v = e^u where sizes spread by ratio), p and s mean and standard deviation of a prior. β is solved for
//! at every u ([`Span`]), so the steps are those of u alone.
//! m is a free-running simulation; its derivative is a forward difference. A coordinate that stands at a bound and would leave it
//! is held for that step. A simulation that the model refuses counts as a step too far. It stops when a step promises less
//! than [`Stop`] asks for. Own code, because no kept crate has bounds with priors and derivatives side by side on threads.
//! Source: Marquardt (1963); profiling: Golub and Pereyra (1973).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::coordinate::Coordinate;
use super::covariance::Covariance;
use super::simulator::Simulator;
use super::span::{Span, dot};
use crate::parallel;

/// A logarithmic coordinate moves by at most a factor of ten a step.
const MAX_LOG_STEP: f64 = 2.3;
/// Dampings that are tried for one step.
const MAX_DAMPINGS: usize = 8;

/// When another step is not worth its simulations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// A decrease of χ² by less than this.
    pub gain: f64,
    /// A decrease by less than this share of it.
    pub share: f64,
    /// Ill-conditioned problems crawl for ever.
    pub steps: usize,
}

impl Stop {
    /// For residuals over their noise: less than chance moves χ² by.
    pub const CHANCE: Stop = Stop {
        gain: 0.02,
        share: 0.0,
        steps: 30,
    };

    fn gain_at(&self, cost: f64) -> f64 {
        self.gain.max(self.share * cost)
    }
}

/// What is to be fitted.
pub struct Problem<'a> {
    pub measured: &'a [f64],
    /// Rows that count; the others are only predicted.
    pub training: &'a [Range<usize>],
    pub linear: &'a [Vec<f64>],
    pub coordinates: &'a [Coordinate],
    pub simulator: &'a dyn Simulator,
    pub stop: Stop,
    pub threads: usize,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Solution {
    pub values: Vec<f64>,
    /// β.
    pub coefficients: Vec<f64>,
    /// z − m − Lβ on all rows.
    pub residual: Vec<f64>,
    /// d(m + Lβ)/dv and /dβ on all rows: what the fit could move.
    pub columns: Vec<Vec<f64>>,
    /// On the training rows, without the prior's share.
    pub chi_square: f64,
}

impl Solution {
    /// How well blocks of rows and the priors fix values and then coefficients.
    pub fn covariance(&self, coordinates: &[Coordinate], blocks: &[Range<usize>]) -> Covariance {
        let priors: Vec<Option<f64>> = coordinates.iter().map(|own| Some(own.prior?.1)).collect();
        Covariance::of(&self.columns, &priors, &self.residual, blocks)
    }
}

/// The model at some values.
struct Point {
    values: Vec<f64>,
    model: Vec<f64>,
    residual: Vec<f64>,
    cost: f64,
}

impl Problem<'_> {
    /// From `start` values; None if the model refuses the start.
    pub fn solve(&self, start: &[f64]) -> Option<Solution> {
        let span = Span::of(self.linear, self.training);
        let inside = start.iter().zip(self.coordinates);
        let inside = inside.map(|(v, c)| c.value(c.free(v.clamp(c.lower, c.upper))));
        let mut here = self.at(&span, inside.collect())?;
        let mut damping = 1e-3;
        let mut columns = self.columns(&here)?;
        let steps = if columns.is_empty() { 0 } else { self.stop.steps };
        for _ in 0..steps {
            let worth = self.stop.gain_at(here.cost);
            let (normal, gradient) = self.normal_equations(&span, &columns, &here);
            let held = self.held(&here.values, &gradient);
            let mut moved = false;
            let mut promise = 0.0;
            for _ in 0..MAX_DAMPINGS {
                let Some(step) = damped_step(&normal, &gradient, damping, &held) else {
                    damping *= 10.0;
                    continue;
                };
                promise = step.dot(&gradient);
                let tried = self.at(&span, self.stepped(&here.values, &step));
                if let Some(tried) = tried.filter(|tried| tried.cost < here.cost) {
                    moved = here.cost - tried.cost > worth;
                    here = tried;
                    damping = (damping * 0.1).max(1e-9);
                    break;
                }
                if promise < worth {
                    break;
                }
                damping *= 10.0;
            }
            if !moved || promise < worth {
                break;
            }
            columns = self.columns(&here)?;
        }
        Some(self.solution(&span, here, columns))
    }

    /// χ² with the priors' share at some values; None if the model refuses them.
    pub fn cost(&self, values: &[f64]) -> Option<f64> {
        let span = Span::of(self.linear, self.training);
        Some(self.at(&span, values.to_vec())?.cost)
    }

    fn at(&self, span: &Span, values: Vec<f64>) -> Option<Point> {
        let model = self.simulator.outputs(&values)?;
        let residual = span.without(self.measured.iter().zip(&model).map(|(z, m)| z - m).collect());
        let prior = values.iter().zip(self.coordinates).filter_map(|(value, coordinate)| {
            let (mean, deviation) = coordinate.prior?;
            Some(((value - mean) / deviation) * ((value - mean) / deviation))
        });
        let cost = dot(self.training, &residual, &residual) + prior.sum::<f64>();
        cost.is_finite().then_some(Point {
            values,
            model,
            residual,
            cost,
        })
    }

    /// Forward differences of the model by u.
    fn columns(&self, here: &Point) -> Option<Vec<Vec<f64>>> {
        let indices: Vec<usize> = (0..here.values.len()).collect();
        let differences = parallel::map(self.threads, &indices, |&index| {
            let coordinate = &self.coordinates[index];
            if coordinate.lower >= coordinate.upper {
                return Some(vec![0.0; here.model.len()]);
            }
            let free = coordinate.free(here.values[index]);
            let difference = |step: f64| {
                let mut moved = here.values.clone();
                moved[index] = coordinate.value(free + step);
                let mut column = self.simulator.outputs(&moved)?;
                let inverse = 1.0 / (coordinate.free(moved[index]) - free);
                for (c, m) in column.iter_mut().zip(&here.model) {
                    *c = (*c - m) * inverse;
                }
                inverse.is_finite().then_some(column)
            };
            let step = coordinate.step(here.values[index]);
            difference(step).or_else(|| difference(-step))
        });
        differences.into_iter().collect()
    }

    /// JᵀJ and Jᵀr of what the linear columns leave of J, with the prior's rows; r has nothing of theirs.
    fn normal_equations(&self, span: &Span, columns: &[Vec<f64>], here: &Point) -> (DMatrix<f64>, DVector<f64>) {
        let size = columns.len();
        let shares: Vec<Vec<f64>> = columns.iter().map(|column| span.shares(column)).collect();
        let mut normal = DMatrix::zeros(size, size);
        for row in 0..size {
            for column in row..size {
                let of_linear: f64 = shares[row].iter().zip(&shares[column]).map(|(a, b)| a * b).sum();
                let product = dot(self.training, &columns[row], &columns[column]) - of_linear;
                normal[(row, column)] = product;
                normal[(column, row)] = product;
            }
        }
        let along = |column: &Vec<f64>| dot(self.training, column, &here.residual);
        let mut gradient = DVector::from_iterator(size, columns.iter().map(along));
        for (index, (value, coordinate)) in here.values.iter().zip(self.coordinates).enumerate() {
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
        let outwards = |(index, (value, coordinate)): (usize, (&f64, &Coordinate))| {
            (*value <= coordinate.lower && gradient[index] < 0.0)
                || (*value >= coordinate.upper && gradient[index] > 0.0)
        };
        values.iter().zip(self.coordinates).enumerate().map(outwards).collect()
    }

    fn stepped(&self, values: &[f64], step: &DVector<f64>) -> Vec<f64> {
        let moved = values.iter().zip(self.coordinates).zip(step.iter());
        moved
            .map(|((value, coordinate), step)| {
                let step = if coordinate.logarithmic {
                    step.clamp(-MAX_LOG_STEP, MAX_LOG_STEP)
                } else {
                    *step
                };
                coordinate.value(coordinate.free(*value) + step)
            })
            .collect()
    }

    fn solution(&self, span: &Span, here: Point, mut columns: Vec<Vec<f64>>) -> Solution {
        for ((column, value), coordinate) in columns.iter_mut().zip(&here.values).zip(self.coordinates) {
            let slope = coordinate.slope(*value);
            column.iter_mut().for_each(|own| *own /= slope);
        }
        columns.extend(self.linear.iter().cloned());
        let unexplained: Vec<f64> = self.measured.iter().zip(&here.model).map(|(z, m)| z - m).collect();
        Solution {
            coefficients: span.coefficients(span.shares(&unexplained)),
            chi_square: dot(self.training, &here.residual, &here.residual),
            values: here.values,
            residual: here.residual,
            columns,
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
            simulator: &decay,
            stop: Stop::CHANCE,
            threads: 1,
        };
        let solution = problem.solve(&[0.5, 0.3]).unwrap();
        assert!((solution.values[0] - 2.0).abs() < 1e-4, "{:?}", solution.values);
        assert!((solution.values[1] - 3.0).abs() < 1e-3, "{:?}", solution.values);
        assert!(
            (solution.coefficients[0] - 7.0).abs() < 0.01,
            "{:?}",
            solution.coefficients
        );
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
            simulator: &decay,
            stop: Stop::CHANCE,
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
            simulator: &|_: &[f64]| Some(vec![0.0; 10]),
            stop: Stop::CHANCE,
            threads: 1,
        };
        let solution = problem.solve(&[4.0]).unwrap();
        assert!((solution.values[0] - 1.5).abs() < 1e-6);
        let covariance = solution.covariance(problem.coordinates, std::slice::from_ref(&(0..10)));
        assert!((covariance.standard_deviation(0) - 0.2).abs() < 1e-6);
    }
}
