//! What is missing beside a model's own error: for models whose numbers were fitted to measurements.
//!
//! Such a model never reaches the noise, so an effect is judged by what it closes. In runs over time the reproducible part of the
//! error, a free curve over the field on rising and on falling branches, is let free beside the calibrated model, and an effect is
//! named that leaves at most `CLOSES` of the held-out energy that the curve does not explain: creep and drifts show there, however
//! wrong the loop's shape is. Else, and in sweeps without time, an effect beside calibrated parameters is judged in the same way;
//! not a line in the spectrum, for harmonics of the drive are the loop's shape.
//! Energies are held-out squares less the noise. Rivals within `SIMILAR` of the winner's are ties.

use crate::diagnosis::Verdict;
use crate::observation::Observation;
use crate::plant::{Plant, amended};
use crate::search::Found;
use crate::select::{screen_beside, sort, starts_beside, terms, tested};
use crate::statistics::rms;
use crate::system::{ChannelKind, Setting, Signals};
use crate::term::Term;
use crate::workbench::{Fitted, Workbench};

const CLOSES: f64 = 0.5;
const SIMILAR: f64 = 1.15;
const KNOTS: usize = 24;

/// An effect beside the model's error.
pub(crate) struct Remainder {
    /// Nominal parameters and the effect, best first; ties follow.
    pub explanations: Vec<Fitted>,
    /// Held-out energy that the winner leaves, over that without it.
    pub share_left: f64,
    pub verdict: Verdict,
}

/// Held-out energy of the outputs above the noise.
fn energy(bench: &Workbench, fit: &Fitted) -> f64 {
    let noises = bench
        .observation
        .of_kind(ChannelKind::Output)
        .map(|channel| channel.noise_rms);
    let noise = rms(noises);
    let mean = noise * noise;
    (fit.held_out_rms * fit.held_out_rms - mean).max(1e-3 * mean)
}

fn effects(fit: &Fitted) -> usize {
    fit.settings
        .iter()
        .filter(|own| matches!(own.term, Term::Effect(_)))
        .count()
}

pub(crate) fn remainder(bench: &Workbench, plant: &Plant, found: &Found) -> Option<Remainder> {
    let base = found.calibrated.iter().find(|fit| effects(fit) == 0)?;
    let with_effect = found
        .calibrated
        .iter()
        .filter(|fit| effects(fit) == 1 && !fit.terms().into_iter().any(Term::is_line))
        .cloned()
        .collect();
    let beside_parameters = || {
        let mut found = judged(bench, base, with_effect)?;
        for fit in &mut found.explanations {
            fit.deviations = bench.deviations(fit, true, &bench.observation.training);
        }
        Some(found)
    };
    // A loop of the wrong shape is the model's error in every cycle, and a curve over the field takes it off; without time
    // there is one loop, and the curve would take all.
    if plant.runs.iter().all(|run| run.tick_s.is_some()) {
        return beside_curves(bench, plant, base).or_else(beside_parameters);
    }
    beside_parameters()
}

/// The best of some fits if it closes enough of what a base leaves.
fn judged(bench: &Workbench, base: &Fitted, mut fits: Vec<Fitted>) -> Option<Remainder> {
    let before = energy(bench, base);
    fits.sort_by(|one, other| energy(bench, one).total_cmp(&energy(bench, other)));
    let least = energy(bench, fits.first()?);
    fits.retain(|fit| energy(bench, fit) <= SIMILAR * least);
    let verdict = if fits.len() > 1 {
        Verdict::Ambiguous
    } else {
        Verdict::Named
    };
    (least <= CLOSES * before).then_some(Remainder {
        explanations: fits,
        share_left: least / before,
        verdict,
    })
}

/// Single effects beside the calibrated model and free curves over its field.
fn beside_curves(bench: &Workbench, plant: &Plant, base: &Fitted) -> Option<Remainder> {
    let calibrated = Plant {
        model: amended(&plant.model, &base.settings).ok()?,
        runs: plant.runs.clone(),
        channels: plant.channels.clone(),
    };
    let signals = bench.system.signals(&base.settings)?;
    let mut linear = bench.linear.clone();
    linear.extend(curves(bench.observation, &signals));
    let own = Workbench {
        system: &calibrated,
        model: &calibrated.model,
        observation: bench.observation,
        linear,
        threads: bench.threads,
        lattice: None,
    };
    let without = own.fit(&[], false, own.threads)?;
    let effects: Vec<Term> = terms(&own, &signals)
        .into_iter()
        .filter(|term| matches!(term, Term::Effect(_)))
        .collect();
    let screened = screen_beside(&own, &without, &signals, &effects);
    let without = tested(&own, without, &screened)?;
    if !without.test.alarmed() {
        return None;
    }
    let mut fits = own.fit_all(&starts_beside(&[], &screened), false);
    sort(&mut fits);
    let mut found = judged(&own, &without.fit, fits)?;
    let training = &bench.observation.training;
    let of_base = bench.deviations(base, true, training);
    for fit in &mut found.explanations {
        let mut deviations = of_base.clone();
        deviations.append(&mut own.deviations(fit, false, training));
        fit.deviations = deviations;
        let mut settings: Vec<Setting> = base.settings.clone();
        settings.append(&mut fit.settings);
        fit.settings = settings;
    }
    Some(found)
}

/// Hats over the field, apart for rising and falling branches; one is left out, for together they are the zero.
fn curves(observation: &Observation, signals: &[Signals]) -> Vec<Vec<f64>> {
    let fields = signals.iter().flat_map(|run| run.field.iter().copied());
    let (low, high) = fields.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), field| {
        (low.min(field), high.max(field))
    });
    let spacing = (high - low) / (KNOTS - 1) as f64;
    let mut columns = vec![vec![0.0; observation.measured.len()]; 2 * KNOTS];
    for channel in observation.of_kind(ChannelKind::Output) {
        let field = &signals[channel.run].field;
        for (row, value) in field.iter().enumerate() {
            let falling = *value < field[row.saturating_sub(1)];
            let place = ((value - low) / spacing).clamp(0.0, (KNOTS - 1) as f64 - 1e-9);
            let (knot, share) = (place.floor() as usize, place.fract());
            let first = knot + if falling { KNOTS } else { 0 };
            columns[first][channel.rows.start + row] = channel.noise_rms * (1.0 - share);
            columns[first + 1][channel.rows.start + row] = channel.noise_rms * share;
        }
    }
    columns
        .into_iter()
        .skip(1)
        .map(|column| observation.whiten(column))
        .collect()
}
