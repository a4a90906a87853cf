//! measured = simulated(constants, effects) + nuisance + what is left: effects join one by one, each fitted with all that is in.
//!
//! 1. The nominal chain with its constants, starts and linear nuisance is fitted; the recorder's low pass and lines are sought in what it leaves.
//! 2. Every term is screened beside it, the best few are fitted, and the one with the lowest J joins if J falls by more than `JOINS`
//!    and the residual moves by more than a share of what is left. A free curve that gains far more than any of them ends the search:
//!    what is missing has no name.
//! 3. Until nothing joins. Then the one that is missed least is taken out, as long as the evidence (`evidence.rs`) falls by less than `JOINS`.

use anhyst_identify::parallel;
use anhyst_model::{ActuatorModel, EffectKind};

use crate::acquisition::{Likely, LowPass};
use crate::channel::ChannelKind;
use crate::composition::{Composition, Slot, Unknown};
use crate::evidence::{Evidence, noise_rms};
use crate::likelihood::{Bench, Fitted, Point};
use crate::linearised::Linearised;
use crate::lines::lines;
use crate::probes::Surroundings;
use crate::screening::{Screened, screen};

use crate::signals::{Signals, signals};
use crate::statistics::rms;
use crate::term::Term;
use crate::unlisted::{Unlisted, unlisted};

/// Fall of J with which a term joins: e³⁰ to one.
pub(crate) const JOINS: f64 = 30.0;
/// A term must move the residual of some band by this share of what is left of it.
const MOVES: f64 = 0.4;
/// A rough fit tells of so many times that fall that it is there.
const SURELY: f64 = 10.0;
/// Terms that are fitted after each screening.
const FITTED: usize = 4;
/// Constants that are let out of their boxes beside them.
const CONSTANTS: usize = 2;
/// As often, while fewer than half of them came to something.
const ATTEMPTS: usize = 3;
/// A term that promises less is not fitted.
const PROMISES: f64 = 10.0;
const MAX_TERMS: usize = 5;
/// Fits whose evidence lies within this explain equally well.
pub(crate) const TIES: f64 = 12.0;
/// A free curve must gain this much more than the best of the library, and this factor.
const NAMELESS: (f64, f64) = (60.0, 1.25);
/// A constant this many deviations from what is believed of it is bent.
const BENT: f64 = 2.0;
/// Share of its box beyond which a constant may be set free.
const AT_THE_BOX: f64 = 0.6;
/// First magnetizations that are tried, A/m per saturation.
const STARTS: [f64; 12] = [
    -0.4, -0.26, -0.18, -0.11, -0.06, -0.02, 0.02, 0.06, 0.11, 0.18, 0.26, 0.4,
];
const MAX_LINES: usize = 8;
/// A line that is not the mains' is a disturbance of the plant from this multiple of the noise on, and nuisance below: the
/// output alone does not tell which.
const LOUD: f64 = 3.0;

/// What came out.
pub(crate) struct Decomposition {
    /// The model as given, with its zero, nothing fitted.
    pub nominal: Point,
    /// Constants and nuisance, no term.
    pub base: Fitted,
    /// With all terms.
    pub last: Fitted,
    /// Fits that explain as well, each with one term in the place of another.
    pub ties: Vec<Fitted>,
    /// Fits that were tried at each stage.
    pub tried: Vec<Fitted>,
    /// What the free curves gain beside the last fit.
    pub unlisted: Vec<Unlisted>,
    /// A free curve ended the search.
    pub nameless: bool,
    /// The first screening.
    pub screened: Vec<Screened>,
}

/// What the search is told.
pub(crate) struct Search<'a> {
    pub bench: &'a Bench,
    pub model: &'a ActuatorModel,
    pub lattice: Option<f64>,
    /// Of the recorder.
    pub low_passes: Vec<(ChannelKind, LowPass)>,
    pub progress: &'a mut dyn FnMut(&str, f64),
}

impl Decomposition {
    /// By how much it explains the measurement worse than another: J, and what each term more has to earn.
    pub fn cost(&self) -> f64 {
        self.last.point.cost + JOINS * self.last.point.composition.terms().len() as f64
    }
}

