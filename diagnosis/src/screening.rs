//! What each term would gain beside a fit: its trial is simulated, and its multiple solved for together with all that is in.
//!
//! D = spectra with the term at a trial value minus those without. A secant search follows: the term is simulated at the multiple found,
//! and again from there, until the multiple stays near 1; so limits and lags far from their trial are found, too.

use std::sync::Arc;

use anhyst_identify::engine::Coordinate;
use anhyst_identify::order::descending;
use anhyst_identify::parallel;

use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::linearised::{Gain, Held, Linearised};
use crate::probes::{ProbeGroup, Surroundings};
use crate::term::Term;

const ROUNDS: usize = 3;
/// A multiple within this factor of 1 ends the search: the fit takes over.
const NEAR: f64 = 1.5;
/// What a trial promised is come to this closely.
const AS_FORETOLD: f64 = 0.9;
/// Of a term's places to begin at, those that are searched further.
const SEARCHED: usize = 3;
/// Golden sections between two levels of a limit.
const SECTIONS: usize = 9;
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Levels one after the other that show and leave more: no lower one is tried.
const VAIN: usize = 2;
/// Energy with which a level shows.
const SHOWS: f64 = 80.0;
/// A gap is large from this multiple of a trial's answer on.
const LARGE: f64 = 10.0;

/// What a term promises.
#[derive(Clone, Debug)]
pub(crate) struct Screened {
    pub term: Term,
    /// Where a fit begins.
    pub values: Vec<f64>,
    /// Fall of J or E seen there.
    pub gain: f64,
    /// Change of the spectra by the trial, over the levels: (quantity's place, size of the trial, norm).
    pub seen: Option<Seen>,
}

/// How strongly a trial would show.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub place: usize,
    pub trial: f64,
    pub is_ratio: bool,
    /// Σ D²/S.
    pub energy: f64,
}

/// Terms beside a fit, most promising first.
pub(crate) fn screen(bench: &Bench, base: &Fitted, surroundings: &Surroundings, terms: &[Term]) -> Vec<Screened> {
    let linear = Linearised::new(bench, base);
    let mut all: Vec<Screened> = parallel::map(bench.threads, terms, |term| {
        one(bench, base, &linear, surroundings, *term)
    })
    .into_iter()
    .flatten()
    .collect();
    descending(&mut all, |own| own.gain);
    all
}

