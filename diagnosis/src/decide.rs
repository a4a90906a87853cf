//! From the search to a verdict, its values and its evidence.

use anhyst_model::ActuatorModel;

use anhyst_identify::engine::Span;

use crate::diagnosis::{Candidate, Diagnosis, FittedValue, FoundEffect, Verdict};
use crate::experiment::{Comparison, Experiment, advise};
use crate::freeform::{UnknownTerm, free_form};
use crate::locate::{channel_gaps, locate, sentences};
use crate::plant::Plant;
use crate::remainder::Remainder;
use crate::search::{Found, Level};
use crate::select::Tested;
use crate::sight::sight;
use crate::system::{ChannelKind, Setting};
use crate::term::Term;
use crate::ties::{MOST_NAMED, ties};
use crate::wording::{Amount, amplifier_sentences, effect_names, sentence, unknown_sentence};
use crate::workbench::{Fitted, Workbench};

/// Sentences on where the gap is.
const MOST_SENTENCES: usize = 6;
/// A calibrated parameter counts as moved beyond this many standard deviations.
const MOVED: f64 = 4.0;
/// An output whose model moves by less than this many noises (rms) shows nothing.
const MOVES: f64 = 1.0;

/// A diagnosis with what is needed to write it down.
pub(crate) struct Decided {
    pub diagnosis: Diagnosis,
    /// Of the amended model; empty where nothing was found.
    pub settings: Vec<Setting>,
    /// Of the runner-up; empty where there is none.
    pub runner_up: Vec<Setting>,
}

pub(crate) fn decide(bench: &Workbench, plant: &Plant, found: &Found, unit: &str) -> Decided {
    let (detectable, not_excited) = sight(bench, found);
    let residual = &found.nominal.fit.solution.residual;
    let gap_over = locate(bench.observation, residual, &found.nominal.signals);
    let channels = channel_gaps(bench.observation, residual, unit);
    let noise_rms = bench
        .observation
        .of_kind(ChannelKind::Output)
        .next()
        .map_or(0.0, |channel| channel.noise_rms);
    let mut place = amplifier_sentences(&channels);
    place.extend(sentences(&gap_over, &channels, MOST_SENTENCES));
    let mut decided = Decided {
        diagnosis: Diagnosis {
            verdict: Verdict::Unknown,
            sentence: String::new(),
            effects: Vec::new(),
            ambiguous_with: Vec::new(),
            unknown_term: None,
            gap_before: found.nominal.fit.held_out_rms,
            gap_after: found.nominal.fit.held_out_rms,
            noise_rms,
            unit: unit.to_owned(),
            place,
            confidence: 0.0,
            experiment: None,
            delta_bic: None,
            runner_up: None,
            calibrated: Vec::new(),
            test_before: found.nominal.test.clone(),
            test_after: found.nominal.test.clone(),
            channels,
            gap_over,
            candidates: candidates(found),
            detectable,
            not_excited,
            model: bench.model.name.clone(),
            data: Vec::new(),
        },
        settings: Vec::new(),
        runner_up: Vec::new(),
    };
    match &found.winner {
        Some((_, winner)) if winner.fit.settings.is_empty() => decided.nothing(found),
        Some((level, winner)) => decided.name(bench, plant, found, *level, winner),
        None => decided.unknown(bench, found),
    }
    decided
}

impl Decided {
    fn nothing(&mut self, found: &Found) {
        let own = &mut self.diagnosis;
        let moved = found.nominal.signals.iter().any(|run| {
            let mean = run.output.iter().sum::<f64>() / run.output.len().max(1) as f64;
            crate::statistics::rms(run.output.iter().map(|y| y - mean)) > MOVES * own.noise_rms
        });
        own.confidence = 1.0 - crate::score::FAMILY;
        if moved {
            own.verdict = Verdict::None;
            own.sentence = format!(
                "Nothing is missing: the model leaves {} of {} noise, and no direction of {} stands out of it.",
                Amount(own.gap_before, &own.unit),
                Amount(own.noise_rms, &own.unit),
                own.test_before.groups.len()
            );
        } else {
            own.verdict = Verdict::NotExcited;
            own.sentence =
                "The output hardly moves out of its noise, so these data could not have shown any effect.".to_owned();
        }
    }

