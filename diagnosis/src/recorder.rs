//! The search under the recorder's low passes, which show in the noise or, where a gap hides that, in the motion that passes them.
//!
//! 1. A low pass shows in the noise of what the model as given leaves, or beneath what was found.
//! 2. Where it does not, one is supposed, as long as it makes a difference to what was found, and beneath a coarse lattice, which hides it, as long as it
//!    explains as much with fewer terms.
//! 3. The noise tells its form roughly, the motion better: a misfit is searched again under each likely form, first with what explains most
//!    alone, then with what was found.
//! 4. So is what was found at all: under a wrong form a term may stand for what the right one does, and what is taken for the noise of a gap
//!    may show another form than the noise beneath it. A misfit is tried under every order that delays alike.
//!    What a term comes late by may be what a higher order delays by more: each order is tried without it.
//! 5. Under the form that explains most, what was tried may take the place of what joined (`decompose.rs`).

use crate::acquisition::FROM;
use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::decomposition::{Decomposition, cost};
use crate::evidence::Evidence;
use crate::fitting::Fitted;
use crate::joining::unbent;
use crate::leaving::REFITTED;
use crate::likelihood::Bench;
use crate::linearised::Linearised;
use crate::low_passes::{
    Forms, Seen, alike, alternatives, instead_of_lags, likeliest, of_output, other_orders, seen, seen_beneath,
    shows_in_output, supposed, with_those_of,
};
use crate::search::{Depth, JOINS, Search};
use crate::shares::{Gap, remainder_rms};
use crate::verdict::{MIN_BELIEVED, believed};

/// Forms that are searched with beyond the likeliest.
const MAX_FORMS: usize = 3;
/// Forms that are looked at where the first leaves a misfit.
const MAX_LOOKS: usize = 5;

/// The decomposition under the low passes that explain most; `bench` is left as it was found on.
pub(crate) fn decomposed(bench: &mut Bench, progress: &mut dyn FnMut(&str, f64)) -> Option<Decomposition> {
    let nominal = bench.point(&Composition::default())?;
    let seen = seen(bench, &nominal, FROM[0]);
    let watches = !of_output(&seen) && !bench.plant.fitted;
    let mut found = under(bench, &seen, watches, progress)?;
    if watches {
        // A large gap hides what noise there is: it is seen once the gap is explained, or some of it.
        let mut again = seen_beneath(bench, &found);
        // A coarse lattice hides it for good, and what is named beside that may be what comes late by it.
        let hides = bench.plant.lattice.is_some() && terms(&found) > 1;
        if !of_output(&again)
            && (hides || is_misfit(bench, &found))
            && let Some((aside, other)) = with_supposed(bench, &seen, &found, hides, progress)
        {
            // And some of it may be the low pass itself.
            again = seen_beneath(&aside, &other);
            let needed = if terms(&other) < terms(&found) { 0.0 } else { JOINS };
            if !of_output(&again) && gain(&found, &aside, &other) > needed {
                (*bench, found) = (aside, other);
            }
        }
        if of_output(&again) {
            found = under(bench, &with_those_of(seen, again), false, progress)?;
        }
    }
    let mut search = Search::new(bench, progress);
    let found = search.with_exchanges(found);
    let mut found = search.without_those_of_form(found)?;
    // Constants that were bent before an effect had joined need not have come back.
    let fit = unbent(bench, &found.last.point.composition).and_then(|unbent| bench.fit(&unbent, None));
    if let Some(fit) = fit.filter(|fit| fit.point.cost < found.last.point.cost) {
        found.last = fit;
    }
    Some(explaining(bench, found))
}

/// Names with which more is left than the model as given leaves explain nothing, and without any name nothing is missing only where that
/// is believed.
fn explaining(bench: &Bench, mut found: Decomposition) -> Decomposition {
    let last = &found.last.point;
    let explains = if terms(&found) == 0 {
        found.nameless || believed(&found, &Evidence::new(bench, last)) >= MIN_BELIEVED
    } else {
        Gap::of(bench).explained(bench, last) > 0.0
    };
    if !explains {
        if !found.nameless {
            found.unlisted.clear();
        }
        found.last = found.base.clone();
        found.ties.clear();
        found.nameless = true;
    }
    found
}

