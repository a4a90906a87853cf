//! The search under the recorder's low passes, which show in the noise or, where a gap hides that, in the motion that passes them.
//!
//! 1. A low pass shows in the noise of what the model as given leaves, or beneath what was found.
//! 2. Where it does not, one is supposed, as long as it makes a difference to what was found, and beneath a coarse lattice, which hides it, as long as it
//!    explains as much with fewer terms.
//! 3. The noise tells its form roughly, the motion better: a misfit is searched again under each likely form, first with what explains most
//!    alone, then with what was found.
//!    What a term of the answer comes late by may be what a higher order delays by more: each order is tried without it.
//! 4. So is what was found at all: under a wrong form a term may stand for what the right one does, and what is taken for the noise of a gap
//!    may show another form than the noise beneath it. A misfit is tried under every order that delays alike.
//! 5. Under the form that explains most, what was tried may take the place of what joined (`decompose.rs`).

use anhyst_identify::parallel;

use crate::acquisition::{FROM, Likely, LowPass, ORDERS};
use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::decomposition::{Decomposition, cost};
use crate::evidence::{Evidence, LACK_OF_FIT, noise_rms};
use crate::fitting::Fitted;
use crate::leaving::REFITTED;
use crate::likelihood::{Bench, Point};
use crate::linearised::Linearised;
use crate::search::{Depth, JOINS, Search, values_of};
use crate::shares::{Gap, remainder_rms};
use crate::term::Term;
use crate::verdict::{MIN_BELIEVED, believed};

/// Forms that are searched with beyond the likeliest.
const MAX_FORMS: usize = 3;
/// Forms that are looked at where the first leaves a misfit.
const MAX_LOOKS: usize = 5;
/// Corners of a low pass that is supposed, as shares of the sampling rate.
const SUPPOSED: [f64; 3] = [0.1, 0.18, 0.32];

/// Corners within this share are the same: a fit from one comes to the other.
const SAME_CORNER: f64 = 0.03;

/// What the noise shows of each channel.
type Seen = Vec<(ChannelKind, Likely)>;
/// One low pass for each channel.
type Forms = Vec<(ChannelKind, LowPass)>;

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
    let found = search.without_those_of_form(found)?;
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

