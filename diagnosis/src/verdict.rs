//! From a decomposition to what is said: shares of the gap, values with intervals, a verdict and how sure it is.
//!
//! Confidence = e^{−E}/Σ e^{−E'} over all that was fitted (E: `evidence.rs`), times 1 − √(max(0, r² − n²))/|g|: r what is left, n the noise that the
//! measurement itself shows. So nothing that leaves a third of a gap is named with more than 0.67. Of `none` it is the first factor; of
//! `unknown` 1/(1 + e^{G − F}), F what a free curve gains and G the best effect, and ½ where no curve ended the search.

use anhyst_identify::order::{ascending, descending};
use anhyst_model::{ActuatorModel, EffectKind, NominalParameter, ParameterSpec};

use crate::acquisition::LowPass;
use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::decomposition::Decomposition;
use crate::diagnosis::{Candidate, FittedValue, FoundEffect, ScoreGroup, ScoreTest, Verdict};
use crate::evidence::{Evidence, LACK_OF_FIT, noise_rms};
use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::nuisance::NuisanceKind;
use crate::search::{JOINS, values_of};
use crate::shares::{
    Contribution, ContributionKind, DRIFT, Gap, centred, contributions, line_name, linear_contributions, remainder_rms,
    without,
};
use crate::statistics::{chi_square_tail, rms};
use crate::term::Term;
use crate::unknown::Slot;

/// Drift of the zero is an effect from this multiple of what is left on, and nuisance below.
const DRIFTS: f64 = 1.5;
/// An output whose model moves by less than this many noises (rms) shows nothing.
const OUT_OF_NOISE: f64 = 1.0;
/// A constant counts as moved beyond this many standard deviations of its fit and half a one of its prior.
const MOVED: f64 = 4.0;

/// An answer must be believed as much, beside all that was tried.
pub(crate) const MIN_BELIEVED: f64 = 0.05;
/// Names that explain a smaller part of the gap, rms, are no answer.
const MIN_EXPLAINED: f64 = 0.5;

/// Everything that is told of a decomposition but where the gap is.
pub(crate) struct Told {
    pub verdict: Verdict,
    pub effects: Vec<FoundEffect>,
    pub nuisance: Vec<FoundEffect>,
    pub parameters: Vec<FoundEffect>,
    pub explained: f64,
    pub remainder_rms: f64,
    pub noise_rms: f64,
    pub confidence: f64,
    pub contributions: Vec<Contribution>,
}

pub(crate) fn tell(bench: &Bench, model: &ActuatorModel, found: &Decomposition) -> Option<Told> {
    let gap = Gap::of(bench);
    let last = &found.last;
    let evidence = Evidence::new(bench, &last.point);
    let covariance = bench.covariance(last, &evidence.levels(&last.point));
    let deviation = |index: usize| {
        let unknown = &last.point.composition.unknowns[index];
        covariance[(index, index)].max(0.0).sqrt() * unknown.coordinate.slope(unknown.value).abs()
    };
    let mut contributions = contributions(bench, model, last);
    let known = Known {
        last,
        contributions: &contributions,
        gap: &gap,
        deviation: &deviation,
    };
    let terms = last.point.composition.terms();
    let alone = |term: Term| {
        if terms.len() == 1 {
            return None;
        }
        let values = values_of(&last.point.composition, term);
        let fit = bench.fit(
            &found.base.point.composition.with(term, model, &values)?,
            Some(&found.base),
        )?;
        let part = without(bench, &fit.point, &fit.point.composition.without(term, model))?;
        Some(gap.share(&part))
    };
    let mut effects: Vec<FoundEffect> = terms
        .iter()
        .map(|term| {
            let share = known.share(term.name()).unwrap_or_default();
            FoundEffect {
                name: term.name().to_owned(),
                share,
                share_alone: alone(*term).unwrap_or(share),
                values: values(model, *term, &last.point.composition, &deviation),
            }
        })
        .collect();
    let remainder_rms = remainder_rms(bench, &last.point);
    let noise_rms = noise_rms(bench, &last.point);
    let mut nuisance = nuisance(bench, &known);
    let parameters = parameters(model, &known);
    if drifts(bench, last) && drift_is_sure(bench, &evidence, last) {
        let (drift, rest): (Vec<FoundEffect>, Vec<FoundEffect>) =
            nuisance.into_iter().partition(|own| own.name == DRIFT);
        nuisance = rest;
        effects.extend(drift.into_iter().map(|own| FoundEffect {
            name: EffectKind::SensorDrift.name().to_owned(),
            ..own
        }));
        for own in contributions.iter_mut().filter(|own| own.name == DRIFT) {
            own.name = EffectKind::SensorDrift.name().to_owned();
            own.kind = ContributionKind::Effect;
        }
    }
    descending(&mut effects, |effect| effect.share);
    let explained = gap.explained(bench, &last.point);
    let unexplained = (remainder_rms * remainder_rms - noise_rms * noise_rms).max(0.0).sqrt();
    let part = 1.0 - (unexplained / gap.rms().max(f64::MIN_POSITIVE)).min(1.0);
    let verdict = verdict(bench, found, &evidence, &effects, [remainder_rms, noise_rms, part]);
    Some(Told {
        confidence: confidence(found, &evidence, verdict, part),
        verdict,
        effects,
        nuisance,
        parameters,
        explained,
        remainder_rms,
        noise_rms,
        contributions,
    })
}

