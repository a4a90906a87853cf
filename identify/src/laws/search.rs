//! One form, fitted: weights by least squares at every place of the inner numbers, and the best place.

use std::cell::RefCell;

use anhyst_model::{HysteresisLaw, LawModel};
use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::gram::Gram;
use super::start::Start;
use super::{Family, LawData, LawRecord};

/// How hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawOptions {
    /// Parts that are kept back in turn.
    pub folds: usize,
    /// Places that are tried before the search closes in, for each inner number.
    pub draws: usize,
    /// Steps of the search.
    pub steps: u64,
    /// More samples than this are thinned for the search, turning points kept.
    pub samples: usize,
    pub seed: u64,
}

impl Default for LawOptions {
    fn default() -> Self {
        LawOptions {
            folds: 5,
            draws: 8,
            steps: 50,
            samples: 20_000,
            seed: 1,
        }
    }
}

/// Segments of a single record that are kept back alternately.
const SEGMENTS: usize = 20;
/// The sensor's filter and the stage's mode answer a jump at the start of a run: so many samples are not fitted.
const SETTLING: usize = 20;

/// A form with its numbers.
#[derive(Clone, Debug)]
pub struct FittedLaw {
    pub family: Family,
    pub model: LawModel,
    pub start: Start,
    /// Numbers that the fit chose: inner ones, and weights that are not 0, with the offset.
    pub parameters: usize,
    /// rms of what is left, as a share of the output's range.
    pub nrmse: f64,
    /// The same of data that were kept back, each part predicted by a fit of the others.
    pub held_out_nrmse: f64,
}

/// What one place came to.
struct Visited {
    place: Vec<f64>,
    /// Weighted squares of the fit of all.
    squares: f64,
    /// Of each fold: squares of its training, and of what was kept back.
    folds: Vec<(f64, f64)>,
}

/// Where each sample belongs: its fold, its weight; fold `None` is not fitted.
struct Parts {
    folds: usize,
    of: Vec<Vec<(Option<usize>, f64)>>,
}

impl Parts {
    fn of(data: &LawData, options: &LawOptions) -> Self {
        let records = data.records.len();
        let range = data.output_range();
        let folds = match records {
            1 => 2,
            2..=4 => records,
            _ => options.folds.min(records),
        };
        let of_record = |(index, record): (usize, &LawRecord)| {
            let settling = if record.time_s.is_some() {
                SETTLING.min(record.len() / 50)
            } else {
                0
            };
            // Small loops count for more than their size, if not as much as large ones.
            let weight = range / record.range().max(0.05 * range);
            (0..record.len())
                .map(|sample| {
                    let fold = if records == 1 {
                        sample * SEGMENTS / record.len() % 2
                    } else {
                        index % folds
                    };
                    ((sample >= settling).then_some(fold), weight)
                })
                .collect()
        };
        Parts {
            folds,
            of: data.records.iter().enumerate().map(of_record).collect(),
        }
    }
}

/// The sums of one fold: as the fit weighs them, and as they are.
#[derive(Clone)]
struct FoldSums {
    weighted: Gram,
    plain: Gram,
}

struct Search<'a> {
    family: Family,
    data: &'a LawData,
    start: Start,
    parts: &'a Parts,
    visited: RefCell<Vec<Visited>>,
}

impl Search<'_> {
    fn sums(&self, place: &[f64]) -> Vec<FoldSums> {
        let (model, tied) = self.family.skeleton(place, self.data);
        let free = tied.iter().flatten().max().map_or(0, |last| last + 1);
        let empty = FoldSums {
            weighted: Gram::new(free),
            plain: Gram::new(free),
        };
        let mut folds = vec![empty; self.parts.folds];
        let (mut regressors, mut z) = (Vec::new(), vec![0.0; free + 2]);
        let zero = self.data.output_extent[0];
        for (record, parts) in self.data.records.iter().zip(&self.parts.of) {
            let mut state = self.start.state(&model, record, self.data.input_extent);
            for (sample, (fold, weight)) in parts.iter().enumerate() {
                if sample > 0 {
                    model.pass(&mut state, record.passed_s(sample));
                    model.advance(&mut state, record.input[sample]);
                }
                let Some(fold) = fold else { continue };
                model.regressors(&state, &mut regressors);
                z.fill(0.0);
                z[0] = 1.0;
                for (value, of) in regressors[1..].iter().zip(&tied) {
                    if let Some(of) = of {
                        z[1 + of] += value;
                    }
                }
                z[free + 1] = record.output[sample] - zero;
                folds[*fold].weighted.add(&z, *weight);
                folds[*fold].plain.add(&z, 1.0);
            }
        }
        folds
    }

    fn visit(&self, place: &[f64]) -> f64 {
        let folds = self.sums(place);
        let all = whole(&folds);
        let squares = all.squares(&all.fitted());
        let of_fold = |fold: &FoldSums| {
            let others = all.minus(&fold.weighted);
            let weights = others.fitted();
            (others.squares(&weights), fold.plain.squares(&weights))
        };
        let squares = if squares.is_finite() { squares } else { f64::MAX };
        let folds = folds.iter().map(of_fold).collect();
        self.visited.borrow_mut().push(Visited {
            place: place.to_vec(),
            squares,
            folds,
        });
        squares
    }
}

