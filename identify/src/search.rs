//! Global search: random parameter sets over the bounds, the best of each group polished by Levenberg-Marquardt.
//!
//! Groups instead of one ranking keep the starts apart: the best few of one ranking lie in the same valley.
//! The random numbers come from a seed, so the same data and options give the same fit.

use levenberg_marquardt::LevenbergMarquardt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::error::IdentifyError;
use crate::parameters::Coordinates;
use crate::progress::{Progress, Stage};
use crate::residuals::{FitProblem, Observation};

/// How hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Effort {
    pub candidates: usize,
    pub starts: usize,
    pub seed: u64,
}

/// Levenberg-Marquardt gives up after this many evaluations per unknown and one.
const PATIENCE: usize = 30;
/// Relative change of cost or parameters at which a start is done: enough to rank the starts.
const RANKING_TOLERANCE: f64 = 1e-5;
/// The same for the best few, which are polished to the end.
const FINAL_TOLERANCE: f64 = 1e-9;
const FINALISTS: usize = 3;
/// Draws stay this far (as a share) from the bounds, where the logistic map is flat.
const MARGIN: f64 = 0.02;

/// All polished starts, best first.
pub(crate) fn search<'a>(
    observation: &'a Observation,
    coordinates: &'a Coordinates,
    effort: Effort,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<FitProblem<'a>>, IdentifyError> {
    let starts = screen(observation, coordinates, effort, progress);
    if starts.is_empty() {
        let largest = |series: &dyn Fn(usize) -> &'a [f64]| {
            (0..observation.loops.len())
                .flat_map(series)
                .fold(0.0_f64, |most, value| most.max(value.abs()))
        };
        return Err(IdentifyError::NoValidStart {
            candidates: effort.candidates,
            field_a_per_m: largest(&|index| &observation.loops[index].field_a_per_m),
            magnetization_a_per_m: largest(&|index| &observation.loops[index].magnetization_a_per_m),
        });
    }
    let finalists = starts.len().min(FINALISTS);
    let (mut done, total) = (0, starts.len() + finalists);
    let mut best_nrmse = f64::INFINITY;
    let mut polish = |start, tolerance| {
        let levenberg_marquardt = LevenbergMarquardt::new().with_patience(PATIENCE);
        let (problem, _) = levenberg_marquardt
            .with_ftol(tolerance)
            .with_xtol(tolerance)
            .minimize(start);
        let problem: FitProblem<'a> = problem;
        done += 1;
        best_nrmse = best_nrmse.min(problem.nrmse());
        progress(Progress {
            stage: Stage::Polishing,
            done,
            total,
            best_nrmse,
        });
        problem
    };
    let by_nrmse = |first: &FitProblem<'_>, second: &FitProblem<'_>| first.nrmse().total_cmp(&second.nrmse());
    let mut polished: Vec<FitProblem<'a>> = starts
        .into_iter()
        .map(|start| polish(start, RANKING_TOLERANCE))
        .collect();
    polished.sort_by(by_nrmse);
    let rest = polished.split_off(finalists);
    polished = polished
        .into_iter()
        .map(|start| polish(start, FINAL_TOLERANCE))
        .collect();
    polished.extend(rest);
    polished.sort_by(by_nrmse);
    Ok(polished)
}

/// The best valid random set of each group.
fn screen<'a>(
    observation: &'a Observation,
    coordinates: &'a Coordinates,
    effort: Effort,
    progress: &mut dyn FnMut(Progress),
) -> Vec<FitProblem<'a>> {
    let mut random = ChaCha8Rng::seed_from_u64(effort.seed);
    let mut winners: Vec<Option<FitProblem<'a>>> = (0..effort.starts).map(|_| None).collect();
    let mut best_nrmse = f64::INFINITY;
    for candidate in 0..effort.candidates {
        let numbers: Vec<f64> = (0..coordinates.count()).map(|_| logit(uniform(&mut random))).collect();
        if coordinates.hysteresis(&numbers).is_some() {
            let problem = FitProblem::new(observation, coordinates, &numbers);
            best_nrmse = best_nrmse.min(problem.nrmse());
            let winner = &mut winners[candidate % effort.starts];
            if winner.as_ref().is_none_or(|winner| problem.nrmse() < winner.nrmse()) {
                *winner = Some(problem);
            }
        }
        if candidate % 50 == 49 || candidate + 1 == effort.candidates {
            let (done, total) = (candidate + 1, effort.candidates);
            progress(Progress {
                stage: Stage::Screening,
                done,
                total,
                best_nrmse,
            });
        }
    }
    winners.into_iter().flatten().collect()
}

/// Uniform in (0, 1), 53 bits.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    ((random.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
}

fn logit(share: f64) -> f64 {
    let inside = MARGIN + (1.0 - 2.0 * MARGIN) * share;
    (inside / (1.0 - inside)).ln()
}