/// By how much the other decomposition explains more, on its own bench. Coarse steps leave a few rows that are on another step than their own: so many
/// numbers are independent, not all.
fn gain(found: &Decomposition, bench: &Bench, other: &Decomposition) -> f64 {
    let point = bench.point(&found.last.point.composition);
    let own = point.map_or(f64::NEG_INFINITY, |point| point.cost);
    let left = remainder_rms(bench, &other.last.point);
    let independent = bench.plant.lattice.map_or(1.0, |step| (left / step).powi(2).min(1.0));
    independent * (own - other.last.point.cost) - JOINS * (terms(other) as f64 - terms(found) as f64)
}

fn terms(found: &Decomposition) -> usize {
    found.last.point.composition.terms().len()
}

fn is_misfit(bench: &Bench, found: &Decomposition) -> bool {
    Evidence::new(bench, &found.last.point).is_misfit
}

/// The decomposition with a low pass of the output that no noise shows, and what it was held against.
fn with_supposed(
    bench: &Bench,
    seen: &Seen,
    found: &Decomposition,
    always: bool,
    progress: &mut dyn FnMut(&str, f64),
) -> Option<(Bench, Decomposition)> {
    let mut aside = Bench::new(bench.plant.clone(), bench.threads);
    progress("a low pass that no noise shows", 0.9);
    let forms = supposed(bench, &likeliest(seen), found, always)?;
    let likely: Seen = forms.into_iter().map(|(kind, own)| (kind, vec![(0.0, own)])).collect();
    let found = under(&mut aside, &likely, false, progress)?;
    Some((aside, found))
}

/// The best decomposition under low passes that are likely.
fn under(bench: &mut Bench, seen: &Seen, watches: bool, progress: &mut dyn FnMut(&str, f64)) -> Option<Decomposition> {
    let memories = seen.iter().map(|(_, seen)| seen[0].1.memory_s());
    if let Some(memory_s) = memories.reduce(f64::max) {
        // What it was fed before the first row is not known.
        *bench = Bench::new(bench.plant.skipping(memory_s), bench.threads);
    }
    let mut all = alternatives(bench, seen);
    let mut search = Search::new(bench, progress);
    search.low_passes.clone_from(&all[0].1);
    search.depth = match &all[..] {
        _ if watches => Depth::UntilSeen,
        [_] => Depth::Whole,
        _ => Depth::UntilMisfit,
    };
    let mut best = Best {
        found: search.run()?,
        unlikely: 0.0,
    };
    if watches && shows_in_output(bench, &best.found.last.point, FROM[0]) {
        return Some(best.found);
    }
    if is_misfit(bench, &best.found) && all.len() > 1 {
        // What is found under a wrong form stands in the way of the right one: a look at each with what explains most beside it.
        search.depth = Depth::Look;
        let mut likeliest: Option<(f64, f64, Forms)> = None;
        for (unlikely, forms) in all[1..].iter().take(MAX_LOOKS) {
            search.low_passes.clone_from(forms);
            let Some(look) = search.run() else { continue };
            let own = cost(&look.last) + unlikely;
            if likeliest.as_ref().is_none_or(|(least, _, _)| own < *least) {
                likeliest = Some((own, *unlikely, forms.clone()));
            }
            if !is_misfit(bench, &look) {
                break;
            }
        }
        search.depth = Depth::Whole;
        let likeliest = likeliest.filter(|(likeliest, _, _)| watches || *likeliest < best.cost());
        let (unlikely, forms) = likeliest.map_or((0.0, all[0].1.clone()), |(_, unlikely, forms)| (unlikely, forms));
        search.low_passes = forms;
        if watches {
            best.or(search.run(), unlikely);
        } else {
            // The first was not searched to its end.
            best = Best {
                found: search.run()?,
                unlikely,
            };
        }
    }
    search.depth = Depth::Whole;
    for _ in 0..MAX_FORMS {
        // Another form that explains better with what was found, or without some of it, is searched with from the start: under a wrong form a
        // term may stand for what the right one does.
        if best.found.last.point.composition.terms().is_empty() && !is_misfit(bench, &best.found) {
            break;
        }
        // What is taken for the noise of a gap may show another than the noise beneath it.
        let beneath = self::seen(bench, &best.found.last.point, FROM[0]);
        let mut others: Vec<(f64, Forms)> = Vec::new();
        if !watches && of_output(&beneath) {
            others.extend(alternatives(bench, &with_those_of(seen.to_vec(), beneath)));
        }
        // So may the motion where it moves the corner as far as the noise lets it, or no noise shows any.
        let composition = &best.found.last.point.composition;
        let own = composition.fitted_low_pass(ChannelKind::Output);
        let is_open = own.is_some_and(|own| own.is_supposed) || composition.presses_corner();
        if !watches && (is_open || is_misfit(bench, &best.found)) {
            others.extend(other_orders(bench, &best.found));
        }
        for other in others {
            if all.iter().all(|(_, own)| !alike(own, &other.1)) {
                all.push(other);
            }
        }
        let Some(rival) = best.rival(&mut search, &all).filter(|own| own.cost < best.cost()) else {
            break;
        };
        search.low_passes.clone_from(rival.forms);
        if !best.or(search.run(), rival.unlikely) {
            break;
        }
    }
    if !watches && let Some(forms) = instead_of_lags(&search, &best.found, seen) {
        search.low_passes = forms;
        if let Some(found) = search.run() {
            let fewer = terms(&best.found) as f64 - terms(&found) as f64;
            if cost(&found.last) - best.cost() < JOINS * fewer {
                best = Best { found, unlikely: 0.0 };
            }
        }
    }
    Some(best.found)
}