    fn name(&mut self, bench: &Workbench, plant: &Plant, found: &Found, level: Level, winner: &Tested) {
        let rivals = found.rivals(level, winner);
        let tied = ties(bench, winner, rivals);
        let final_fit = refitted(bench, &winner.fit, level);
        let own = &mut self.diagnosis;
        own.gap_after = winner.fit.held_out_rms;
        own.test_after = winner.test.clone();
        let all = effects_of(bench.model, &final_fit);
        (own.effects, own.calibrated) = match level {
            Level::Nominal => (all, Vec::new()),
            Level::Calibrated => all
                .into_iter()
                .partition(|effect| !effect.name.starts_with("parameter_")),
        };
        if own.effects.is_empty() {
            // Calibration alone: the parameters that moved are the answer.
            own.effects = own
                .calibrated
                .iter()
                .filter(|effect| has_moved(effect))
                .cloned()
                .collect();
        }
        own.verdict = verdict_of(&own.effects);
        if !tied.is_empty() {
            own.verdict = Verdict::Ambiguous;
            own.ambiguous_with = tied.iter().take(MOST_NAMED - 1).map(|rival| rival.name()).collect();
            own.experiment = experiment(bench, plant, &final_fit, &tied);
        }
        let others = rivals.iter().filter(|rival| {
            rival.terms() != winner.fit.terms() && !tied.iter().any(|tied| tied.terms() == rival.terms())
        });
        let runner_up = others.min_by(|one, other| one.bic.total_cmp(&other.bic));
        own.delta_bic = runner_up.map(|rival| rival.bic - winner.fit.bic);
        own.runner_up = runner_up.map(|rival| candidate(rival, winner.fit.bic));
        self.runner_up = runner_up.map_or_else(Vec::new, |rival| rival.settings.clone());
        own.confidence = share_of_evidence(&winner.fit, rivals);
        own.sentence = sentence(own);
        self.settings = final_fit.settings;
    }

    /// A model that was itself fitted: the effect that closes most of the gap, beside the model's own error.
    pub fn name_beside_error(&mut self, bench: &Workbench, found: &Found, remainder: Remainder) {
        let Some(best) = remainder.explanations.first() else {
            return;
        };
        let own = &mut self.diagnosis;
        (own.effects, own.calibrated) = effects_of(bench.model, best)
            .into_iter()
            .partition(|effect| !effect.name.starts_with("parameter_"));
        own.verdict = remainder.verdict;
        own.ambiguous_with = remainder
            .explanations
            .iter()
            .skip(1)
            .take(MOST_NAMED - 1)
            .map(effect_names)
            .collect();
        own.gap_after = best.held_out_rms;
        own.confidence = 1.0 - remainder.share_left;
        let base = found.calibrated.iter().find(|fit| effect_names(fit).is_empty());
        let calibrated = base.map_or(own.gap_before, |fit| fit.held_out_rms);
        own.sentence = format!(
            "The model was itself fitted, and calibrated again it leaves {} of {}. Beside its own error, {} explains {:.0} % of \
             what is left to explain; {} remains at a noise of {}.",
            Amount(calibrated, &own.unit),
            Amount(own.gap_before, &own.unit),
            effect_names(best),
            100.0 * (1.0 - remainder.share_left),
            Amount(best.held_out_rms, &own.unit),
            Amount(own.noise_rms, &own.unit)
        );
        own.unknown_term = error_of(bench, &best.settings);
        self.settings = best.settings.clone();
    }

    fn unknown(&mut self, bench: &Workbench, found: &Found) {
        let term = free_form(
            bench.observation,
            &found.nominal.fit.solution.residual,
            &found.nominal.signals,
        );
        let own = &mut self.diagnosis;
        let nearest = found
            .singles
            .iter()
            .chain(&found.pairs)
            .chain(&found.calibrated)
            .min_by(|one, other| one.held_out_chi_square.total_cmp(&other.held_out_chi_square));
        own.verdict = Verdict::Unknown;
        own.confidence = 1.0 - crate::score::FAMILY;
        own.gap_after = term.as_ref().map_or(own.gap_before, |term| term.held_out_rms_after);
        own.runner_up = nearest.map(|nearest| candidate(nearest, answers_bic(found)));
        own.sentence = unknown_sentence(own, nearest, term.as_ref());
        own.unknown_term = term;
    }
}

/// The winner's terms on all rows: the values that are reported.
fn refitted(bench: &Workbench, fit: &Fitted, level: Level) -> Fitted {
    let channels = bench.observation.channels.iter();
    let all: Vec<std::ops::Range<usize>> = channels.map(|channel| channel.rows.clone()).collect();
    let with_priors = level == Level::Calibrated;
    let fitted = bench.fit_on(&fit.settings, with_priors, bench.threads, &all);
    let mut fitted = fitted.unwrap_or_else(|| fit.clone());
    fitted.deviations = bench.deviations(&fitted, with_priors, &all);
    fitted
}

