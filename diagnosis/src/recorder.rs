//! The search under the recorder's low passes, which show in the noise or, where a gap hides that, in the motion that passes them.
//!
//! 1. A low pass shows in the noise of what the model as given leaves, or beneath what was found.
//! 2. Where it does not, one is supposed, as long as it makes a difference to what was found, and beneath a coarse lattice, which hides it, as long as it
//!    explains as much with fewer terms.
//! 3. The noise tells its form roughly, the motion better: a misfit is searched again under each likely form and those to which they lead, first with
//!    what explains most alone (a look), then whole, then with what was found. A form with which the constants alone explain nearly all comes first.
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
use crate::leaving::{REFITTED, TIES};
use crate::likelihood::Bench;
use crate::linearised::Linearised;
use crate::low_passes::{
    Forms, Seen, alike, alternatives, instead_of_lags, likeliest, of_output, other_orders, seen, seen_beneath,
    shows_in_output, supposed, with_those_of,
};
use crate::search::{Depth, JOINS, Search};
use crate::shares::{Gap, remainder_rms};
use crate::verdict::{MIN_BELIEVED, believed};
use anhyst_identify::order::descending;

/// Forms that are searched with beyond the likeliest.
const MAX_FORMS: usize = 3;
/// Forms that are looked at where the first leaves a misfit.
const MAX_LOOKS: usize = 5;
/// Share of what is above the noise that another form must explain: with less it is not what is missing.
const PART: f64 = 0.02;
/// Share of it with which, by the constants alone, a form is the right one.
const NEARLY_ALL: f64 = 0.9;
/// A form is fitted that promises this share of what it must explain: fits were seen to find 2.5 times what was promised.
const PROMISED: f64 = 0.25;

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

/// What is left above the noise, in J.
fn missing(bench: &Bench, found: &Decomposition) -> f64 {
    let last = &found.last.point;
    Evidence::new(bench, last).to_noise(&last.levels)
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
    let bench = &*bench;
    let mut walk = Walk {
        all: alternatives(bench, seen),
        search: Search::new(bench, progress),
        seen,
        watches,
    };
    if !watches {
        walk.begin_with_the_right_one();
    }
    let depth = if watches { Depth::UntilSeen } else { Depth::UntilMisfit };
    let first = walk.all[0].clone();
    let mut best = walk.searched(depth, &first)?;
    if watches && shows_in_output(bench, &best.found.last.point, FROM[0]) {
        return Some(best.found);
    }
    if is_misfit(bench, &best.found) && (!watches || walk.all.len() > 1) {
        let forms = walk.worth_a_look(&best.found);
        let (whole, first) = if watches {
            (Some(best), None)
        } else {
            (None, Some(best))
        };
        let look = walk.looked(first, &forms);
        let form = look.as_ref().map(|look| (look.unlikely, look.forms()));
        let found = form.and_then(|form| walk.searched(Depth::Whole, &form));
        // What was looked at was not searched to its end.
        best = match whole {
            Some(whole) => whole.or(found),
            None => found.or(look)?,
        };
    }
    best = walk.bettered(Depth::Whole, best);
    if !watches && let Some(forms) = instead_of_lags(&walk.search, &best.found, seen) {
        let other = walk.searched(Depth::Whole, &(0.0, forms));
        let is_simpler = |other: &Best| {
            let fewer = terms(&best.found) as f64 - terms(&other.found) as f64;
            cost(&other.found.last) - best.cost() < JOINS * fewer
        };
        if let Some(other) = other.filter(is_simpler) {
            best = other;
        }
    }
    Some(best.found)
}

/// A search under one form of the low passes after another.
struct Walk<'a> {
    search: Search<'a>,
    seen: &'a Seen,
    /// No low pass of the output is known.
    watches: bool,
    /// How unlikely each is beside the likeliest.
    all: Vec<(f64, Forms)>,
}

