//! One form, fitted: weights by least squares at every place of the inner numbers, and the best place.

use std::cell::{Cell, RefCell};

use anhyst_model::{HysteresisLaw, LawModel};
use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::even::EvenCurve;
use super::family::Skeleton;
use super::gram::Gram;
use super::options::LawOptions;
use super::parts::{Parts, SMALLEST};
use super::start::Start;
use super::{Family, LawData, LawRecord};

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
    /// As that, each record's share of its own range, or of a tenth of the whole if that is more; rms over records.
    pub held_out_own_nrmse: f64,
    /// What was found without each part.
    pub folds: Vec<LawModel>,
    /// From the law's output to what is wanted, where that is an even function of it.
    pub curve: Option<EvenCurve>,
}

/// What one place came to.
struct Visited {
    place: Vec<f64>,
    /// Weighted squares of the fit of all; of a smoothed form, of what was kept back.
    squares: f64,
    folds: Vec<VisitedFold>,
}

/// Squares of a fold.
struct VisitedFold {
    /// Of its training.
    trained: f64,
    /// Of what was kept back, as they are and as shares of the records' own ranges.
    plain: f64,
    own: f64,
}

/// The sums of one fold: as the fit weighs them, and as they are.
#[derive(Clone)]
struct FoldSums {
    weighted: Gram,
    plain: Gram,
    own: Gram,
}

struct Search<'a> {
    family: Family,
    data: &'a LawData,
    start: Start,
    parts: &'a Parts,
    /// The fold that is kept back while places are ranked; none: all data.
    fold: Cell<Option<usize>>,
    visited: RefCell<Vec<Visited>>,
}

impl Search<'_> {
    fn sums(&self, place: &[f64]) -> Vec<FoldSums> {
        let Skeleton { model, tied, .. } = self.family.skeleton(place, self.data);
        let free = tied.iter().flatten().max().map_or(0, |last| last + 1);
        let empty = FoldSums {
            weighted: Gram::new(free),
            plain: Gram::new(free),
            own: Gram::new(free),
        };
        let range = self.data.output_range();
        let mut folds = vec![empty; self.parts.folds];
        let (mut regressors, mut z) = (Vec::new(), vec![0.0; free + 2]);
        let zero = self.data.output_extent[0];
        for (record, parts) in self.data.records.iter().zip(&self.parts.of) {
            let share = 1.0 / (record.range().max(SMALLEST * range).powi(2) * record.len() as f64);
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
                folds[*fold].own.add(&z, share);
            }
        }
        folds
    }

    fn visit(&self, place: &[f64]) -> f64 {
        let sums = self.sums(place);
        let smoothness = &self.family.skeleton(place, self.data).smoothness;
        let all = weighted_sums(&sums, None);
        let squares = all.squares(&all.fitted(smoothness));
        let folds = (0..sums.len()).map(|fold| {
            let others = weighted_sums(&sums, Some(fold));
            let weights = others.fitted(smoothness);
            VisitedFold {
                trained: finite(others.squares(&weights)),
                plain: sums[fold].plain.squares(&weights),
                own: sums[fold].own.squares(&weights),
            }
        });
        let folds: Vec<VisitedFold> = folds.collect();
        let predicted = folds.iter().map(|fold| fold.own).sum();
        let squares = finite(if self.family.is_smoothed() { predicted } else { squares });
        let cost = self.fold.get().map_or(squares, |fold| folds[fold].trained);
        self.visited.borrow_mut().push(Visited {
            place: place.to_vec(),
            squares,
            folds,
        });
        cost
    }
}

fn finite(squares: f64) -> f64 {
    if squares.is_finite() { squares } else { f64::MAX }
}