/// The decomposition that explains most, and how unlikely its forms are beside the likeliest.
struct Best {
    found: Decomposition,
    unlikely: f64,
}

impl Best {
    fn cost(&self) -> f64 {
        cost(&self.found.last) + self.unlikely
    }

    /// Gives way to another that explains more.
    fn or(&mut self, other: Option<Decomposition>, unlikely: f64) -> bool {
        let Some(found) = other.filter(|other| cost(&other.last) + unlikely < self.cost()) else {
            return false;
        };
        *self = Best { found, unlikely };
        true
    }

    /// Of the other forms the one that explains most with the terms that were found, or with none: they may stand for what it does.
    fn rival<'f>(&self, search: &mut Search<'_>, all: &'f [(f64, Forms)]) -> Option<Rival<'f>> {
        (search.progress)("other low passes of the recorder", 0.92);
        let search = &*search;
        let (last, base) = (&self.found.last, &self.found.base);
        let mut rivals = beside(search, last, all);
        if !last.point.composition.terms().is_empty() {
            rivals.extend(beside(search, base, all));
        }
        rivals.into_iter().min_by(|one, other| one.cost.total_cmp(&other.cost))
    }
}

/// Other forms, how unlikely they are beside the likeliest, and what they cost with that in.
struct Rival<'f> {
    cost: f64,
    unlikely: f64,
    forms: &'f Forms,
}

/// The other forms that explain most beside the terms of a fit.
fn beside<'f>(search: &Search<'_>, fit: &Fitted, all: &'f [(f64, Forms)]) -> Vec<Rival<'f>> {
    let others = all.iter().filter(|(_, forms)| *forms != search.low_passes);
    let linear = Linearised::new(search.bench, fit);
    let rough = others.filter_map(|(unlikely, forms)| {
        let composition = fit.point.composition.without_low_passes().with_low_passes(forms);
        let change = search.bench.change(&fit.point, &composition)?;
        let gain = linear.gain_of(&change).likelihood - unlikely;
        Some((gain, *unlikely, forms, composition))
    });
    let mut rough: Vec<_> = rough.collect();
    rough.sort_by(|one, other| other.0.total_cmp(&one.0));
    rough.truncate(REFITTED);
    let rivals = rough.into_iter().filter_map(|(_, unlikely, forms, composition)| {
        let fit = search.bench.fit(&composition, None)?;
        let fit = search.without_those_that_earn_nothing(fit)?;
        Some(Rival {
            cost: cost(&fit) + unlikely,
            unlikely,
            forms,
        })
    });
    rivals.collect()
}
