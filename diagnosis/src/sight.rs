//! What could have been seen: the smallest size of each term that these data would have shown, and terms they cannot show.
//!
//! With D the answer of the spectra to a trial of size s, the fall of J expected at another size grows as its square: `SEEN` needs
//! s √(2 SEEN/Σ D²/S), S the levels that are left. A limit is judged at the levels tried. A term is *not excited* if even its largest
//! plausible size stays below that.

use anhyst_model::{ActuatorModel, EffectKind};
use serde::{Deserialize, Serialize};

use crate::decomposition::Decomposition;
use crate::joining::lacking;
use crate::screening::{Screened, Seen};
use crate::signals::Signals;
use crate::term::Term;

/// Fall of J that is seen for sure: what joins, and a normal deviate of 1.3 above it.
const SEEN: f64 = 40.0;
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
pub(crate) fn sight(
    model: &ActuatorModel,
    found: &Decomposition,
    signals: &[Signals],
) -> (Vec<Detectable>, Vec<NotExcited>) {
    let (mut seen, mut unseen) = (Vec::new(), Vec::new());
    for screened in &found.screened {
        // Frequencies come from the residual and lattices from its size: neither is a matter of excitation.
        if screened.term.is_line() || screened.term.is_lattice() || screened.seen.is_none() {
            continue;
        }
        match smallest(model, screened) {
            Some(found) => seen.push(found),
            None => unseen.push(NotExcited {
                term: screened.term,
                reason: quiet_reason(screened.term),
            }),
        }
    }
    for kind in EffectKind::ALL {
        if let Some(reason) = lacking(model, signals, kind) {
            unseen.push(NotExcited {
                term: Term::Effect(kind),
                reason: reason.to_owned(),
            });
        }
    }
    (seen, unseen)
}

fn smallest(model: &ActuatorModel, screened: &Screened) -> Option<Detectable> {
    let specs = screened.term.specs(model)?;
    let Seen {
        place,
        trial,
        is_ratio,
        energy,
    } = screened.seen?;
    let factor = (2.0 * SEEN / energy).sqrt();
    let smallest = if is_ratio {
        (factor < 1.0).then_some(trial)?
    } else {
        let range = specs[place].upper - specs[place].lower;
        (factor < PLAUSIBLE && factor * trial.abs() < range).then_some(factor * trial.abs())?
    };
    Some(Detectable {
        term: screened.term,
        quantity: specs[place].name.to_owned(),
        unit: model.material.unit_of(specs[place].unit),
        smallest,
    })
}

fn quiet_reason(term: Term) -> String {
    if term.is_limit() {
        "the signal does not reach any limit that would show above the noise".to_owned()
    } else {
        "even its largest plausible size moves the outputs by less than the noise hides".to_owned()
    }
}