fn one(bench: &Bench, base: &Fitted, linear: &Linearised, surroundings: &Surroundings, term: Term) -> Option<Screened> {
    let specs = term.specs(surroundings.model)?;
    let coordinates: Vec<Coordinate> = specs.iter().map(Coordinate::of).collect();
    let answer = |values: &[f64], is_round: bool| {
        let tried = base.point.composition.with(term, surroundings.model, values)?;
        let tried = if is_round { tried.inside(term) } else { tried };
        bench.change(&base.point, &tried)
    };
    let kept = |values: &[f64], is_round: bool| {
        // Rounding answers to the last digit of what is rounded.
        if term.is_lattice() {
            return answer(values, is_round).map(Arc::new);
        }
        let asked = (term, is_round, values);
        let is_asked = |own: &(Term, bool, Vec<f64>)| (own.0, own.1, &own.2[..]) == asked;
        let question = || (term, is_round, values.to_vec());
        surroundings.trials.get(is_asked, question, || answer(values, is_round))
    };
    if term.is_limit() || term.is_lattice() {
        // A sharp edge and a round one hardly answer to each other.
        let forms = [false, true]
            .into_iter()
            .filter(|is_round| !is_round || term.is_limit());
        let searched = forms.filter_map(|is_round| {
            let trial = |values: &[f64]| kept(values, is_round);
            limit(term, linear, surroundings, trial, |values| answer(values, is_round))
        });
        return searched.max_by(|one, other| one.gain.total_cmp(&other.gain));
    }
    let difference = |values: &[f64]| answer(values, false);
    let trial = |values: &[f64]| kept(values, false);
    let mut seen: Option<Seen> = None;
    let mut starts: Vec<(f64, ProbeGroup, Vec<f64>)> = Vec::new();
    for group in surroundings.probes(term) {
        let alone = |(place, value): &(usize, f64)| {
            let mut values = group.absent.clone();
            values[*place] = *value;
            trial(&values)
        };
        let Some(answers) = group.sizes.iter().map(alone).collect::<Option<Vec<_>>>() else {
            continue;
        };
        let answers: Vec<&[f64]> = answers.iter().map(|own| own.as_slice()).collect();
        if let Some((place, value)) = group.sizes.first() {
            let energy = linear.energy(answers[0]);
            let own = Seen {
                place: *place,
                trial: value - group.absent[*place],
                is_ratio: false,
                energy,
            };
            let smallest = |own: &Seen| own.trial.abs() / own.energy.sqrt();
            if seen.as_ref().is_none_or(|before| smallest(&own) < smallest(before)) {
                seen = Some(own);
            }
        }
        let (gain, multiples, _) = linear.gain(&answers, Held::Free, 1);
        let values = at(&group, &coordinates, &group.absent, &multiples);
        // What is no multiple of a small trial (a play, a friction) is tried at the size of the gap, too: by what it is over the noise, and
        // as it is, because a small play answers to ripples of which a large one knows nothing.
        let sized = |size: f64| {
            let signed = multiples.iter().map(|multiple| size.copysign(*multiple));
            let own = at(&group, &coordinates, &group.absent, &signed.collect::<Vec<f64>>());
            if own == group.absent {
                // Beside constants that imitate it, a small trial of what has one sign only may ask for the other.
                at(&group, &coordinates, &group.absent, &vec![size; multiples.len()])
            } else {
                own
            }
        };
        let over_noise = (linear.misfit() / linear.energy(answers[0])).sqrt();
        let as_it_is = bench.output_energy(&base.point.residual) / bench.output_energy(answers[0]);
        let mut all = vec![values];
        for size in [over_noise, as_it_is.sqrt()] {
            if size > LARGE && size.is_finite() {
                all.push(sized(size));
            }
        }
        starts.extend(all.into_iter().map(|values| (gain.likelihood, group.clone(), values)));
    }
    descending(&mut starts, |own| own.0);
    let mut best: Option<(f64, Vec<f64>)> = None;
    let promising = |(gain, _, _): &(f64, ProbeGroup, Vec<f64>)| !linear.is_hopeless(*gain);
    // What answered as its trial foretold, and what it gained: another size that gains the same tells no more.
    let mut foretold: Option<(ProbeGroup, f64)> = None;
    for (promised, group, values) in starts.into_iter().filter(promising).take(SEARCHED) {
        let mut values = values;
        for _ in 0..ROUNDS {
            if values == group.absent {
                break;
            }
            let Some(answer) = difference(&values) else {
                // Too far: the model refuses it.
                let halved = group
                    .absent
                    .iter()
                    .zip(&values)
                    .map(|(absent, own)| 0.5 * (absent + own));
                values = halved.collect();
                continue;
            };
            let (gain, multiples, _) = linear.gain(std::slice::from_ref(&answer), Held::Free, 1);
            let gain = gain.likelihood;
            if best.as_ref().is_none_or(|(most, _)| gain > *most) {
                best = Some((gain, values.clone()));
            }
            let is_as = |own: f64| (AS_FORETOLD..1.0 / AS_FORETOLD).contains(&(gain / own));
            let is_known = foretold.as_ref().is_some_and(|(of, own)| *of == group && is_as(*own));
            if is_known || linear.is_hopeless(gain) {
                break;
            }
            let multiple = multiples[0];
            if (1.0 / NEAR..NEAR).contains(&multiple) {
                if is_as(promised) {
                    foretold = Some((group, gain));
                }
                break;
            }
            let multiples = vec![multiple.clamp(0.05, 20.0); group.sizes.len()];
            let along: Vec<(usize, f64)> = group.sizes.iter().map(|(place, _)| (*place, values[*place])).collect();
            let from = ProbeGroup {
                absent: group.absent.clone(),
                sizes: along,
            };
            let mut next = at(&from, &coordinates, &values, &multiples);
            // Shapes stay.
            for (place, own) in next.iter_mut().enumerate() {
                if !group.sizes.iter().any(|(size, _)| *size == place) {
                    *own = values[place];
                }
            }
            values = next;
        }
    }
    let (gain, values) = best.unwrap_or((0.0, Vec::new()));
    Some(Screened {
        term,
        values,
        gain,
        seen,
    })
}

