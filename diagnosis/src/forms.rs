//! What leaves because another law of the same kind as what stays would explain it.
//!
//! A library holds one law of each kind. Others are distributions of its constants: diffusion one of lags, creep like log t one of times, a round
//! play one of widths, Dahl's friction one of speeds; a limit holds or not. So each of several terms is held against the others with their constants
//! doubled and halved as linear columns beside them, multiples 0 ± 1; and no law is believed to better than a share of what it does: what is left
//! counts only above (0.03 c)², c what the others do in each band, and above all that a quantisation does. What these explain as well is no
//! effect of its own, and stays in what is left. Where either of two would explain the other, they tie.

use anhyst_identify::order::ascending;
use anhyst_identify::parallel;
use anhyst_model::{ActuatorModel, EffectKind};

use crate::decomposition::Decomposition;
use crate::evidence::Evidence;
use crate::fitting::Fitted;
use crate::likelihood::{Bench, Point};
use crate::linearised::{Held, Linearised};
use crate::search::Search;
use crate::term::Term;
use crate::unknown::Slot;

/// What a constant is multiplied by.
const RATIOS: [f64; 2] = [0.5, 2.0];
/// Rounds in which levels and multiples settle on each other.
const ROUNDS: usize = 4;
/// Share of what a law does that another form of it may do otherwise; noise makes of a quantisation what no law foretells.
const DOUBT: f64 = 0.03;
const DITHERED: f64 = 1.0;

impl Search<'_> {
    /// The same without terms that other forms of the rest explain as well.
    pub fn without_those_of_form(&mut self, mut found: Decomposition) -> Option<Decomposition> {
        (self.progress)("other laws of the same kinds", 0.92);
        loop {
            let mut fits = self.without_one_of_form(&found.last).into_iter();
            let Some(fit) = fits.next() else {
                return Some(found);
            };
            found.last = self.without_those_that_earn_nothing(fit)?;
            found.ties = fits.collect();
        }
    }

    /// Fits without a term that forms of the rest explain as well, the best first.
    fn without_one_of_form(&self, last: &Fitted) -> Vec<Fitted> {
        let (bench, model) = (self.bench, self.model);
        let terms = last.point.composition.terms();
        if terms.len() < 2 {
            return Vec::new();
        }
        let evidence = Evidence::new(bench, &last.point);
        let fits = parallel::map(bench.threads, &terms, |term| {
            let rough = bench.fit(&last.point.composition.without(*term, model), Some(last))?;
            let fit = bench.fit(&rough.point.composition, None)?;
            let linear = Linearised::new(bench, &fit);
            let doubts = doubts(bench, model, &fit)?;
            let seen = |levels: &[f64]| {
                let raised: Vec<f64> = levels.iter().zip(&doubts).map(|(own, doubt)| own.max(*doubt)).collect();
                evidence.cost_of(&raised)
            };
            let whole = |point: &Point| seen(&point.levels) + point.cost - bench.cost(&point.levels);
            let own = whole(&last.point);
            let cost = |forms: &[Vec<f64>]| {
                let (gain, multiples, levels) = linear.gain(forms, Held::Unit, ROUNDS);
                let priors = fit.point.cost - gain.likelihood - bench.cost(&levels);
                let believed = multiples.iter().map(|own| 0.5 * own * own).sum::<f64>();
                seen(&levels) + priors + believed
            };
            // Beyond what the fit's own columns promise, which may stand at a bound.
            let explained = (cost(&[]) - cost(&forms(bench, &fit))).max(0.0);
            Some((whole(&fit.point) - explained - own, fit))
        });
        let leaves = |(rise, fit): &(f64, Fitted)| *rise < self.spared(last, fit);
        let mut fits: Vec<(f64, Fitted)> = fits.into_iter().flatten().filter(leaves).collect();
        ascending(&mut fits, |(rise, _)| *rise);
        fits.into_iter().map(|(_, fit)| fit).collect()
    }
}

/// Variance in each band of what the terms of a fit may be wrong by.
fn doubts(bench: &Bench, model: &ActuatorModel, fit: &Fitted) -> Option<Vec<f64>> {
    let mut doubts = vec![0.0; bench.bands.len()];
    for term in fit.point.composition.terms() {
        let change = bench.change(&fit.point, &fit.point.composition.without(term, model))?;
        let share = if term == Term::Effect(EffectKind::Quantisation) {
            DITHERED
        } else {
            DOUBT
        };
        for (own, band) in doubts.iter_mut().zip(&bench.bands) {
            let energy: f64 = band.iter().map(|place| change[*place] * change[*place]).sum();
            *own += share * share * energy / band.len() as f64;
        }
    }
    Some(doubts)
}

/// What changes where a constant of an effect is doubled or halved.
fn forms(bench: &Bench, fit: &Fitted) -> Vec<Vec<f64>> {
    let composition = &fit.point.composition;
    let moved = composition.unknowns.iter().enumerate().flat_map(|(index, own)| {
        RATIOS.into_iter().filter_map(move |ratio| {
            let (value, coordinate) = (ratio * own.value, &own.coordinate);
            let Slot::Effect(kind, place) = own.slot else {
                return None;
            };
            let is_inside = (coordinate.lower..=coordinate.upper).contains(&value);
            if kind.parameters()[place].is_limit() || own.value == 0.0 || !is_inside {
                return None;
            }
            let mut moved = composition.clone();
            moved.unknowns[index].value = value;
            bench.change(&fit.point, &moved)
        })
    });
    moved.collect()
}
