//! A few simulations for each term: which way it would move the outputs, how far it would have to go, what that gains.
//!
//! D = z-outputs with the term at a trial value minus those without, r residual: the best multiple λ of the trial solves the
//! small least-squares problem DᵀD λ = Dᵀr and gains (Dᵀr)ᵀ(DᵀD)⁻¹(Dᵀr) of χ², if the answer is linear. It is then tried at
//! λ times the trial, and again from there, until λ stays near 1: a secant search that also finds limits and lags far away.

use nalgebra::{DMatrix, DVector};

use anhyst_identify::engine::{Coordinate, dot};

use crate::probes::{ProbeGroup, Surroundings};
use crate::system::Setting;
use crate::term::Term;
use crate::workbench::Workbench;
use anhyst_identify::parallel;

/// Rounds of the secant search.
const ROUNDS: usize = 4;
/// Golden sections between two levels of a limit.
const SECTIONS: usize = 4;
/// λ within this factor of 1 ends the search: the fit takes over.
const NEAR: f64 = 1.6;

/// What screening found for a term.
pub(crate) struct Screened {
    pub term: Term,
    /// Where a fit begins, best first.
    pub starts: Vec<Start>,
    /// Outputs' answers to small trials, whitened, one group each.
    pub directions: Vec<Vec<Vec<f32>>>,
}

/// A place to begin a fit.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    pub values: Vec<f64>,
    /// Fall of χ² seen there.
    pub gain: f64,
}

impl Screened {
    pub fn best_gain(&self) -> f64 {
        self.starts.first().map_or(0.0, |start| start.gain)
    }
}

/// Base point from which terms are tried.
pub(crate) struct Base<'a> {
    pub settings: &'a [Setting],
    pub outputs: &'a [f64],
    /// z − outputs − linear part.
    pub residual: &'a [f64],
}

/// Screens terms beside the base's own, side by side on the bench's threads.
pub(crate) fn screen(bench: &Workbench, base: &Base, surroundings: &Surroundings, terms: &[Term]) -> Vec<Screened> {
    let screened = parallel::map(bench.threads, terms, |term| {
        let own = OneTerm {
            bench,
            base,
            term: *term,
            coordinates: term.specs(bench.model)?.iter().map(Coordinate::of).collect(),
        };
        Some(own.screen(&surroundings.probes(*term)))
    });
    screened.into_iter().flatten().collect()
}

struct OneTerm<'a> {
    bench: &'a Workbench<'a>,
    base: &'a Base<'a>,
    term: Term,
    coordinates: Vec<Coordinate>,
}