fn effects_of(model: &ActuatorModel, fit: &Fitted) -> Vec<FoundEffect> {
    fit.settings
        .iter()
        .enumerate()
        .map(|(index, setting)| {
            let specs = setting.term.specs(model).unwrap_or_default();
            let values = setting.values.iter().zip(fit.deviations_of(index)).zip(specs);
            FoundEffect {
                name: setting.term.name().to_owned(),
                values: values
                    .map(|((value, deviation), spec)| FittedValue {
                        name: spec.name.to_owned(),
                        unit: spec.unit.to_owned(),
                        value: *value,
                        standard_deviation: deviation.is_finite().then_some(*deviation),
                        nominal: match setting.term {
                            Term::Parameter(parameter) => parameter.of(model),
                            Term::Effect(_) => None,
                        },
                    })
                    .collect(),
            }
        })
        .collect()
}

fn has_moved(effect: &FoundEffect) -> bool {
    effect.values.iter().any(|value| {
        let moved = value.nominal.map_or(0.0, |nominal| (value.value - nominal).abs());
        value
            .standard_deviation
            .is_some_and(|deviation| moved > MOVED * deviation)
    })
}

fn verdict_of(effects: &[FoundEffect]) -> Verdict {
    let all = |of: fn(&str) -> bool| !effects.is_empty() && effects.iter().all(|effect| of(&effect.name));
    if all(|name| name.starts_with("parameter_")) {
        Verdict::Parameter
    } else if all(|name| name.starts_with("sensor_") || name == "quantisation") {
        Verdict::Sensor
    } else {
        Verdict::Named
    }
}

fn experiment(bench: &Workbench, plant: &Plant, winner: &Fitted, tied: &[&Fitted]) -> Option<Experiment> {
    let mut explanations = vec![winner.settings.clone()];
    explanations.extend(tied.iter().take(MOST_NAMED - 1).map(|rival| rival.settings.clone()));
    let mut names = vec![winner.name()];
    names.extend(tied.iter().take(MOST_NAMED - 1).map(|rival| rival.name()));
    let drives = plant.runs.iter().flat_map(|run| run.drive_a_per_m.iter());
    let noise = |kind| bench.observation.of_kind(kind).next().map(|channel| channel.noise_rms);
    advise(&Comparison {
        model: bench.model,
        explanations: &explanations,
        names: &names,
        amplitude_a_per_m: drives.fold(0.0_f64, |most, value| most.max(value.abs())),
        tick_s: plant.runs.first().and_then(|run| run.tick_s),
        output_noise: noise(ChannelKind::Output)?,
        field_noise: noise(ChannelKind::Field),
        threads: bench.threads,
    })
}

fn candidate(fit: &Fitted, best: f64) -> Candidate {
    Candidate {
        name: fit.name(),
        terms: fit.settings.len(),
        delta_bic: fit.bic - best,
        gap_after: fit.held_out_rms,
    }
}

/// The nominal model and the best of each kind, lowest BIC first.
fn candidates(found: &Found) -> Vec<Candidate> {
    let mut fits: Vec<&Fitted> = vec![&found.nominal.fit];
    for kind in [&found.singles, &found.pairs, &found.calibrated] {
        fits.extend(kind.iter().take(12));
    }
    fits.sort_by(|one, other| one.bic.total_cmp(&other.bic));
    let answer = answers_bic(found);
    fits.into_iter().map(|fit| candidate(fit, answer)).collect()
}

/// What every rival's BIC is counted from, in the table as for the runner-up: the winner's, or the lowest where none won.
fn answers_bic(found: &Found) -> f64 {
    let winner = found.winner.as_ref().map(|(_, winner)| winner.fit.bic);
    let kinds = [&found.singles, &found.pairs, &found.calibrated];
    let all = kinds.into_iter().flatten().map(|fit| fit.bic);
    winner.unwrap_or_else(|| all.fold(found.nominal.fit.bic, f64::min))
}

/// e^(−ΔBIC/2) of the winner over the sum of all.
fn share_of_evidence(winner: &Fitted, rivals: &[Fitted]) -> f64 {
    let others: f64 = rivals
        .iter()
        .filter(|rival| rival.terms() != winner.terms())
        .map(|rival| (-0.5 * (rival.bic - winner.bic)).min(300.0).exp())
        .sum();
    1.0 / (1.0 + others)
}

/// A fitted model's own error, as curves over its signals.
fn error_of(bench: &Workbench, settings: &[Setting]) -> Option<UnknownTerm> {
    let own = Workbench {
        model: bench.model,
        linear: bench.linear.clone(),
        ..*bench
    };
    let outputs = own.simulate(settings)?;
    let difference = bench
        .observation
        .whitened
        .iter()
        .zip(&outputs)
        .map(|(z, own)| z - own)
        .collect();
    let zeros = Span::of(&bench.linear, &bench.observation.training);
    let residual = zeros.without(difference);
    free_form(bench.observation, &residual, &bench.system.signals(settings)?)
}