/// What shares and values are read off.
struct Known<'a> {
    last: &'a Fitted,
    contributions: &'a [Contribution],
    gap: &'a Gap,
    /// Of an unknown, by its place.
    deviation: &'a dyn Fn(usize) -> f64,
}

impl Known<'_> {
    /// Of the gap, by a contribution's name.
    fn share(&self, name: &str) -> Option<f64> {
        let part = self.contributions.iter().find(|own| own.name == name)?;
        Some(self.gap.share(&part.series))
    }
}

/// The zero drifts by so much that it has a name.
pub(crate) fn drifts(bench: &Bench, fit: &Fitted) -> bool {
    let left = remainder_rms(bench, &fit.point);
    let mut all = linear_contributions(bench, fit).into_iter();
    all.any(|own| own.name == DRIFT && rms(own.series.iter().flatten().copied()) > DRIFTS * left)
}

/// Without a drift of the zero the evidence falls by what lets an effect join.
fn drift_is_sure(bench: &Bench, evidence: &Evidence, last: &Fitted) -> bool {
    let mut still = last.point.composition.clone();
    still.no_drift = true;
    let fit = bench.fit(&still, Some(last));
    fit.is_none_or(|fit| evidence.cost(&fit.point) - evidence.cost(&last.point) > JOINS)
}

fn values(
    model: &ActuatorModel,
    term: Term,
    composition: &Composition,
    deviation: &dyn Fn(usize) -> f64,
) -> Vec<FittedValue> {
    let of = |index: usize, spec: &ParameterSpec, nominal: Option<f64>| FittedValue {
        name: spec.name.to_owned(),
        unit: model.material.unit_of(spec.unit),
        value: composition.unknowns[index].value,
        standard_deviation: Some(deviation(index)).filter(|own| own.is_finite() && *own > 0.0),
        nominal,
    };
    let unknowns = composition.unknowns.iter().enumerate();
    unknowns
        .filter_map(|(index, unknown)| match (term, unknown.slot) {
            (Term::Effect(kind), Slot::Effect(own, place)) if own == kind => {
                let known = model.effect(kind).map(|effect| effect.values()[place]);
                Some(of(index, &kind.parameters()[place], known))
            }
            (Term::Parameter(parameter), Slot::Nominal(own)) if own == parameter => {
                Some(of(index, &parameter.spec(model)?, parameter.of(model)))
            }
            _ => None,
        })
        .collect()
}