impl Search<'_> {
    pub fn run(&mut self) -> Option<Decomposition> {
        let bench = self.bench;
        (self.progress)("the model as given", 0.0);
        let nominal = bench.point(&Composition::default())?;
        let (mut base, mut off_mains) = self.base()?;
        let first = base.clone();
        let (mut tried, mut ties): (Vec<Fitted>, Vec<(Term, Fitted)>) = (Vec::new(), Vec::new());
        let mut screened_first = Vec::new();
        let mut free = Vec::new();
        let mut nameless = false;
        for stage in 0..=MAX_TERMS {
            (self.progress)("screening", 0.15 + 0.13 * stage as f64);
            let screened = self.screen(&base, &off_mains);
            if stage == 0 {
                screened_first.clone_from(&screened);
            }
            let mut fits = self.fit_best(&base, &screened, stage);
            let at_noise = fits
                .first()
                .is_some_and(|(_, fit)| !Evidence::new(bench, &fit.point).is_misfit);
            if stage == 0
                && !at_noise
                && let Some(unbent) = unbent(bench, &base)
            {
                let screened = self.screen(&unbent, &off_mains);
                fits.extend(self.fit_best(&unbent, &screened, stage));
                fits.retain(|(_, fit)| fit.point.cost < base.point.cost);
                sort(&mut fits);
                let mut seen: Vec<Term> = Vec::new();
                fits.retain(|(term, _)| {
                    !seen.contains(term) && {
                        seen.push(*term);
                        true
                    }
                });
            }
            free = unlisted(bench, &base);
            let best = fits.first();
            let gain = best.map_or(0.0, |(_, fit)| base.point.cost - fit.point.cost);
            // Beside a fitted model's own error a curve proves nothing.
            let beaten = free
                .first()
                .is_some_and(|own| !bench.plant.fitted && own.gain > gain + NAMELESS.0 && own.gain > NAMELESS.1 * gain);
            if beaten {
                nameless = true;
                tried.extend(fits.into_iter().map(|(_, fit)| fit));
                break;
            }
            let Some((term, best)) = best.cloned() else { break };
            if gain < JOINS || !self.moves(&base, &best) || stage == MAX_TERMS {
                tried.extend(fits.into_iter().map(|(_, fit)| fit));
                break;
            }
            let evidence = Evidence::new(bench, &best.point);
            let least = evidence.cost(&best.point);
            for (other, fit) in &fits {
                if *other != term && evidence.cost(&fit.point) - least < TIES {
                    ties.push((term, fit.clone()));
                }
            }
            tried.extend(fits.into_iter().map(|(_, fit)| fit));
            let polished = bench.fit(&best.point.composition, None)?;
            if at_a_bound(&polished.point.composition, term) {
                break;
            }
            base = polished;
            off_mains = self.lines(&mut base)?;
        }
        (self.progress)("taking each out again", 0.85);
        let last = self.without_those_that_earn_nothing(base)?;
        let ties = self.ties(&last, &ties);
        Some(Decomposition {
            nominal,
            base: first,
            last,
            ties,
            tried,
            unlisted: free,
            nameless,
            screened: screened_first,
        })
    }

    /// Constants, starts, the recorder's low pass and lines.
    fn base(&mut self) -> Option<(Fitted, Vec<f64>)> {
        let bench = self.bench;
        let starts: Vec<usize> = bench
            .plant
            .runs
            .iter()
            .enumerate()
            .filter(|(_, run)| run.tick_s.is_some())
            .map(|(index, _)| index)
            .collect();
        let mut composition = Composition::nominal(self.model, &starts, bench.plant.fitted);
        for (kind, low_pass) in &self.low_passes {
            composition = composition.with_low_pass(*kind, *low_pass);
        }
        (self.progress)("where the material was at the first row", 0.03);
        composition = self.started(composition, &starts)?;
        (self.progress)("calibrating the constants", 0.06);
        let mut base = bench.fit(&composition, None)?;
        let off_mains = self.lines(&mut base)?;
        Some((base, off_mains))
    }

    /// A composition from the best of some first magnetizations, run by run.
    fn started(&self, mut composition: Composition, starts: &[usize]) -> Option<Composition> {
        let bench = self.bench;
        let saturation = self.model.material.hysteresis.saturation_magnetization_a_per_m;
        let mut least = bench.point(&composition)?;
        for run in starts {
            let others: Vec<Composition> = STARTS
                .iter()
                .map(|share| {
                    let mut tried = composition.clone();
                    if let Some(own) = tried.unknowns.iter_mut().find(|own| own.slot == Slot::Start(*run)) {
                        own.value = share * saturation;
                    }
                    tried
                })
                .collect();
            let points = parallel::map(bench.threads, &others, |tried| bench.point(tried));
            for point in points.into_iter().flatten() {
                if point.cost < least.cost {
                    composition = point.composition.clone();
                    least = point;
                }
            }
        }
        Some(composition)
    }

    /// Takes lines into a fit as nuisance; the frequencies of those that may be an effect.
    fn lines(&mut self, base: &mut Fitted) -> Option<Vec<f64>> {
        (self.progress)("lines", 0.12);
        let mut off_mains = Vec::new();
        let mut composition = base.point.composition.clone();
        for line in lines(self.bench, &base.point) {
            if composition.lines.len() >= MAX_LINES {
                break;
            }
            let mut with = composition.clone();
            with.lines.push(line);
            let Some(point) = self.bench.point(&with) else { continue };
            if base.point.cost - point.cost < JOINS {
                continue;
            }
            let noise_rms = noise_rms(self.bench, &base.point);
            if line.of_mains() || point.nuisance.line_rms(composition.lines.len()) < LOUD * noise_rms {
                composition = with;
            } else {
                off_mains.push(line.frequency_hz);
            }
        }
        if composition != base.point.composition {
            *base = self.bench.fit(&composition, Some(base))?;
        }
        Some(off_mains)
    }

    fn screen(&self, base: &Fitted, lines_hz: &[f64]) -> Vec<Screened> {
        let signals = &signals(&self.bench.plant, &base.point.runs);
        let composition = &base.point.composition;
        let inside = composition.terms();
        let mut terms: Vec<Term> = EffectKind::ALL
            .into_iter()
            .filter(|kind| lacking(self.model, signals, *kind).is_none())
            .map(Term::Effect)
            .filter(|term| !inside.contains(term))
            .collect();
        // Drift of the zero is nuisance, and is judged by its size at the end.
        terms.retain(|term| *term != Term::Effect(EffectKind::SensorDrift));
        // A fitted model's constants are free already.
        let believed = composition.unknowns.iter().filter(|_| !self.bench.plant.fitted);
        for unknown in believed {
            if let (Slot::Nominal(parameter), Some((mean, _))) = (unknown.slot, unknown.coordinate.prior) {
                let side = if unknown.value > mean {
                    unknown.coordinate.upper
                } else {
                    unknown.coordinate.lower
                };
                let share = (unknown.value - mean) / (side - mean);
                if share > AT_THE_BOX && !inside.contains(&Term::Parameter(parameter)) {
                    terms.push(Term::Parameter(parameter));
                }
            }
        }
        let surroundings = Surroundings {
            model: self.model,
            signals,
            lines_hz,
            lattice: self.lattice,
        };
        let (parameters, effects): (Vec<Term>, Vec<Term>) =
            terms.into_iter().partition(|term| matches!(term, Term::Parameter(_)));
        let mut screened = screen(self.bench, base, &surroundings, &effects);
        // A constant is in the fit already: it is let out of its box and fitted, if that promises most.
        let linear = Linearised::new(self.bench, base, &base.point.levels);
        let promised = parameters.into_iter().filter_map(|term| {
            let Term::Parameter(parameter) = term else { return None };
            let mut unknowns = composition.unknowns.iter();
            let index = unknowns.position(|own| own.slot == Slot::Nominal(parameter))?;
            let (gain, _, _) = linear.gain(&base.columns[index..=index], 0.0);
            Some(Screened {
                term,
                values: vec![composition.unknowns[index].value],
                gain: gain.likelihood,
                seen: None,
            })
        });
        let mut promised: Vec<Screened> = promised.collect();
        promised.sort_by(|one, other| other.gain.total_cmp(&one.gain));
        promised.truncate(CONSTANTS);
        screened.splice(0..0, promised);
        screened
    }

    /// The most promising terms fitted beside a fit, lowest J first.
    fn fit_best(&mut self, base: &Fitted, screened: &[Screened], stage: usize) -> Vec<(Term, Fitted)> {
        let parameters = screened.iter().filter(|own| matches!(own.term, Term::Parameter(_)));
        let mut effects = screened
            .iter()
            .filter(|own| matches!(own.term, Term::Effect(_)) && own.gain > PROMISES);
        let mut chosen: Vec<&Screened> = parameters.chain(effects.by_ref().take(FITTED)).collect();
        let names: Vec<&str> = chosen.iter().map(|own| own.term.name()).collect();
        (self.progress)(&format!("fitting {}", names.join(", ")), 0.2 + 0.13 * stage as f64);
        let mut fits: Vec<(Term, Fitted)> = Vec::new();
        for _ in 0..ATTEMPTS {
            let own = parallel::map(self.bench.threads, &chosen, |own| {
                let composition = base.point.composition.with(own.term, self.model, &own.values)?;
                Some((own.term, self.bench.fit(&composition, Some(base))?))
            });
            // A size at the end of its range is no size, and a fit that gets stuck above where it came from tells nothing.
            let counts = |(term, fit): &(Term, Fitted)| {
                fit.point.cost < base.point.cost && !at_a_bound(&fit.point.composition, *term)
            };
            fits.extend(own.into_iter().flatten().filter(counts));
            if 2 * fits.len() >= FITTED {
                break;
            }
            chosen = effects.by_ref().take(FITTED).collect();
        }
        sort(&mut fits);
        fits
    }

    /// A term moves the residual of some band by more than a share of what is left of it.
    fn moves(&self, before: &Fitted, after: &Fitted) -> bool {
        self.bench.bands.iter().any(|band| {
            let (old, new) = (&before.point.residual, &after.point.residual);
            let moved = rms(band.iter().map(|place| old[*place] - new[*place]));
            moved > MOVES * rms(band.iter().map(|place| new[*place]))
        })
    }

    /// Takes terms out, the one that is missed least first, until the evidence would fall by what lets one join, and as plainly.
    fn without_those_that_earn_nothing(&self, mut last: Fitted) -> Option<Fitted> {
        let bench = self.bench;
        loop {
            let terms = last.point.composition.terms();
            if terms.is_empty() {
                return Some(last);
            }
            let evidence = Evidence::new(bench, &last.point);
            let (own, model) = (evidence.cost(&last.point), self.model);
            let fits = parallel::map(bench.threads, &terms, |term| {
                let rough = bench.fit(&last.point.composition.without(*term, model), Some(&last))?;
                if evidence.cost(&rough.point) - own > SURELY * JOINS {
                    return Some(rough);
                }
                // It must not earn what the others had not been fitted to yet.
                let fit = bench.fit(&rough.point.composition, None)?;
                let unbent = unbent(bench, &fit).and_then(|unbent| bench.fit(&unbent.point.composition, None));
                let fits = std::iter::once(fit).chain(unbent);
                fits.min_by(|one, other| one.point.cost.total_cmp(&other.point.cost))
            });
            let falls = fits.into_iter().flatten().map(|fit| (evidence.cost(&fit.point), fit));
            match falls.min_by(|one, other| one.0.total_cmp(&other.0)) {
                Some((cost, fit)) if cost - own < JOINS || !self.moves(&fit, &last) => last = fit,
                _ => return Some(last),
            }
        }
    }

    /// The last fit with one term in the place of another, where it explains as well.
    fn ties(&mut self, last: &Fitted, found: &[(Term, Fitted)]) -> Vec<Fitted> {
        (self.progress)("what would explain it as well", 0.9);
        let terms = last.point.composition.terms();
        let evidence = Evidence::new(self.bench, &last.point);
        let most = evidence.cost(&last.point) + TIES;
        let mut ties: Vec<Fitted> = Vec::new();
        for (term, fit) in found {
            let Some(other) = fit
                .point
                .composition
                .terms()
                .into_iter()
                .find(|own| !terms.contains(own))
            else {
                continue;
            };
            if !terms.contains(term) {
                continue;
            }
            let values = values_of(&fit.point.composition, other);
            let swapped = last
                .point
                .composition
                .without(*term, self.model)
                .with(other, self.model, &values);
            let fit = swapped.and_then(|swapped| self.bench.fit(&swapped, Some(last)));
            if let Some(fit) = fit.filter(|fit| evidence.cost(&fit.point) < most) {
                ties.push(fit);
            }
        }
        ties
    }
}