impl Walk<'_> {
    fn searched(&mut self, depth: Depth, (unlikely, forms): &(f64, Forms)) -> Option<Best> {
        self.search.depth = depth;
        self.search.low_passes.clone_from(forms);
        Some(Best {
            found: self.search.run()?,
            unlikely: *unlikely,
        })
    }

    /// A form with which the constants alone explain nearly all comes first: a search under a wrong one takes longer than all this.
    fn begin_with_the_right_one(&mut self) {
        if self.all.len() < 2 {
            return;
        }
        let (unlikely, likeliest) = self.all[0].clone();
        self.search.low_passes = likeliest;
        let Some((base, _)) = self.search.base() else { return };
        let missing = Evidence::new(self.search.bench, &base.point).to_noise(&base.point.levels);
        let must = NEARLY_ALL * missing - unlikely;
        let rivals = self.beside(&base, must);
        let right = rivals.into_iter().find(|own| own.cost < cost(&base) - must);
        let place = right.and_then(|own| self.all.iter().position(|form| *form == own.form));
        self.all.swap(0, place.unwrap_or(0));
    }

    /// The likeliest other forms, but those that would leave twice what is missing, which no effect makes up for.
    fn worth_a_look(&self, found: &Decomposition) -> Vec<(f64, Forms)> {
        let missing = missing(self.search.bench, found);
        let promising = self.promising(&found.last);
        let is_hopeful =
            |form: &&(f64, Forms)| promising.iter().any(|(gain, own, _)| *own == *form && *gain > -missing);
        let others = self.all.iter().filter(is_hopeful);
        others.take(MAX_LOOKS).cloned().collect()
    }

    /// What is found under a wrong form stands in the way of the right one: the best of a look at each with what explains most beside it, and at those
    /// to which these lead.
    fn looked(&mut self, first: Option<Best>, forms: &[(f64, Forms)]) -> Option<Best> {
        let mut best = first;
        for form in forms {
            let Some(look) = self.searched(Depth::Look, form) else {
                continue;
            };
            let is_right = !is_misfit(self.search.bench, &look.found);
            best = Some(match best {
                Some(best) => best.or(Some(look)),
                None => look,
            });
            if is_right {
                break;
            }
        }
        best.map(|best| {
            if self.watches {
                best
            } else {
                self.bettered(Depth::Look, best)
            }
        })
    }

    /// Another form that explains better with what was found, or without some of it, is searched with from the start: under a wrong form a term may
    /// stand for what the right one does.
    fn bettered(&mut self, depth: Depth, mut best: Best) -> Best {
        let bench = self.search.bench;
        self.search.low_passes = best.forms();
        for _ in 0..MAX_FORMS {
            if terms(&best.found) == 0 && !is_misfit(bench, &best.found) {
                break;
            }
            if !self.watches {
                self.widen(&best.found);
            }
            let least = TIES.max(PART * missing(bench, &best.found));
            let Some(rival) = self.rival(&best.found, best.cost() - least) else {
                break;
            };
            let (before, other) = (best.cost(), self.searched(depth, &rival.form));
            best = best.or(other);
            if best.cost() == before {
                break;
            }
        }
        best
    }

    /// Takes in what else the low passes may be by what was found.
    fn widen(&mut self, found: &Decomposition) {
        let (bench, last) = (self.search.bench, &found.last.point);
        let mut others: Vec<(f64, Forms)> = Vec::new();
        // What is taken for the noise of a gap may show another than the noise beneath it.
        let beneath = seen(bench, last, FROM[0]);
        if of_output(&beneath) {
            others.extend(alternatives(bench, &with_those_of(self.seen.clone(), beneath)));
        }
        // So may the motion where it moves the corner as far as the noise lets it, or no noise shows any.
        let own = last.composition.fitted_low_pass(ChannelKind::Output);
        let is_open = own.is_some_and(|own| own.is_supposed) || last.composition.presses_corner();
        if is_open || is_misfit(bench, found) {
            others.extend(other_orders(bench, found));
        }
        for other in others {
            if self.all.iter().all(|(_, own)| !alike(own, &other.1)) {
                self.all.push(other);
            }
        }
    }

    /// Of the other forms the one that explains most with the terms that were found, or with none: they may stand for what it does. J must be below.
    fn rival(&mut self, found: &Decomposition, below: f64) -> Option<Rival> {
        (self.search.progress)("other low passes of the recorder", 0.92);
        let mut rivals = self.beside(&found.last, cost(&found.last) - below);
        if terms(found) > 0 {
            rivals.extend(self.beside(&found.base, cost(&found.base) - below));
        }
        rivals
            .into_iter()
            .filter(|own| own.cost < below)
            .min_by(|one, other| one.cost.total_cmp(&other.cost))
    }

    /// The other forms, and by how much more they promise to explain beside the terms of a fit, most promising first.
    fn promising(&self, fit: &Fitted) -> Vec<(f64, &(f64, Forms), Composition)> {
        let search = &self.search;
        let composition = &fit.point.composition;
        let others = self.all.iter().filter(|(_, forms)| *forms != composition.low_passes);
        let linear = Linearised::new(search.bench, fit);
        let rough = others.filter_map(|form| {
            let with = composition.without_low_passes().with_low_passes(&form.1);
            let change = search.bench.change(&fit.point, &with)?;
            let gain = linear.gain_of(&change).likelihood - form.0;
            Some((gain, form, with))
        });
        let mut rough: Vec<_> = rough.collect();
        descending(&mut rough, |own| own.0);
        rough
    }

    /// The other forms that explain most beside the terms of a fit, of those that promise a part of what they must explain.
    fn beside(&self, fit: &Fitted, must: f64) -> Vec<Rival> {
        let search = &self.search;
        let mut rough = self.promising(fit);
        rough.retain(|(gain, _, _)| *gain > PROMISED * must);
        rough.truncate(REFITTED);
        let rivals = rough.into_iter().filter_map(|(_, form, composition)| {
            let fit = search.bench.fit(&composition, None)?;
            let fit = search.without_those_that_earn_nothing(fit)?;
            Some(Rival {
                cost: cost(&fit) + form.0,
                form: form.clone(),
            })
        });
        rivals.collect()
    }
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

    fn forms(&self) -> Forms {
        self.found.last.point.composition.low_passes.clone()
    }

    /// The other where it explains more.
    fn or(self, other: Option<Best>) -> Best {
        match other {
            Some(other) if other.cost() < self.cost() => other,
            _ => self,
        }
    }
}

/// Another form with what it costs with that in.
struct Rival {
    cost: f64,
    form: (f64, Forms),
}