/// A limit is not proportional to anything: the best level tried, then golden sections between its neighbours.
fn limit(
    term: Term,
    linear: &Linearised,
    surroundings: &Surroundings,
    trial: impl Fn(&[f64]) -> Option<Arc<Vec<f64>>>,
    difference: impl Fn(&[f64]) -> Option<Vec<f64>>,
) -> Option<Screened> {
    let levels: Vec<f64> = surroundings
        .probes(term)
        .iter()
        .filter_map(|group| Some(group.sizes.first()?.1))
        .collect();
    let mut seen: Option<Seen> = None;
    let mut tried: Vec<(Gain, f64)> = Vec::new();
    let mut try_level = |level: f64, answer: Option<&[f64]>| {
        let Some(answer) = answer else {
            return Gain::NONE;
        };
        let energy = linear.energy(answer);
        // Levels fall: the first that shows is the highest.
        if seen.is_none_or(|own| own.energy < SHOWS && energy > own.energy) {
            seen = Some(Seen {
                place: 0,
                trial: level,
                is_ratio: true,
                energy,
            });
        }
        let gain = linear.gain_of(answer);
        tried.push((gain, level));
        gain
    };
    let mut gains: Vec<Gain> = Vec::new();
    let mut vain = 0;
    for level in &levels {
        let answer = trial(&[*level]);
        let answer = answer.as_ref().map(|own| own.as_slice());
        let gain = try_level(*level, answer);
        gains.push(gain);
        // Where it bites and leaves more than without, it bites too much already.
        let bites = answer.is_some_and(|own| linear.energy(own) > SHOWS);
        vain = if bites && gain.size < 0.0 { vain + 1 } else { 0 };
        if vain == VAIN {
            break;
        }
    }
    let best = (0..gains.len()).max_by(|one, other| gains[*one].size.total_cmp(&gains[*other].size));
    let hopeful = gains.iter().any(|gain| !linear.is_hopeless(gain.either()));
    if let Some(best) = best.filter(|best| hopeful && gains[*best].size > 0.0 && !term.is_lattice()) {
        let mut high = if best == 0 { 1.3 * levels[0] } else { levels[best - 1] };
        let mut low = levels.get(best + 1).copied().unwrap_or(0.5 * levels[best]);
        let mut tried_at = |share: f64, low: f64, high: f64| {
            let level = low * (high / low).powf(share);
            (level, try_level(level, difference(&[level]).as_deref()).size)
        };
        let mut inside = [tried_at(1.0 - GOLDEN, low, high), tried_at(GOLDEN, low, high)];
        for _ in 1..SECTIONS {
            if inside[0].1 > inside[1].1 {
                high = inside[1].0;
                inside = [tried_at(1.0 - GOLDEN, low, high), inside[0]];
            } else {
                low = inside[0].0;
                inside = [inside[1], tried_at(GOLDEN, low, high)];
            }
        }
    }
    let (gain, level) = tried
        .into_iter()
        .max_by(|one, other| one.0.size.total_cmp(&other.0.size))?;
    Some(Screened {
        term,
        values: vec![level],
        gain: gain.either(),
        seen,
    })
}

/// Sizes at multiples of their trials beyond absence, within bounds.
fn at(group: &ProbeGroup, coordinates: &[Coordinate], values: &[f64], multiples: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    for ((place, trial), multiple) in group.sizes.iter().zip(multiples) {
        let coordinate = &coordinates[*place];
        let absent = group.absent[*place];
        let moved = absent + multiple * (trial - absent);
        values[*place] = moved.clamp(coordinate.lower, coordinate.upper);
    }
    values
}