/// The same fit with all constants as given, where what is missing has bent one of them towards the end of its box: there an
/// effect finds the room that they have taken.
fn unbent(bench: &Bench, base: &Fitted) -> Option<Fitted> {
    let mut composition = base.point.composition.clone();
    let is_bent = |own: &Unknown| own.surprise().abs() > BENT;
    let own = |own: &&mut Unknown| matches!(own.slot, Slot::Nominal(_));
    if bench.plant.fitted || !composition.unknowns.iter().any(is_bent) {
        return None;
    }
    for unknown in composition.unknowns.iter_mut().filter(own) {
        if let Some((mean, _)) = unknown.coordinate.prior {
            unknown.value = mean;
        }
    }
    let point = bench.point(&composition)?;
    let columns = bench.columns(&point, None)?;
    Some(Fitted { point, columns })
}

/// The one with the lowest J first.
fn sort(fits: &mut [(Term, Fitted)]) {
    fits.sort_by(|(_, one), (_, other)| one.point.cost.total_cmp(&other.point.cost));
}

/// The recorder's low passes in what a point leaves of field and output. What a fitted model leaves of the output is its own
/// error, whose spectrum falls without any filter.
pub(crate) fn low_passes(bench: &Bench, point: &Point) -> Vec<(ChannelKind, Likely)> {
    let of = |kind: ChannelKind| {
        let is_noise = kind == ChannelKind::Field || !bench.plant.fitted;
        let channel = bench.plant.channels.iter().find(|own| own.kind == kind && is_noise)?;
        let tick_s = bench.plant.runs[channel.run].tick_s?;
        let seen = LowPass::seen(&bench.left(point, channel), tick_s, channel.resolution);
        (!seen.is_empty()).then_some((kind, seen))
    };
    let kinds = [ChannelKind::Field, ChannelKind::Output].into_iter();
    kinds.filter_map(of).collect()
}