impl OneTerm<'_> {
    fn screen(&self, groups: &[ProbeGroup]) -> Screened {
        if let Some(levels) = self.levels(groups) {
            return self.screen_limit(groups, &levels);
        }
        let (mut starts, mut directions) = (Vec::new(), Vec::new());
        for group in groups {
            let Some(answers) = self.answers(group) else { continue };
            let moves: Vec<f64> = self.multiples(&answers);
            let values = self.at(group, &moves);
            // A group of frequencies or levels is only searched further where it is the best of its kind.
            starts.push((self.linear_gain(&answers), group.clone(), values));
            directions.push(
                answers
                    .into_iter()
                    .map(|answer| answer.into_iter().map(|z| z as f32).collect())
                    .collect(),
            );
        }
        starts.sort_by(|one, other| other.0.total_cmp(&one.0));
        let mut found: Vec<Start> = starts
            .into_iter()
            .take(2)
            .filter_map(|(_, group, values)| self.search(&group, values))
            .collect();
        found.sort_by(|one, other| other.gain.total_cmp(&one.gain));
        Screened {
            term: self.term,
            starts: found,
            directions,
        }
    }

    /// Levels of a limit, rising, or steps of lattices; None for anything else.
    fn levels(&self, groups: &[ProbeGroup]) -> Option<Vec<f64>> {
        let level = |group: &ProbeGroup| match group.sizes.as_slice() {
            [(place, level)] if self.coordinates[*place].logarithmic || self.term.is_lattice() => Some(*level),
            _ => None,
        };
        groups.iter().map(level).collect()
    }

    /// A limit is not proportional to anything: the best level tried, then golden sections between its neighbours.
    fn screen_limit(&self, groups: &[ProbeGroup], levels: &[f64]) -> Screened {
        let mut tried: Vec<Start> = Vec::new();
        let mut directions = Vec::new();
        let mut try_level = |level: f64, keep: bool| {
            let Some(answer) = self.difference(&[level]) else {
                return f64::NEG_INFINITY;
            };
            let gain = self.gain(&answer);
            tried.push(Start {
                values: vec![level],
                gain,
            });
            if keep {
                directions.push(vec![answer.into_iter().map(|z| z as f32).collect()]);
            }
            gain
        };
        let gains: Vec<f64> = levels.iter().map(|level| try_level(*level, true)).collect();
        let best = (0..levels.len()).max_by(|one, other| gains[*one].total_cmp(&gains[*other]));
        if let Some(best) = best.filter(|_| !groups.is_empty() && !self.term.is_lattice()) {
            // Levels fall from group to group; above the first of them the limit hardly bites.
            let mut high = if best == 0 { 1.3 * levels[0] } else { levels[best - 1] };
            let mut low = levels.get(best + 1).copied().unwrap_or(0.5 * levels[best]);
            for _ in 0..SECTIONS {
                let (one, other) = (low * (high / low).powf(0.382), low * (high / low).powf(0.618));
                if try_level(one, false) > try_level(other, false) {
                    high = other
                } else {
                    low = one
                }
            }
        }
        tried.sort_by(|one, other| other.gain.total_cmp(&one.gain));
        tried.truncate(1);
        Screened {
            term: self.term,
            starts: tried,
            directions,
        }
    }

    /// Fall of χ² where the outputs answer so.
    fn gain(&self, answer: &[f64]) -> f64 {
        let training = &self.bench.observation.training;
        2.0 * dot(training, answer, self.base.residual) - dot(training, answer, answer)
    }

    /// Answers of the outputs to each size's trial; None if the model refuses or nothing moves.
    fn answers(&self, group: &ProbeGroup) -> Option<Vec<Vec<f64>>> {
        group
            .sizes
            .iter()
            .map(|(place, value)| {
                let mut values = group.absent.clone();
                values[*place] = *value;
                self.difference(&values)
            })
            .collect()
    }

    fn difference(&self, values: &[f64]) -> Option<Vec<f64>> {
        let mut settings = self.base.settings.to_vec();
        settings.push(Setting {
            term: self.term,
            values: values.to_vec(),
        });
        let mut outputs = self.bench.simulate(&settings)?;
        for (own, base) in outputs.iter_mut().zip(self.base.outputs) {
            *own -= base;
        }
        Some(outputs)
    }

    fn multiples(&self, answers: &[Vec<f64>]) -> Vec<f64> {
        least_squares(self, answers).map_or_else(|| vec![0.0; answers.len()], |(multiples, _)| multiples)
    }

    fn linear_gain(&self, answers: &[Vec<f64>]) -> f64 {
        least_squares(self, answers).map_or(0.0, |(_, gain)| gain)
    }

    /// Sizes at multiples of their trials, within bounds.
    fn at(&self, group: &ProbeGroup, multiples: &[f64]) -> Vec<f64> {
        let mut values = group.absent.clone();
        for ((place, trial), multiple) in group.sizes.iter().zip(multiples) {
            let coordinate = &self.coordinates[*place];
            if coordinate.logarithmic {
                // A limit is not proportional to anything: its trial is the start.
                values[*place] = *trial;
            } else {
                let absent = group.absent[*place];
                values[*place] = (absent + multiple * (trial - absent)).clamp(coordinate.lower, coordinate.upper);
            }
        }
        values
    }

    /// Secant rounds along the line from absent to the values.
    fn search(&self, group: &ProbeGroup, mut values: Vec<f64>) -> Option<Start> {
        let training = &self.bench.observation.training;
        let residual = self.base.residual;
        let mut best: Option<Start> = None;
        for _ in 0..ROUNDS {
            if values == group.absent {
                break;
            }
            let Some(answer) = self.difference(&values) else {
                // Too far: the model refuses it.
                values = self.along(group, &values, 0.3);
                continue;
            };
            let (size, along) = (dot(training, &answer, &answer), dot(training, &answer, residual));
            let gain = 2.0 * along - size;
            if best.as_ref().is_none_or(|best| gain > best.gain) {
                best = Some(Start {
                    values: values.clone(),
                    gain,
                });
            }
            if size <= 0.0 {
                break;
            }
            let multiple = (along / size).clamp(0.05, 20.0);
            if (1.0 / NEAR..NEAR).contains(&multiple) {
                break;
            }
            values = self.along(group, &values, multiple);
        }
        best
    }

    fn along(&self, group: &ProbeGroup, values: &[f64], multiple: f64) -> Vec<f64> {
        let mut moved = values.to_vec();
        for (place, _) in &group.sizes {
            let coordinate = &self.coordinates[*place];
            let absent = group.absent[*place];
            if !coordinate.logarithmic {
                moved[*place] =
                    (absent + multiple * (values[*place] - absent)).clamp(coordinate.lower, coordinate.upper);
            }
        }
        moved
    }
}

/// Multiples of the answers that fit the residual best, and the fall of χ².
fn least_squares(own: &OneTerm, answers: &[Vec<f64>]) -> Option<(Vec<f64>, f64)> {
    let training = &own.bench.observation.training;
    solve(
        |row, column| dot(training, &answers[row], &answers[column]),
        |row| dot(training, &answers[row], own.base.residual),
        answers.len(),
    )
}

/// (DᵀD)⁻¹Dᵀr and its gain; columns that vanish or repeat others count as nothing.
pub(crate) fn solve(
    product: impl Fn(usize, usize) -> f64,
    along: impl Fn(usize) -> f64,
    size: usize,
) -> Option<(Vec<f64>, f64)> {
    let scales: Vec<f64> = (0..size).map(|index| product(index, index).max(0.0).sqrt()).collect();
    if scales.iter().all(|scale| *scale <= 0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(size, size, |row, column| {
        let scale = scales[row] * scales[column];
        if scale > 0.0 { product(row, column) / scale } else { 0.0 }
    });
    let right = DVector::from_fn(size, |row, _| {
        if scales[row] > 0.0 {
            along(row) / scales[row]
        } else {
            0.0
        }
    });
    let inverse = scaled.pseudo_inverse(1e-9).ok()?;
    let multiples = &inverse * &right;
    let gain = multiples.dot(&right);
    let unscaled = multiples
        .iter()
        .zip(&scales)
        .map(|(m, s)| if *s > 0.0 { m / s } else { 0.0 });
    Some((unscaled.collect(), gain))
}
