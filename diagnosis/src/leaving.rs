//! What leaves again, and what would explain as well.

use anhyst_identify::order::ascending;
use anhyst_identify::parallel;

use crate::composition::Composition;
use crate::evidence::Evidence;
use crate::fitting::Fitted;
use crate::joining::{is_out_of_band, unbent};
use crate::likelihood::Point;
use crate::search::{JOINS, Search, values_of};
use crate::shares::{Gap, remainder_rms, without};
use crate::term::Term;
use crate::verdict::drifts;

/// A rough fit tells of so many times that fall that it is there.
const SURELY: f64 = 10.0;
/// Of what was fitted roughly, the best are fitted anew.
pub(crate) const REFITTED: usize = 2;
/// Terms that are tried in the place of each that joined.
const EXCHANGED: usize = 5;
/// Share of the gap below which an effect, or all of them, only make up for others.
const AGAINST: f64 = -0.5;
/// Fits whose evidence lies within this explain equally well.
pub(crate) const TIES: f64 = 12.0;

impl Search<'_> {
    /// Takes terms out, those that only make up for others, and then the one that is missed least, until the evidence would fall by what lets
    /// one join, and as plainly.
    pub fn without_those_that_earn_nothing(&self, mut last: Fitted) -> Option<Fitted> {
        let bench = self.bench;
        let gap = Gap::of(bench);
        loop {
            let terms = last.point.composition.terms();
            if terms.is_empty() {
                return Some(last);
            }
            let evidence = Evidence::new(bench, &last.point);
            let is_out = |term: &Term| is_out_of_band(bench, &last.point.composition, *term);
            // Where all is explained, one that works against the others does so in truth.
            let against = evidence.is_misfit.then(|| self.compensating(&last, &gap)).flatten();
            if let Some(term) = against.or_else(|| terms.iter().copied().find(is_out)) {
                last = bench.fit(&last.point.composition.without(term, self.model), None)?;
                continue;
            }
            let (own, model) = (evidence.cost(&last.point), self.model);
            let rough = parallel::map(bench.threads, &terms, |term| {
                bench.fit(&last.point.composition.without(*term, model), Some(&last))
            });
            let mut rough: Vec<(f64, Fitted)> = rough
                .into_iter()
                .flatten()
                .map(|fit| (evidence.cost(&fit.point) - own, fit))
                .collect();
            ascending(&mut rough, |(rise, _)| *rise);
            rough.retain(|(rise, _)| *rise < SURELY * JOINS);
            rough.truncate(REFITTED);
            // What is left of the output is larger with it: nothing is explained, however the bands are weighed.
            let grows = |without: &Point| remainder_rms(bench, without) < remainder_rms(bench, &last.point);
            // It must not earn what the others had not been fitted to yet.
            let fits = parallel::map(bench.threads, &rough, |(_, rough)| {
                let fit = bench.fit(&rough.point.composition, None)?;
                let unbent = unbent(bench, &fit.point.composition).and_then(|unbent| bench.fit(&unbent, None));
                let fits = std::iter::once(fit).chain(unbent);
                fits.min_by(|one, other| one.point.cost.total_cmp(&other.point.cost))
            });
            let falls = fits.into_iter().flatten().map(|fit| (evidence.cost(&fit.point), fit));
            match falls.min_by(|one, other| one.0.total_cmp(&other.0)) {
                Some((cost, fit))
                    if cost - own < self.spared(&last, &fit)
                        || !self.moves(&fit, &last)
                        || evidence.is_misfit && grows(&fit.point) =>
                {
                    last = fit;
                }
                _ => return Some(last),
            }
        }
    }

    /// By how much the evidence may fall where a term leaves: what a drift takes over, as large as an effect, only gets another name.
    pub fn spared(&self, last: &Fitted, without: &Fitted) -> f64 {
        let renamed = drifts(self.bench, without) && !drifts(self.bench, last);
        if renamed { 0.0 } else { JOINS }
    }

    /// The term that works most against the gap, by half of it and more, or where all together do: it makes up for what others or the constants explain
    /// too much.
    fn compensating(&self, last: &Fitted, gap: &Gap) -> Option<Term> {
        let bench = self.bench;
        let shares = last.point.composition.terms().into_iter().filter_map(|term| {
            let part = without(bench, &last.point, &last.point.composition.without(term, self.model))?;
            Some((gap.share(&part), term))
        });
        let shares: Vec<(f64, Term)> = shares.collect();
        let sum: f64 = shares.iter().map(|(share, _)| share).sum();
        let least = shares.into_iter().min_by(|(one, _), (other, _)| one.total_cmp(other));
        least
            .filter(|(share, _)| share.min(sum) < AGAINST)
            .map(|(_, term)| term)
    }

    /// Where a misfit is left, the best fit with a term that was tried in the place of one that joined, or with one elsewhere: what came
    /// first may have come for what others explain better together.
    pub fn exchanged(&mut self, last: &Fitted, tried: &[Fitted]) -> Option<Fitted> {
        let (bench, model) = (self.bench, self.model);
        let composition = &last.point.composition;
        let terms = composition.terms();
        if terms.is_empty() || !Evidence::new(bench, &last.point).is_misfit {
            return None;
        }
        (self.progress)("one in the place of another", 0.88);
        let mut tried: Vec<&Fitted> = tried.iter().collect();
        ascending(&mut tried, |fit| fit.point.cost);
        let mut others: Vec<(Term, Vec<f64>)> = Vec::new();
        for fit in &tried {
            for term in fit.point.composition.terms() {
                if !terms.contains(&term) && others.iter().all(|(own, _)| *own != term) {
                    others.push((term, values_of(&fit.point.composition, term)));
                }
            }
        }
        others.truncate(EXCHANGED);
        let pairs = terms
            .iter()
            .flat_map(|own| others.iter().map(move |other| (*own, other)));
        let swapped =
            pairs.filter_map(|(own, (other, values))| composition.without(own, model).with(*other, model, values));
        // What was tried with just these terms did not win.
        let is_new = |own: &Composition| {
            let same = |fit: &&Fitted| {
                let other = &fit.point.composition;
                let (own_terms, terms) = (own.terms(), other.terms());
                own.low_passes == other.low_passes
                    && own_terms.len() == terms.len()
                    && own_terms.iter().all(|term| terms.contains(term))
            };
            !tried.iter().any(same)
        };
        let mut swapped: Vec<Composition> = swapped.filter(is_new).collect();
        swapped.extend(self.sought_anew(last));
        let fits = parallel::map(bench.threads, &swapped, |swapped| bench.fit(swapped, Some(last)));
        let best = fits
            .into_iter()
            .flatten()
            .min_by(|one, other| one.point.cost.total_cmp(&other.point.cost))?;
        let best = bench.fit(&best.point.composition, None)?;
        (best.point.cost + TIES < last.point.cost).then_some(best)
    }

    /// The last fit with one term in the place of another, where it explains as well.
    pub fn ties(&mut self, last: &Fitted, found: &[(Term, Fitted)]) -> Vec<Fitted> {
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