/// An effect's fitted size stands at the far end of its range.
fn at_a_bound(composition: &Composition, term: Term) -> bool {
    let Term::Effect(kind) = term else { return false };
    composition.unknowns.iter().any(|own| {
        let spec = |place: usize| kind.parameters()[place];
        let is_size = |place: usize| spec(place).identity().is_some() && !spec(place).is_limit();
        let coordinate = &own.coordinate;
        let far = |bound: f64, identity: f64| bound != identity && (own.value - bound).abs() < 1e-3 * (coordinate.upper - coordinate.lower);
        matches!(own.slot, Slot::Effect(of, place) if of == kind && is_size(place) && coordinate.lower < coordinate.upper
            && spec(place).identity().is_some_and(|zero| far(coordinate.lower, zero) || far(coordinate.upper, zero)))
    })
}

/// The fitted rows of a term in a composition.
pub(crate) fn values_of(composition: &Composition, term: Term) -> Vec<f64> {
    let of = |slot: Slot| {
        composition
            .unknowns
            .iter()
            .find(|own| own.slot == slot)
            .map(|own| own.value)
    };
    match term {
        Term::Parameter(parameter) => of(Slot::Nominal(parameter)).into_iter().collect(),
        Term::Effect(kind) => Term::fitted(kind)
            .filter_map(|(place, _)| of(Slot::Effect(kind, place)))
            .collect(),
    }
}

/// What an effect needs and neither model nor data have, in a sentence.
pub(crate) fn lacking(model: &ActuatorModel, signals: &[Signals], kind: EffectKind) -> Option<&'static str> {
    let timed = signals.iter().all(|run| run.tick_s.is_some());
    let warm = signals.iter().all(|run| run.temperature.is_some());
    if kind.needs_time() && !timed {
        Some("it needs time, which the data lack")
    } else if kind.needs_rod() && model.rod.is_none() {
        Some("it acts on a moving rod, which the model lacks")
    } else if kind.needs_coil(warm) && !model.coil {
        Some("its cause is a coil, which the model lacks")
    } else {
        None
    }
}