/// What is seen of each channel, or was before where it is not.
fn with_those_of(mut before: Seen, seen: Seen) -> Seen {
    before.retain(|(kind, _)| seen.iter().all(|(other, _)| other != kind));
    before.extend(seen);
    before
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

fn of_output(seen: &[(ChannelKind, Likely)]) -> bool {
    seen.iter().any(|(kind, _)| *kind == ChannelKind::Output)
}

fn likeliest(seen: &[(ChannelKind, Likely)]) -> Forms {
    seen.iter().map(|(kind, own)| (*kind, own[0].1)).collect()
}

/// Low passes in what a point leaves of field and output, from a share of the sampling rate on. What a fitted model leaves of the output is its own
/// error, whose spectrum falls without any filter.
fn seen(bench: &Bench, point: &Point, from: f64) -> Seen {
    let kinds = [ChannelKind::Field, ChannelKind::Output].into_iter();
    kinds
        .filter_map(|kind| Some((kind, seen_of(kind, bench, point, from)?)))
        .collect()
}

/// The same of one channel.
fn seen_of(kind: ChannelKind, bench: &Bench, point: &Point, from: f64) -> Option<Likely> {
    let is_noise = kind == ChannelKind::Field || !bench.plant.fitted;
    let channel = bench.plant.channels.iter().find(|own| own.kind == kind && is_noise)?;
    let tick_s = bench.plant.runs[channel.run].tick_s?;
    let residual = &point.residual[channel.places.clone()];
    let is_asked = |(own, share): &(Vec<f64>, f64)| *share == from && own == residual;
    let answer = || {
        let lattice = bench.plant.lattice.filter(|_| kind == ChannelKind::Output);
        let steps = lattice.filter(|_| !bench.plant.is_quantised(&point.composition));
        Some(LowPass::seen(
            &bench.left(point, channel),
            tick_s,
            channel.resolution,
            from,
            steps.unwrap_or(0.0),
        ))
    };
    let seen = bench
        .plant
        .memory
        .seen
        .get(is_asked, || (residual.to_vec(), from), answer)?;
    (!seen.is_empty()).then(|| seen.to_vec())
}

/// What a point leaves of the output shows one.
pub(crate) fn shows_in_output(bench: &Bench, point: &Point, from: f64) -> bool {
    seen_of(ChannelKind::Output, bench, point, from).is_some()
}

/// Low passes that the noise shows once something is explained.
fn seen_beneath(bench: &Bench, found: &Decomposition) -> Seen {
    let last = &found.last.point;
    // The error of coarse steps is no noise.
    let is_coarse = last.composition.terms().into_iter().any(Term::is_lattice);
    let points = [Some(last), (!is_coarse).then_some(&found.base.point)];
    let looks = points
        .into_iter()
        .flatten()
        .flat_map(|point| FROM.map(|from| (point, from)));
    let mut shown = looks.filter(|(point, from)| shows_in_output(bench, point, *from));
    shown
        .next()
        .map_or_else(Vec::new, |(point, from)| seen(bench, point, from))
}

/// The decomposition with a low pass of the output that no noise shows, and what it was held against.
fn with_supposed(
    bench: &Bench,
    seen: &[(ChannelKind, Likely)],
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

/// A low pass of the output, or of both channels, that no noise shows because the gap or a lattice hides it: that with which the constants explain most,
/// beside those that are `known`; none where it makes no difference to what was `found`, unless it is `always` to be had.
fn supposed(bench: &Bench, known: &Forms, found: &Decomposition, always: bool) -> Option<Forms> {
    let (_, channel) = bench.plant.outputs().next()?;
    let tick_s = bench.plant.runs[channel.run].tick_s?;
    let ladder = SUPPOSED.map(|share| LowPass {
        order: 4,
        corner_hz: share / tick_s,
        is_circuit: true,
        is_supposed: true,
        is_shared: false,
    });
    let of = |low_pass: LowPass| (ChannelKind::Output, low_pass);
    // What is before one converter is likely before all.
    let others = known.iter().flat_map(|(_, own)| [own.shared(), own.supposed()]);
    let mut all: Vec<Forms> = ladder.into_iter().chain(others).map(|own| vec![of(own)]).collect();
    let mut kinds = bench.plant.channels.iter().map(|own| own.kind);
    if known.is_empty() && kinds.any(|kind| kind == ChannelKind::Field) {
        all.extend(ladder.map(|own| vec![of(own), (ChannelKind::Field, own.shared())]));
    }
    let (base, linear) = (&found.base.point, Linearised::new(bench, &found.base));
    let tried = parallel::map(bench.threads, &all, |forms| {
        let with = base.composition.clone().with_low_passes(forms);
        Some((linear.gain_of(&bench.change(base, &with)?).likelihood, with))
    });
    let gained = tried.into_iter().flatten();
    let (_, best) = gained.max_by(|(one, _), (other, _)| one.total_cmp(other))?;
    let best = bench.fit(&best, None)?;
    let fitted = best.point.composition.fitted_low_passes();
    let beside = |fit: &Fitted| bench.fit(&fit.point.composition.clone().with_low_passes(&fitted), Some(fit));
    let differs = |with: &Point, without: &Point| {
        let evidence = Evidence::new(bench, with);
        evidence.cost(without) - evidence.cost(with) > JOINS
    };
    let last = &found.last;
    // What explains nearly all would not explain it without a low pass that matters.
    let lacks = remainder_rms(bench, &last.point) > LACK_OF_FIT * noise_rms(bench, &last.point);
    let matters = always
        || lacks && differs(&best.point, &found.base.point)
        || beside(last).is_some_and(|own| differs(&own.point, &last.point));
    matters.then_some(fitted)
}

/// The best decomposition under low passes that are likely.
fn under(
    bench: &mut Bench,
    seen: &[(ChannelKind, Likely)],
    watches: bool,
    progress: &mut dyn FnMut(&str, f64),
) -> Option<Decomposition> {
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

/// Low passes of another order, of those that the noise allows, that explain as much without what a term comes late by: each order delays otherwise, and
/// what it lacks another term makes up for.
fn instead_of_lags(search: &Search<'_>, found: &Decomposition, seen: &[(ChannelKind, Likely)]) -> Option<Forms> {
    let (bench, composition) = (search.bench, &found.last.point.composition);
    let own = composition.fitted_low_pass(ChannelKind::Output)?;
    let (_, channel) = bench.plant.outputs().next()?;
    let tick_s = bench.plant.runs[channel.run].tick_s?;
    let shown = seen.iter().find(|(kind, _)| *kind == ChannelKind::Output);
    let is_likely = |order: &u32| {
        shown.is_none_or(|(_, seen)| {
            let mut seen = seen.iter();
            seen.any(|(_, like)| like.is_supposed || like.order == *order && like.is_circuit == own.is_circuit)
        })
    };
    let has_field = bench.plant.channels.iter().any(|own| own.kind == ChannelKind::Field);
    let lags = composition.terms().into_iter().filter_map(|term| {
        let lag_s = *values_of(composition, term).first().filter(|_| term.is_lag())?;
        Some((term, lag_s))
    });
    let others = lags.flat_map(|(term, lag_s)| {
        let orders = ORDERS.into_iter().filter(is_likely);
        let delayed = orders.map(move |order| own.of_order(order).delayed(lag_s, tick_s).supposed());
        delayed.flat_map(move |low_pass| {
            let alone = vec![(ChannelKind::Output, low_pass)];
            let both = has_field.then(|| vec![alone[0], (ChannelKind::Field, low_pass.shared())]);
            std::iter::once(alone).chain(both).map(move |forms| (term, forms))
        })
    });
    let tried: Vec<(Term, Forms)> = others.collect();
    let points = parallel::map(bench.threads, &tried, |(term, forms)| {
        let without = composition.without(*term, search.model).without_low_passes();
        bench.point(&without.with_low_passes(forms))
    });
    let mut points: Vec<(Point, &Forms)> = points
        .into_iter()
        .zip(&tried)
        .filter_map(|(point, (_, forms))| Some((point?, forms)))
        .collect();
    points.sort_by(|(one, _), (other, _)| one.cost.total_cmp(&other.cost));
    points.truncate(REFITTED);
    let fits = parallel::map(bench.threads, &points, |(point, _)| bench.fit(&point.composition, None));
    let fits = fits
        .into_iter()
        .zip(&points)
        .filter_map(|(fit, (_, forms))| Some((fit?, *forms)));
    let (best, forms) = fits.min_by(|(one, _), (other, _)| one.point.cost.total_cmp(&other.point.cost))?;
    (best.point.cost < found.last.point.cost + JOINS).then(|| forms.clone())
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

/// Low passes of other orders that delay as the output's does, on the output and on both channels: where the noise beneath a gap is not seen, the motion
/// tells the order.
fn other_orders(bench: &Bench, found: &Decomposition) -> Vec<(f64, Forms)> {
    let composition = &found.last.point.composition;
    let Some(own) = composition.fitted_low_pass(ChannelKind::Output) else {
        return Vec::new();
    };
    let channels = &bench.plant.channels;
    let kinds = [ChannelKind::Output, ChannelKind::Field];
    let has = |kind: &ChannelKind| channels.iter().any(|channel| channel.kind == *kind);
    let kinds: Vec<ChannelKind> = kinds.into_iter().filter(has).collect();
    let orders = ORDERS.into_iter().map(|order| own.of_order(order).supposed());
    let forms = orders.flat_map(|low_pass| {
        let with = |other: Option<LowPass>| {
            let all = kinds.iter().zip([Some(low_pass), other]);
            (0.0, all.filter_map(|(kind, own)| Some((*kind, own?))).collect())
        };
        let others = [None, Some(low_pass.shared()), Some(low_pass)];
        others
            .into_iter()
            .take(2 * kinds.len() - 1)
            .map(with)
            .collect::<Vec<_>>()
    });
    forms.collect()
}

/// A fit from one comes to the other.
fn alike(forms: &Forms, others: &Forms) -> bool {
    let alike = |((kind, own), (other_kind, other)): (&(ChannelKind, LowPass), &(ChannelKind, LowPass))| {
        let corner_hz = other.corner_hz;
        let moved = LowPass { corner_hz, ..*own };
        kind == other_kind && moved == *other && (own.corner_hz / corner_hz).ln().abs() < SAME_CORNER
    };
    forms.len() == others.len() && forms.iter().zip(others).all(alike)
}

/// The likeliest low pass of each channel, then each other one of each with the likeliest of the others, and how unlikely that is; and one that is
/// seen on one channel on the other, too: what is before one converter is likely before all.
fn alternatives(bench: &Bench, seen: &[(ChannelKind, Likely)]) -> Vec<(f64, Forms)> {
    let likeliest = likeliest(seen);
    let mut all = vec![(0.0, likeliest.clone())];
    for (index, (kind, seen)) in seen.iter().enumerate() {
        for (unlikely, low_pass) in &seen[1..] {
            let mut other = likeliest.clone();
            other[index] = (*kind, *low_pass);
            all.push((*unlikely, other));
        }
    }
    if let [(one, forms), (other, others)] = seen {
        // Alike on both channels it is one.
        for (unlikely, own) in forms {
            let like = |(_, like): &&(f64, LowPass)| alike(&vec![(*other, *own)], &vec![(*other, *like)]);
            if let Some((more, _)) = others.iter().find(like) {
                all.push((unlikely + more, vec![(*one, *own), (*other, own.shared())]));
            }
        }
    }
    if let [(seen, forms)] = seen {
        let mut unseen = bench.plant.channels.iter().map(|own| own.kind);
        if let Some(kind) = unseen.find(|own| own != seen && *own != ChannelKind::Magnetization) {
            let both = |(unlikely, own): &(f64, LowPass)| {
                [own.shared(), own.supposed()].map(|other| (*unlikely, vec![(*seen, *own), (kind, other)]))
            };
            all.extend(forms.iter().flat_map(both));
        }
    }
    all
}
