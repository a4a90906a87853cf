//! A law with wrong weights, adapted on line along a measured file, and judged by the free runs of what it came to.

use anhyst_estimator::{WeightBelief, WeightEstimator};
use anhyst_identify::laws::{LawData, LawFile, Start, predict};
use anhyst_model::{Law, LawModel, ModelError};
use serde::Serialize;

/// How wrong the weights begin: 60 % at most.
const WRONG: f64 = 0.6;
/// Draws of wrong weights; the worst is told.
const DRAWS: u64 = 5;
/// After so long the first judgement.
const EARLY_S: f64 = 10.0;
/// The sensor's answer to the jump at the start is not learned from.
const SETTLING: usize = 20;
/// As many as a fit begins with.
const PLAYS: usize = 12;

/// Free runs, rms after the mean, output's unit; each the worst of the draws.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct OnLineScore {
    /// Along the file, with the wrong weights.
    pub wrong: f64,
    /// With those after 10 s.
    pub after_10_s: f64,
    /// With those at the file's end.
    pub at_end: f64,
    /// The last along the other file.
    pub other_at_end: f64,
}

/// Adapts along `data`, judges along it and along `other`.
pub(super) fn on_line(law: &LawFile, data: &LawData, other: &LawData) -> Result<OnLineScore, ModelError> {
    let mut worst = OnLineScore::default();
    let seen = data.reacted(law.reaction, law.start == Start::Rest);
    let half = 0.5 * (law.input_extent[1] - law.input_extent[0]);
    for draw in 0..DRAWS {
        let wrong = wrong(&filled(&law.model, half), draw);
        let mut estimator = WeightEstimator::new(wrong.clone(), &WeightBelief::default(), half)?;
        let mut early = wrong.clone();
        for record in &seen.records {
            let mut time_s = 0.0;
            for sample in 0..record.len() {
                let passed_s = record.passed_s(sample);
                let known = sample >= SETTLING;
                let measured = if known { record.output[sample] } else { f64::NAN };
                estimator.step(passed_s, record.input[sample], measured);
                if time_s <= EARLY_S && time_s + passed_s > EARLY_S {
                    early = estimator.law();
                }
                time_s += passed_s;
            }
        }
        let score = |model: &LawModel, along: &LawData| {
            let file = LawFile {
                model: model.clone(),
                ..law.clone()
            };
            predict(&file, along).error.rms_after_mean
        };
        let last = estimator.law();
        worst = OnLineScore {
            wrong: worst.wrong.max(score(&wrong, data)),
            after_10_s: worst.after_10_s.max(score(&early, data)),
            at_end: worst.at_end.max(score(&last, data)),
            other_at_end: worst.other_at_end.max(score(&last, other)),
        };
    }
    Ok(worst)
}

/// With the plays that the fit left out, for another motion may need them: at even distances up to half of the input's extent, of no weight.
fn filled(model: &LawModel, half: f64) -> LawModel {
    let mut model = model.clone();
    for law in &mut model.laws {
        let Law::Plays(plays) = law else { continue };
        for group in &mut plays.groups {
            for play in 0..PLAYS {
                let radius = half * play as f64 / PLAYS as f64;
                if group.radii.iter().all(|own| (own - radius).abs() > 1e-3 * half) {
                    group.radii.push(radius);
                    group.weights.push(0.0);
                }
            }
        }
    }
    model
}

/// The weights of all plays off by up to [`WRONG`], by a draw.
fn wrong(model: &LawModel, draw: u64) -> LawModel {
    let mut model = model.clone();
    let mut random = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(draw + 1);
    for law in &mut model.laws {
        let Law::Plays(plays) = law else { continue };
        for weight in plays.groups.iter_mut().flat_map(|group| &mut group.weights) {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let share = (random >> 11) as f64 / (1_u64 << 53) as f64;
            *weight *= 1.0 + WRONG * (2.0 * share - 1.0);
        }
    }
    model
}