fn nuisance(bench: &Bench, known: &Known) -> Vec<FoundEffect> {
    let composition = &known.last.point.composition;
    let value = |name: &str, unit: &str, value: f64, standard_deviation: Option<f64>| FittedValue {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value,
        standard_deviation,
        nominal: None,
    };
    let [input, _] = bench.plant.model.material.units();
    let unit = bench.plant.output.unit();
    let found = |name: String, values: Vec<FittedValue>| {
        let share = known.share(&name).unwrap_or_default();
        FoundEffect {
            name,
            share,
            share_alone: share,
            values,
        }
    };
    let mut all = Vec::new();
    for (index, unknown) in composition.unknowns.iter().enumerate() {
        let deviation = Some((known.deviation)(index));
        match unknown.slot {
            Slot::Start(run) => {
                let turn = composition.unknowns.iter().position(|own| own.slot == Slot::Turn(run));
                let turn = turn.map(|place| {
                    let turned = composition.unknowns[place].value;
                    value("turn_a_per_m", "A/m", turned, Some((known.deviation)(place)))
                });
                let mut values = vec![value("magnetization_a_per_m", "A/m", unknown.value, deviation)];
                values.extend(turn);
                all.push(found(format!("magnetic_start_{}", run + 1), values));
            }
            Slot::DriveZero => all.push(found(
                "drive_zero".to_owned(),
                vec![value("field_a_per_m", input, unknown.value, deviation)],
            )),
            Slot::ShapeOffset(run) => all.push(found(
                format!("shape_offset_{}", run + 1),
                vec![value("offset_a_per_m", "A/m", unknown.value, deviation)],
            )),
            Slot::ShapeDrift(run) => all.push(found(
                format!("shape_drift_{}", run + 1),
                vec![value("drift_a_per_m", "A/m", unknown.value, deviation)],
            )),
            Slot::Corner(_) => {
                let is_its = |(kind, _): &&(ChannelKind, LowPass)| composition.corner_of(*kind) == Some(index);
                for (kind, low_pass) in composition.low_passes.iter().filter(is_its) {
                    let name = if *kind == ChannelKind::Field {
                        "probe_low_pass"
                    } else {
                        "recorder_low_pass"
                    };
                    let corner = value("corner_hz", "Hz", unknown.value, deviation);
                    let order = value("order", "", f64::from(low_pass.order), None);
                    all.push(found(name.to_owned(), vec![corner, order]));
                }
            }
            _ => {}
        }
    }
    let nuisance = &known.last.point.nuisance;
    let linear = nuisance.kinds.iter().zip(&nuisance.coefficients);
    for (kind, coefficient) in linear {
        match kind {
            NuisanceKind::Drift(channel) => {
                let own = &bench.plant.channels[*channel];
                let duration_s = bench.plant.runs[own.run].tick_s.unwrap_or(1.0) * own.rows.len() as f64;
                let rate = coefficient / duration_s;
                all.push(found(
                    DRIFT.to_owned(),
                    vec![value("drift_m_per_s", &format!("{unit}/s"), rate, None)],
                ));
            }
            NuisanceKind::ProbeGain(_) => all.push(found(
                "probe_gain".to_owned(),
                vec![value("relative_gain", "", *coefficient, None)],
            )),
            NuisanceKind::Line(place, false) => {
                let line = composition.lines[*place];
                let amplitude = std::f64::consts::SQRT_2 * nuisance.line_rms(*place);
                let frequency = value("frequency_hz", "Hz", line.frequency_hz, None);
                let name = line_name(line.frequency_hz);
                all.push(if bench.plant.channels[line.channel].kind == ChannelKind::Field {
                    let amplitude = value("amplitude_a_per_m", input, amplitude, None);
                    found(format!("field_{name}"), vec![frequency, amplitude])
                } else {
                    found(name, vec![frequency, value("amplitude_m", unit, amplitude, None)])
                });
            }
            NuisanceKind::CreepMemory(..) | NuisanceKind::Line(_, true) => {}
        }
    }
    descending(&mut all, |effect| effect.share);
    all
}

fn parameters(model: &ActuatorModel, known: &Known) -> Vec<FoundEffect> {
    let composition = &known.last.point.composition;
    NominalParameter::ALL
        .into_iter()
        .filter(|parameter| !composition.freed.contains(parameter))
        .filter_map(|parameter| {
            let share = known.share(parameter.term())?;
            Some(FoundEffect {
                name: parameter.term().to_owned(),
                share,
                share_alone: share,
                values: values(model, Term::Parameter(parameter), composition, known.deviation),
            })
        })
        .collect()
}

/// Constants that moved for sure.
pub(crate) fn moved(parameters: &[FoundEffect]) -> Vec<FoundEffect> {
    let own = parameters.iter().filter(|effect| {
        effect.values.iter().any(|value| {
            let moved = value.nominal.map_or(0.0, |nominal| (value.value - nominal).abs());
            value
                .standard_deviation
                .is_some_and(|deviation| moved > MOVED * deviation)
        })
    });
    own.cloned().collect()
}

fn verdict(
    bench: &Bench,
    found: &Decomposition,
    by: &Evidence,
    effects: &[FoundEffect],
    [left, noise, part]: [f64; 3],
) -> Verdict {
    let plant = &bench.plant;
    let moves = plant.outputs().any(|(_, channel)| {
        let own = &plant.series(channel, &found.base.point.runs[channel.run])[channel.rows.clone()];
        rms(centred(own.to_vec())) > OUT_OF_NOISE * channel.noise_rms
    });
    let all = |of: fn(&str) -> bool| !effects.is_empty() && effects.iter().all(|effect| of(&effect.name));
    let is_outdone = found.nameless && (left > noise || found.unlisted.is_empty());
    let is_calibrated = all(|name| name.starts_with("parameter_"));
    if effects.is_empty() && !moves {
        Verdict::NotExcited
    } else if effects.is_empty() && is_outdone || (effects.is_empty() || is_calibrated) && left > LACK_OF_FIT * noise {
        Verdict::Unknown
    } else if effects.is_empty() {
        Verdict::None
    } else if believed(found, by) < MIN_BELIEVED || part < MIN_EXPLAINED {
        Verdict::Unknown
    } else if !found.ties.is_empty() && !shared_by_ties(found) {
        Verdict::Ambiguous
    } else if is_calibrated {
        Verdict::Parameter
    } else if all(|name| name.starts_with("sensor_") || name == "quantisation") {
        Verdict::Sensor
    } else {
        Verdict::Named
    }
}