fn whole(folds: &[FoldSums]) -> Gram {
    let (first, rest) = folds.split_at(1);
    rest.iter()
        .fold(first[0].weighted.clone(), |sum, fold| sum.plus(&fold.weighted))
}

impl CostFunction for &Search<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let inside: Vec<f64> = place.iter().map(|value| value.clamp(0.0, 1.0)).collect();
        let outside: f64 = place
            .iter()
            .zip(&inside)
            .map(|(value, inside)| (value - inside).abs())
            .sum();
        Ok(self.visit(&inside) * (1.0 + outside))
    }
}

/// Fits one form to all records.
pub fn fit_law(family: Family, data: &LawData, start: Start, options: &LawOptions) -> FittedLaw {
    let thinned = thinned(data, options.samples);
    let parts = Parts::of(&thinned, options);
    let search = Search {
        family,
        data: &thinned,
        start,
        parts: &parts,
        visited: RefCell::default(),
    };
    look(&search, options);
    let visited = search.visited.into_inner();
    let best = least(&visited, |visited| visited.squares);
    // Each fold trusts only what it was trained on, for its place as for its weights.
    let kept_back: f64 = (0..parts.folds)
        .map(|fold| least(&visited, |visited| visited.folds[fold].0).folds[fold].1)
        .sum();
    let of_search = parts.of.iter().flatten().filter(|(fold, _)| fold.is_some()).count();
    let place = best.place.clone();
    let parts = Parts::of(data, options);
    let full = Search {
        family,
        data,
        start,
        parts: &parts,
        visited: RefCell::default(),
    };
    let folds = full.sums(&place);
    let weights = whole(&folds).fitted();
    let plain: f64 = folds.iter().map(|fold| fold.plain.squares(&weights)).sum();
    let samples: f64 = folds.iter().map(|fold| fold.plain.weight()).sum();
    let model = weighted(family, &place, data, &weights);
    let nonzero = weights.iter().skip(1).filter(|weight| **weight > 0.0).count();
    FittedLaw {
        family,
        model,
        start,
        parameters: 1 + nonzero + family.dimensions(),
        nrmse: (plain / samples).sqrt() / data.output_range(),
        held_out_nrmse: (kept_back / of_search as f64).sqrt() / data.output_range(),
    }
}

fn least(visited: &[Visited], by: impl Fn(&Visited) -> f64) -> &Visited {
    let mut best = &visited[0];
    for one in visited {
        if by(one) < by(best) {
            best = one;
        }
    }
    best
}

/// Draws over the cube, then closes in on the best.
fn look(search: &Search, options: &LawOptions) {
    let dimensions = search.family.dimensions();
    if dimensions == 0 {
        search.visit(&[]);
        return;
    }
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let draws = options.draws * dimensions;
    for draw in 0..draws {
        let mut place = vec![(draw as f64 + 0.5) / draws as f64];
        // The first number evenly, the others at random.
        place.extend((1..dimensions).map(|_| (random.next_u32() as f64 + 0.5) / (u32::MAX as f64 + 1.0)));
        search.visit(&place);
    }
    let best = least(&search.visited.borrow(), |visited| visited.squares).place.clone();
    let mut simplex = vec![best.clone()];
    for dimension in 0..dimensions {
        let mut corner = best.clone();
        corner[dimension] += if corner[dimension] < 0.5 { 0.1 } else { -0.1 };
        simplex.push(corner);
    }
    let solver = NelderMead::new(simplex).with_sd_tolerance(1e-12);
    if let Ok(solver) = solver {
        let steps = options.steps * dimensions as u64 / 2;
        // What it found is among the visited.
        let _ = Executor::new(search, solver)
            .configure(|state| state.max_iters(steps))
            .run();
    }
}

/// The law with its weights, without what has none.
fn weighted(family: Family, place: &[f64], data: &LawData, weights: &DVector<f64>) -> LawModel {
    let (mut model, tied) = family.skeleton(place, data);
    let of = |tied: &Option<usize>| tied.map_or(0.0, |of| weights[1 + of]);
    let mut all = vec![weights[0] + data.output_extent[0]];
    all.extend(tied.iter().map(of));
    model.set_weights(&all);
    model.drop_zeros();
    model
}

/// Of every so many samples the one of the lowest input and that of the highest, so that no turning point is cut.
fn thinned(data: &LawData, limit: usize) -> LawData {
    let every = 2 * data.samples().div_ceil(limit.max(1));
    if every <= 2 {
        return data.clone();
    }
    let record = |record: &LawRecord| {
        let input = &record.input;
        let extremes = |begin: usize| {
            let of = begin..(begin + every).min(record.len());
            let lowest = of
                .clone()
                .min_by(|a, b| input[*a].total_cmp(&input[*b]))
                .unwrap_or(begin);
            let highest = of.max_by(|a, b| input[*a].total_cmp(&input[*b])).unwrap_or(begin);
            [lowest.min(highest), lowest.max(highest)]
        };
        let mut kept: Vec<usize> = (0..record.len()).step_by(every).flat_map(extremes).collect();
        kept.dedup();
        let of = |series: &[f64]| kept.iter().map(|sample| series[*sample]).collect::<Vec<_>>();
        LawRecord {
            id: record.id.clone(),
            input: of(input),
            output: of(&record.output),
            time_s: record.time_s.as_deref().map(of),
        }
    };
    LawData {
        records: data.records.iter().map(record).collect(),
        ..data.clone()
    }
}