/// Those of all folds but one. Added, not taken away: what only that one has moved must be nothing, not rounding.
fn weighted_sums(folds: &[FoldSums], without: Option<usize>) -> Gram {
    let kept = folds.iter().enumerate().filter(|(fold, _)| Some(*fold) != without);
    let sum = |sum: Option<Gram>, (_, fold): (usize, &FoldSums)| match sum {
        None => Some(fold.weighted.clone()),
        Some(sum) => Some(sum.plus(&fold.weighted)),
    };
    kept.fold(None, sum).unwrap_or_else(|| folds[0].weighted.clone())
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

/// Fits one form to all records; `keep_folds`: with what each part's absence gives.
pub fn fit_law(family: Family, data: &LawData, start: Start, options: &LawOptions, keep_folds: bool) -> FittedLaw {
    let thinned = thinned(data, options.samples);
    let parts = Parts::of(&thinned, options);
    let search = Search {
        family,
        data: &thinned,
        start,
        parts: &parts,
        fold: Cell::default(),
        visited: RefCell::default(),
    };
    look(&search, options);
    let visited = search.visited.into_inner();
    let best = least(&visited, |visited| visited.squares);
    // Each fold trusts only what it was trained on, for its place as for its weights.
    let found_without = |fold: usize| {
        let trained = move |visited: &Visited| visited.folds[fold].trained;
        if family.is_smoothed() {
            best
        } else {
            least(&visited, trained)
        }
    };
    let kept_back = |of: fn(&VisitedFold) -> f64| -> f64 {
        let folds = 0..parts.folds;
        folds.map(|fold| of(&found_without(fold).folds[fold])).sum()
    };
    let of_search = parts.of.iter().flatten().filter(|(fold, _)| fold.is_some()).count();
    let place = best.place.clone();
    let places: Vec<Vec<f64>> = (0..parts.folds).map(|fold| found_without(fold).place.clone()).collect();
    let held_out_nrmse = (kept_back(|fold| fold.plain) / of_search as f64).sqrt() / data.output_range();
    let held_out_own_nrmse = (kept_back(|fold| fold.own) / data.records.len() as f64).sqrt();
    let parts = Parts::of(data, options);
    let full = Search {
        family,
        data,
        start,
        parts: &parts,
        fold: Cell::default(),
        visited: RefCell::default(),
    };
    let folds = full.sums(&place);
    let weights = weighted_sums(&folds, None).fitted(&family.skeleton(&place, data).smoothness);
    let plain: f64 = folds.iter().map(|fold| fold.plain.squares(&weights)).sum();
    let samples: f64 = folds.iter().map(|fold| fold.plain.weight()).sum();
    let model = weighted(family, &place, data, &weights);
    let without = |(fold, place): (usize, &Vec<f64>)| {
        let sums = full.sums(place);
        let weights = weighted_sums(&sums, Some(fold)).fitted(&family.skeleton(place, data).smoothness);
        weighted(family, place, data, &weights)
    };
    let folds_without = if keep_folds {
        places.iter().enumerate().map(without).collect()
    } else {
        Vec::new()
    };
    let nonzero = weights.iter().skip(1).filter(|weight| **weight > 0.0).count();
    FittedLaw {
        family,
        model,
        start,
        parameters: 1 + nonzero + family.dimensions(),
        nrmse: (plain / samples).sqrt() / data.output_range(),
        held_out_nrmse,
        held_out_own_nrmse,
        folds: folds_without,
        curve: None,
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
    let draws = options.draws * dimensions * search.family.many();
    for draw in 0..draws {
        let mut place = vec![(draw as f64 + 0.5) / draws as f64];
        // The first number evenly, the others at random.
        place.extend((1..dimensions).map(|_| (random.next_u32() as f64 + 0.5) / (u32::MAX as f64 + 1.0)));
        search.visit(&place);
    }
    let steps = options.steps * dimensions as u64 / 2;
    close_in(search, steps);
    // And for each fold what it would have found without the part that is kept back.
    for fold in (0..search.parts.folds).filter(|_| !search.family.is_smoothed()) {
        search.fold.set(Some(fold));
        close_in(search, steps / 3);
    }
}

/// From the best that was visited, by the method of Nelder and Mead; what it finds is among the visited.
fn close_in(search: &Search, steps: u64) {
    let fold = search.fold.get();
    let cost = |visited: &Visited| fold.map_or(visited.squares, |fold| visited.folds[fold].trained);
    let best = least(&search.visited.borrow(), cost).place.clone();
    let mut simplex = vec![best.clone()];
    for dimension in 0..best.len() {
        let mut corner = best.clone();
        corner[dimension] += if corner[dimension] < 0.5 { 0.1 } else { -0.1 };
        simplex.push(corner);
    }
    if let Ok(solver) = NelderMead::new(simplex).with_sd_tolerance(1e-12) {
        let _ = Executor::new(search, solver)
            .configure(|state| state.max_iters(steps))
            .run();
    }
}

/// The law with its weights, without what has none.
fn weighted(family: Family, place: &[f64], data: &LawData, weights: &DVector<f64>) -> LawModel {
    let Skeleton { mut model, tied, .. } = family.skeleton(place, data);
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
