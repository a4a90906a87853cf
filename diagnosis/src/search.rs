//! What a search works on, and what its stages have in common.

use anhyst_model::ActuatorModel;

use crate::acquisition::LowPass;
use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::memory::Recent;
use crate::statistics::rms;
use crate::term::Term;
use crate::unknown::Slot;

/// Fall of J with which a term joins: e³⁰ to one.
pub(crate) const JOINS: f64 = 30.0;
/// Answers to trials are not kept where the spectra are longer: a hundred of this length are 160 MB.
const MAX_KEPT: usize = 200_000;
/// Beside others a term must move the residual of some band by this share of what is left of it: no law is so exact.
const MOVES: f64 = 0.4;

/// How far a search goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Depth {
    Whole,
    /// One term joins, of the two that promise most: a look at a form of the recorder's low pass.
    Look,
    /// Until what has joined lets the noise show a low pass of the output, of which none is known.
    UntilSeen,
    /// The low pass may have another form: no further than to the first term if that leaves a misfit.
    UntilMisfit,
}

/// Changes of the spectra by trials of terms, as sharp as they can be or round.
pub(crate) type Trials = Recent<(Term, bool, Vec<f64>), Vec<f64>>;

/// What the search is told.
pub(crate) struct Search<'a> {
    pub bench: &'a Bench,
    pub model: &'a ActuatorModel,
    /// Of the recorder.
    pub low_passes: Vec<(ChannelKind, LowPass)>,
    pub depth: Depth,
    /// Of this run: beside what joined a trial answers nearly as before, and only what promises something is simulated again.
    pub trials: Trials,
    pub progress: &'a mut dyn FnMut(&str, f64),
}

impl<'a> Search<'a> {
    /// Without any low pass of the recorder, and thorough.
    pub fn new(bench: &'a Bench, progress: &'a mut dyn FnMut(&str, f64)) -> Self {
        Search {
            bench,
            model: &bench.plant.model,
            low_passes: Vec::new(),
            depth: Depth::Whole,
            trials: Recent::new(0),
            progress,
        }
    }

    /// Forgets the answers to trials, which others than the present low passes let through.
    pub fn begin(&mut self) {
        let kept = self.bench.plant.length() <= MAX_KEPT;
        self.trials = Recent::new(if kept { usize::MAX } else { 0 });
    }

    /// A term is the only one, or moves the residual of some band by more than a share of what is left of it.
    pub fn moves(&self, before: &Fitted, after: &Fitted) -> bool {
        let is_only = before.point.composition.terms().is_empty();
        is_only
            || self.bench.bands.iter().any(|band| {
                let (old, new) = (&before.point.residual, &after.point.residual);
                let moved = rms(band.iter().map(|place| old[*place] - new[*place]));
                moved > MOVES * rms(band.iter().map(|place| new[*place]))
            })
    }
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
        Term::Effect(kind) => {
            let fitted = kind.parameters().iter().enumerate().filter(|(_, own)| own.is_fitted());
            fitted.filter_map(|(place, _)| of(Slot::Effect(kind, place))).collect()
        }
    }
}
