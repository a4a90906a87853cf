//! Global search: random parameter sets over the bounds, the best of each group polished by Levenberg-Marquardt.
//!
//! Groups instead of one ranking keep the starts apart: the best few of one ranking lie in the same valley.
//! The random numbers come from a seed, so the same data and options give the same fit.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::engine::Stop;
use crate::error::IdentifyError;
use crate::observed::ObservedLoop;
use crate::order::ascending;
use crate::progress::{Progress, Stage};
use crate::residuals::{Fitter, Polished};

/// How hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Effort {
    pub candidates: usize,
    pub starts: usize,
    pub seed: u64,
}

/// Enough to rank the starts: the change of χ² by which one is done, and steps.
const RANKING: Stop = Stop {
    gain: 0.0,
    share: 1e-5,
    steps: 60,
};
/// The best few are polished to the end.
const FINAL: Stop = Stop {
    gain: 0.0,
    share: 1e-9,
    steps: 200,
};
const FINALISTS: usize = 3;
/// Draws stay this far (as a share) from the bounds.
const MARGIN: f64 = 0.02;

/// All polished starts, best first.
pub(crate) fn search<'a>(
    fitter: &'a Fitter<'a>,
    effort: Effort,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<Polished<'a>>, IdentifyError> {
    let starts = screen(fitter, effort, progress);
    let (mut done, total) = (0, starts.len() + starts.len().min(FINALISTS));
    let mut best_nrmse = f64::INFINITY;
    let mut polish = |start: &[f64], stop| {
        let polished = fitter.polished(start, stop)?;
        done += 1;
        best_nrmse = best_nrmse.min(polished.nrmse());
        progress(Progress {
            stage: Stage::Polishing,
            done,
            total,
            best_nrmse,
        });
        Some(polished)
    };
    let mut polished: Vec<Polished<'a>> = starts.iter().filter_map(|start| polish(start, RANKING)).collect();
    ascending(&mut polished, Polished::nrmse);
    for own in polished.iter_mut().take(FINALISTS) {
        if let Some(finished) = polish(&own.solution.values, FINAL) {
            *own = finished;
        }
    }
    ascending(&mut polished, Polished::nrmse);
    if polished.is_empty() {
        let loops = &fitter.observation.loops;
        let largest = |of: fn(&ObservedLoop) -> &[f64]| {
            let all = loops.iter().flat_map(of);
            all.fold(0.0_f64, |most, value| most.max(value.abs()))
        };
        return Err(IdentifyError::NoValidStart {
            candidates: effort.candidates,
            field_a_per_m: largest(|of| &of.field_a_per_m),
            magnetization_a_per_m: largest(|of| &of.magnetization_a_per_m),
        });
    }
    Ok(polished)
}

/// The material numbers of the best valid random set of each group.
fn screen(fitter: &Fitter, effort: Effort, progress: &mut dyn FnMut(Progress)) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(effort.seed);
    let mut winners: Vec<Option<(f64, Vec<f64>)>> = vec![None; effort.starts];
    let mut best_nrmse = f64::INFINITY;
    for candidate in 0..effort.candidates {
        let mut draw = || MARGIN + (1.0 - 2.0 * MARGIN) * uniform(&mut random);
        let numbers: Vec<f64> = fitter
            .coordinates
            .axes()
            .iter()
            .map(|own| own.at_share(draw()))
            .collect();
        if let Some(nrmse) = fitter.nrmse(&numbers, RANKING) {
            best_nrmse = best_nrmse.min(nrmse);
            let winner = &mut winners[candidate % effort.starts];
            if winner.as_ref().is_none_or(|(least, _)| nrmse < *least) {
                *winner = Some((nrmse, numbers));
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
    winners.into_iter().flatten().map(|(_, numbers)| numbers).collect()
}

/// Uniform in (0, 1), 53 bits.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    ((random.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
}
