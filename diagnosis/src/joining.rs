//! What may join: every term screened beside a fit, and the most promising fitted with all that is in.

use anhyst_identify::order::{ascending, descending};
use anhyst_identify::parallel;
use anhyst_model::{ActuatorModel, EffectKind, Screening, Stage};

use crate::composition::Composition;
use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::linearised::{Held, Linearised, PROMISES};
use crate::probes::Surroundings;
use crate::screening::{Screened, screen};
use crate::search::{Depth, Search};
use crate::signals::{Signals, signals};
use crate::term::Term;
use crate::unknown::{Slot, Unknown};

/// Terms that are fitted after each screening.
const FITTED: usize = 4;
/// The same in a look.
const LOOKED_AT: usize = 2;
/// Constants that are let out of their boxes beside them.
const CONSTANTS: usize = 2;
/// As often, while fewer than half of them came to something.
const ATTEMPTS: usize = 3;
/// What promises a smaller part of what another has gained is not fitted: no fit was seen to find so many times what screening promised.
const OUTDONE: f64 = 0.1;
/// Share of what the best rough fit has gained within which others may yet gain more: several times what ends a rough fit.
const NEAR: f64 = 0.01;
/// A constant this many deviations from what is believed of it is bent.
const BENT: f64 = 2.0;
/// A mode is one up to this share of half the sampling rate.
const IN_BAND: f64 = 0.9;
/// So many deviations by the record of the drive an effect must have.
const DOUBTED: f64 = 2.0;
/// Share of its box beyond which a constant may be set free.
const AT_THE_BOX: f64 = 0.6;

impl Search<'_> {
    /// Terms beside a fit: the constants that promise most to be let out of their boxes, and all effects, most promising first.
    pub fn screen(&self, base: &Fitted, lines_hz: &[f64]) -> Vec<Screened> {
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
        let (parameters, effects): (Vec<Term>, Vec<Term>) =
            terms.into_iter().partition(|term| matches!(term, Term::Parameter(_)));
        let mut screened = screen(self.bench, base, &self.surroundings(signals, lines_hz), &effects);
        // A constant is in the fit already: it is let out of its box and fitted, if that promises most.
        let linear = Linearised::new(self.bench, base);
        let promised = parameters.into_iter().filter_map(|term| {
            let Term::Parameter(parameter) = term else { return None };
            let mut unknowns = composition.unknowns.iter();
            let index = unknowns.position(|own| own.slot == Slot::Nominal(parameter))?;
            let (gain, _, _) = linear.gain(&[base.columns[index].as_slice()], Held::Free, 1);
            Some(Screened {
                term,
                values: vec![composition.unknowns[index].value],
                gain: gain.likelihood,
                seen: None,
            })
        });
        let mut promised: Vec<Screened> = promised.collect();
        descending(&mut promised, |own| own.gain);
        promised.truncate(CONSTANTS);
        screened.splice(0..0, promised);
        screened
    }

    fn surroundings<'s>(&'s self, signals: &'s [Signals], lines_hz: &'s [f64]) -> Surroundings<'s> {
        Surroundings {
            model: self.model,
            signals,
            lines_hz,
            lattice: self.bench.plant.lattice,
            trials: &self.trials,
        }
    }

    /// A fit's composition with each of its terms that is looked for in several places where it promises most beside the others: what joined
    /// before they had may have come for what is theirs.
    pub fn sought_anew(&self, last: &Fitted) -> Vec<Composition> {
        let (bench, model) = (self.bench, self.model);
        let signals = signals(&bench.plant, &last.point.runs);
        let surroundings = self.surroundings(&signals, &[]);
        let composition = &last.point.composition;
        let mut terms = composition.terms();
        terms.retain(|term| surroundings.probes(*term).len() > 1);
        let moved = parallel::map(bench.threads, &terms, |term| {
            let without = bench.fit(&composition.without(*term, model), Some(last))?;
            let screened = screen(bench, &without, &surroundings, &[*term]).pop()?;
            let is_seen = screened.gain > PROMISES;
            is_seen.then(|| without.point.composition.with(*term, model, &screened.values))?
        });
        moved.into_iter().flatten().collect()
    }

    /// The most promising terms fitted beside a fit, lowest J first.
    pub fn fit_best(&mut self, base: &Fitted, screened: &[Screened], stage: usize) -> Vec<(Term, Fitted)> {
        let parameters = screened.iter().filter(|own| matches!(own.term, Term::Parameter(_)));
        let mut effects = screened
            .iter()
            .filter(|own| matches!(own.term, Term::Effect(_)) && own.gain > PROMISES);
        let (constants, first) = if self.depth == Depth::Look {
            (0, LOOKED_AT)
        } else {
            (CONSTANTS, FITTED)
        };
        let mut chosen: Vec<&Screened> = parameters.take(constants).chain(effects.by_ref().take(1)).collect();
        let mut fits: Vec<(Term, Fitted)> = Vec::new();
        for attempt in 0..=ATTEMPTS {
            if chosen.is_empty() {
                break;
            }
            let names: Vec<&str> = chosen.iter().map(|own| own.term.name()).collect();
            (self.progress)(&format!("fitting {}", names.join(", ")), 0.2 + 0.13 * stage as f64);
            let own = parallel::map(self.bench.threads, &chosen, |own| {
                let composition = base
                    .point
                    .composition
                    .with(own.term, self.model, &own.values)?
                    .inside(own.term);
                Some((own.term, self.bench.fit(&composition, Some(base))?))
            });
            // A size at the end of its range is no size, and a fit that gets stuck above where it came from tells nothing.
            let counts = |(term, fit): &(Term, Fitted)| {
                let composition = &fit.point.composition;
                let is_size = !at_a_bound(composition, *term) && !is_out_of_band(self.bench, composition, *term);
                fit.point.cost < base.point.cost && is_size
            };
            fits.extend(own.into_iter().flatten().filter(counts));
            if attempt > 0 && 2 * fits.len() >= first {
                break;
            }
            let gains = fits.iter().map(|(_, fit)| base.point.cost - fit.point.cost);
            let gained = gains.fold(0.0, f64::max);
            let size = if attempt == 0 { first - 1 } else { FITTED };
            let next = effects.by_ref().take(size);
            chosen = next.filter(|own| own.gain > OUTDONE * gained).collect();
        }
        sort(&mut fits);
        self.settle(base, &mut fits);
        fits
    }

    /// Rough fits end where a step gains next to nothing of what they have gained, which may be much: those that came near the best go to their
    /// ends before one is chosen.
    fn settle(&self, base: &Fitted, fits: &mut [(Term, Fitted)]) {
        let Some(least) = fits.first().map(|(_, fit)| fit.point.cost) else {
            return;
        };
        let near = NEAR * (base.point.cost - least);
        let count = fits.iter().filter(|(_, fit)| fit.point.cost - least < near).count();
        if count < 2 || self.depth == Depth::Look {
            return;
        }
        let settled = parallel::map(self.bench.threads, &fits[..count], |(_, fit)| {
            self.bench.fit(&fit.point.composition, None)
        });
        for ((_, fit), settled) in fits.iter_mut().zip(settled) {
            *fit = settled.unwrap_or_else(|| fit.clone());
        }
        sort(fits);
    }
}

