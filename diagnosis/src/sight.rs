//! What could have been seen: the smallest size of each term that these data would have shown, and terms they cannot show.
//!
//! With d the answer of the whitened outputs to a term at size s (over the training rows), the expected fall of χ² at another
//! size grows as the square: a fall of `SEEN` (a false alarm of 1e-6, found nine times in ten) needs s·√(SEEN/|d|²). Terms of
//! limits are judged at the levels tried. A term is *not excited* if even its largest plausible size stays below that.

use anhyst_model::{ActuatorModel, EffectKind, NominalParameter, Stage};
use serde::{Deserialize, Serialize};

use anhyst_identify::engine::dot;

use crate::probes::Surroundings;
use crate::screening::Screened;
use crate::search::Found;
use crate::select::lacking;
use crate::system::Signals;
use crate::term::Term;
use crate::workbench::Workbench;

/// Fall of χ² that is seen for sure: a normal deviate of 4.9 for the threshold and 1.3 above it.
const SEEN: f64 = 38.0;
/// Largest plausible size, in smallest interesting ones.
const PLAUSIBLE: f64 = 1e4;

/// The smallest size of a term that would have been seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detectable {
    pub term: Term,
    /// Of which number.
    pub quantity: String,
    pub unit: String,
    /// For a limit: the highest that bites hard enough.
    pub smallest: f64,
}

/// A term that the data cannot show, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotExcited {
    pub term: Term,
    pub reason: String,
}

/// What these data would have shown, and what they could not.
pub(crate) fn sight(bench: &Workbench, found: &Found) -> (Vec<Detectable>, Vec<NotExcited>) {
    let (mut seen, mut unseen) = (Vec::new(), Vec::new());
    let signals = &found.nominal.signals;
    let residuals: Vec<Vec<f64>> = Vec::new();
    let surroundings = Surroundings {
        model: bench.model,
        signals,
        residuals: &residuals,
        lattice: None,
    };
    for screened in &found.library {
        // Frequencies come from the residual and lattices from its size: neither is a matter of excitation.
        if screened.term.is_line() || screened.term.is_lattice() {
            continue;
        }
        match smallest(bench, &surroundings, screened) {
            Some(found) => seen.push(found),
            None => unseen.push(NotExcited {
                term: screened.term,
                reason: quiet_reason(screened.term),
            }),
        }
    }
    unseen.extend(absent(bench.model, found));
    (seen, unseen)
}

fn smallest(bench: &Workbench, surroundings: &Surroundings, screened: &Screened) -> Option<Detectable> {
    let training = &bench.observation.training;
    let specs = screened.term.specs(bench.model)?;
    let mut best: Option<Detectable> = None;
    let groups = surroundings.probes(screened.term);
    for (group, directions) in groups.iter().zip(&screened.directions) {
        let Some(((place, trial), direction)) = group.sizes.first().zip(directions.first()) else {
            continue;
        };
        let answer: Vec<f64> = direction.iter().map(|z| f64::from(*z)).collect();
        let size = dot(training, &answer, &answer);
        let (smallest, better): (f64, fn(f64, f64) -> bool) = if specs[*place].is_fitted_by_ratio() {
            if size < SEEN {
                continue;
            }
            (*trial, |new, old| new > old)
        } else {
            let change = trial - group.absent[*place];
            let factor = (SEEN / size).sqrt();
            let range = specs[*place].upper - specs[*place].lower;
            if factor > PLAUSIBLE || factor * change.abs() > range {
                continue;
            }
            ((factor * change).abs(), |new, old| new < old)
        };
        if best.as_ref().is_none_or(|own| better(smallest, own.smallest)) {
            best = Some(Detectable {
                term: screened.term,
                quantity: specs[*place].name.to_owned(),
                unit: specs[*place].unit.to_owned(),
                smallest,
            });
        }
    }
    best
}

fn quiet_reason(term: Term) -> String {
    if term.is_limit() {
        "the signal does not reach any limit that would show above the noise".to_owned()
    } else {
        "even its largest plausible size moves the outputs by less than the noise hides".to_owned()
    }
}

/// Terms that were not tried, and what the data or the model lack for them.
fn absent(model: &ActuatorModel, found: &Found) -> Vec<NotExcited> {
    let tried = |term: Term| found.library.iter().any(|own| own.term == term);
    let all = EffectKind::ALL.into_iter().map(Term::Effect);
    let all = all.chain(NominalParameter::ALL.into_iter().map(Term::Parameter));
    all.filter(|term| !tried(*term))
        .map(|term| NotExcited {
            term,
            reason: reason(model, term, &found.nominal.signals).to_owned(),
        })
        .collect()
}

fn reason(model: &ActuatorModel, term: Term, signals: &[Signals]) -> &'static str {
    let Term::Effect(kind) = term else {
        return "the model has no such part";
    };
    lacking(model, signals, kind).unwrap_or(if kind.stage() == Stage::Amplifier {
        "it acts between command and coil field, and the data hold no command"
    } else {
        "no trial of it moves the outputs"
    })
}