/// A term of the answer stands in all that explains as well: it is named, whatever stands beside it.
fn shared_by_ties(found: &Decomposition) -> bool {
    let terms = found.last.point.composition.terms();
    let mut ties = terms.iter().filter(|term| {
        let mut ties = found.ties.iter();
        ties.all(|tie| tie.point.composition.terms().contains(term))
    });
    ties.next().is_some()
}

/// e^{−E}/Σ e^{−E'} over all that was fitted, for the answer.
pub(crate) fn believed(found: &Decomposition, by: &Evidence) -> f64 {
    let own = &found.last.point;
    let terms = own.composition.terms();
    // A rival has other terms, not more; each term more than the answer's would have to earn its place.
    let rivals = found.tried.iter().chain(&found.ties).filter_map(|fit| {
        let other = fit.point.composition.terms();
        let more = other.len() as f64 - terms.len() as f64;
        let has_all = terms.iter().all(|term| other.contains(term));
        (terms.is_empty() || !has_all).then_some(by.cost(&fit.point) - by.cost(own) + JOINS * more)
    });
    1.0 / (1.0 + rivals.map(|rise| (-rise).min(300.0).exp()).sum::<f64>())
}

fn confidence(found: &Decomposition, by: &Evidence, verdict: Verdict, part: f64) -> f64 {
    match verdict {
        // A free curve beats the library by so much.
        Verdict::Unknown if found.nameless => {
            let gains = found.tried.iter().map(|fit| found.last.point.cost - fit.point.cost);
            let best = gains.fold(0.0, f64::max);
            let free = found.unlisted.first().map_or(0.0, |free| free.gain);
            (1.0 / (1.0 + (best - free).exp())).max(0.5)
        }
        Verdict::Unknown => 0.5,
        Verdict::None | Verdict::NotExcited => believed(found, by),
        _ => believed(found, by) * part,
    }
}

/// All that was fitted, lowest J first, counted from the answer.
pub(crate) fn candidates(bench: &Bench, found: &Decomposition) -> Vec<Candidate> {
    let mut fits: Vec<&Fitted> = vec![&found.base, &found.last];
    fits.extend(&found.tried);
    fits.extend(&found.ties);
    ascending(&mut fits, |fit| fit.point.cost);
    let mut candidates: Vec<Candidate> = Vec::new();
    for fit in fits {
        let terms = fit.point.composition.terms();
        let name = name(&terms);
        if candidates.iter().all(|own| own.name != name) {
            candidates.push(Candidate {
                name,
                terms: terms.len(),
                delta_bic: 2.0 * (fit.point.cost - found.last.point.cost),
                gap_after: remainder_rms(bench, &fit.point),
            });
        }
    }
    candidates
}

/// Names joined as a table shows them.
pub(crate) fn name(terms: &[Term]) -> String {
    if terms.is_empty() {
        return "none".to_owned();
    }
    terms.iter().map(|term| term.name()).collect::<Vec<_>>().join(" + ")
}

/// What was asked of the residual of the fit without any term, and of the last.
pub(crate) fn tests(found: &Decomposition) -> (ScoreTest, ScoreTest) {
    let group = |name: &str, gain: f64, degrees: usize| ScoreGroup {
        name: name.to_owned(),
        statistic: 2.0 * gain.max(0.0),
        degrees,
        tail: chi_square_tail(2.0 * gain.max(0.0), degrees),
    };
    let before = found.screened.iter().filter(|own| matches!(own.term, Term::Effect(_)));
    let before = before.map(|own| group(own.term.name(), own.gain, own.values.len().max(1)));
    let after = found.unlisted.iter().map(|own| {
        let degrees = own.curve.knots.len() - 1;
        group(own.curve.over.name(), own.gain + 5.0 * degrees as f64, degrees)
    });
    (ScoreTest::of(before.collect()), ScoreTest::of(after.collect()))
}