/// The same with all constants as given, where what is missing has bent one of them: there an effect finds the room that they have taken.
pub(crate) fn unbent(bench: &Bench, composition: &Composition) -> Option<Composition> {
    let mut composition = composition.clone();
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
    Some(composition)
}

/// The one with the lowest J first.
pub(crate) fn sort(fits: &mut [(Term, Fitted)]) {
    ascending(fits, |(_, fit)| fit.point.cost);
}

/// A mode stands where the sampling ends: only its delay is left.
pub(crate) fn is_out_of_band(bench: &Bench, composition: &Composition, term: Term) -> bool {
    let ticks = bench.plant.runs.iter().filter_map(|run| run.tick_s);
    let ends_hz = ticks.map(|tick_s| 0.5 * IN_BAND / tick_s).fold(f64::INFINITY, f64::min);
    composition.unknowns.iter().any(|own| {
        let is_frequency = |kind: EffectKind, place: usize| kind.parameters()[place].screening == Screening::Band;
        matches!(own.slot, Slot::Effect(kind, place) if term == Term::Effect(kind) && is_frequency(kind, place) && own.value > ends_hz)
    })
}

/// An effect's fitted size stands at the far end of its range.
pub(crate) fn at_a_bound(composition: &Composition, term: Term) -> bool {
    let Term::Effect(kind) = term else { return false };
    composition.unknowns.iter().any(|own| {
        let spec = |place: usize| kind.parameters()[place];
        let is_size = |place: usize| spec(place).identity().is_some() && !spec(place).is_limit();
        let coordinate = &own.coordinate;
        let far = |bound: f64, identity: f64| bound != identity && (own.value - bound).abs() < 1e-3 * (bound - identity).abs();
        matches!(own.slot, Slot::Effect(of, place) if of == kind && is_size(place) && coordinate.lower < coordinate.upper
            && spec(place).identity().is_some_and(|zero| far(coordinate.lower, zero) || far(coordinate.upper, zero)))
    })
}

/// An effect's sizes are no larger than by what the record of the drive may be off.
pub(crate) fn is_doubtful(bench: &Bench, fit: &Fitted, term: Term) -> bool {
    let Term::Effect(kind) = term else { return false };
    let doubts = bench.doubt(fit);
    let unknowns = fit.point.composition.unknowns.iter().zip(doubts);
    let sizes: Vec<bool> = unknowns
        .filter_map(|(own, doubt)| match own.slot {
            Slot::Effect(of, place) if of == kind && !kind.parameters()[place].is_limit() => {
                let size = own.value - kind.parameters()[place].identity()?;
                Some(size.abs() < DOUBTED * doubt * own.coordinate.slope(own.value).abs())
            }
            _ => None,
        })
        .collect();
    !sizes.is_empty() && !sizes.contains(&false)
}

/// What an effect needs and neither model nor data have, in a sentence.
pub(crate) fn lacking(model: &ActuatorModel, signals: &[Signals], kind: EffectKind) -> Option<&'static str> {
    let timed = signals.iter().all(|run| run.tick_s.is_some());
    let warm = signals.iter().all(|run| run.temperature.is_some());
    if kind.needs_time() && !timed {
        Some("it needs time, which the data lack")
    } else if kind.needs_rod() && model.rod.is_none() {
        Some("it acts on a moving rod, which the model lacks")
    } else if kind.stage() == Stage::Hysteresis && model.material.law.is_some() {
        Some("it acts inside the domain wall law, and the model has another law")
    } else if kind.needs_coil(warm) && !model.coil {
        Some("its cause is a coil, which the model lacks")
    } else {
        None
    }
}
