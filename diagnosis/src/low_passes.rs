//! Low passes that the recorder may have: those that the noise shows, and those that the motion needs where none is seen.

use anhyst_identify::order::ascending;
use anhyst_identify::parallel;

use crate::acquisition::{FROM, Likely, LowPass, ORDERS};
use crate::channel::ChannelKind;
use crate::decomposition::Decomposition;
use crate::evidence::{Evidence, LACK_OF_FIT, noise_rms};
use crate::fitting::Fitted;
use crate::leaving::REFITTED;
use crate::likelihood::{Bench, Point};
use crate::linearised::Linearised;
use crate::search::{JOINS, Search, values_of};
use crate::shares::remainder_rms;
use crate::term::Term;

/// Corners of a low pass that is supposed, as shares of the sampling rate.
const SUPPOSED: [f64; 3] = [0.1, 0.18, 0.32];
/// Corners within this share are the same: a fit from one comes to the other.
const SAME_CORNER: f64 = 0.05;

/// What the noise shows of each channel.
pub(crate) type Seen = Vec<(ChannelKind, Likely)>;
/// One low pass for each channel.
pub(crate) type Forms = Vec<(ChannelKind, LowPass)>;

/// Low passes in what a point leaves of field and output, from a share of the sampling rate on. What a fitted model leaves of the output is its own
/// error, whose spectrum falls without any filter.
pub(crate) fn seen(bench: &Bench, point: &Point, from: f64) -> Seen {
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
pub(crate) fn seen_beneath(bench: &Bench, found: &Decomposition) -> Seen {
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

pub(crate) fn of_output(seen: &[(ChannelKind, Likely)]) -> bool {
    seen.iter().any(|(kind, _)| *kind == ChannelKind::Output)
}

pub(crate) fn likeliest(seen: &[(ChannelKind, Likely)]) -> Forms {
    seen.iter().map(|(kind, own)| (*kind, own[0].1)).collect()
}

/// What is seen of each channel, or was before where it is not.
pub(crate) fn with_those_of(mut before: Seen, seen: Seen) -> Seen {
    before.retain(|(kind, _)| seen.iter().all(|(other, _)| other != kind));
    before.extend(seen);
    before
}

/// A low pass of the output, or of both channels, that no noise shows because the gap or a lattice hides it: that with which the constants explain most,
/// beside those that are `known`; none where it makes no difference to what was `found`, unless it is `always` to be had.
pub(crate) fn supposed(bench: &Bench, known: &Forms, found: &Decomposition, always: bool) -> Option<Forms> {
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
    if !fitted.iter().all(|(_, own)| own.is_in_band(tick_s)) {
        return None;
    }
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

/// Low passes of another order, of those that the noise allows, that explain as much without what a term comes late by: each order delays otherwise, and
/// what it lacks another term makes up for.
pub(crate) fn instead_of_lags(
    search: &Search<'_>,
    found: &Decomposition,
    seen: &[(ChannelKind, Likely)],
) -> Option<Forms> {
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
    ascending(&mut points, |(point, _)| point.cost);
    points.truncate(REFITTED);
    let fits = parallel::map(bench.threads, &points, |(point, _)| bench.fit(&point.composition, None));
    let fits = fits
        .into_iter()
        .zip(&points)
        .filter_map(|(fit, (_, forms))| Some((fit?, *forms)));
    let (best, forms) = fits.min_by(|(one, _), (other, _)| one.point.cost.total_cmp(&other.point.cost))?;
    (best.point.cost < found.last.point.cost + JOINS).then(|| forms.clone())
}

/// Low passes of other orders that delay as the output's does, on the output and on both channels: where the noise beneath a gap is not seen, the motion
/// tells the order.
pub(crate) fn other_orders(bench: &Bench, found: &Decomposition) -> Vec<(f64, Forms)> {
    let composition = &found.last.point.composition;
    let Some(own) = composition.fitted_low_pass(ChannelKind::Output) else {
        return Vec::new();
    };
    let channels = &bench.plant.channels;
    let kinds = [ChannelKind::Output, ChannelKind::Field];
    let has = |kind: &ChannelKind| channels.iter().any(|channel| channel.kind == *kind);
    let kinds: Vec<ChannelKind> = kinds.into_iter().filter(has).collect();
    let ticks = bench.plant.outputs().next();
    let tick_s = ticks.and_then(|(_, channel)| bench.plant.runs[channel.run].tick_s);
    let orders = ORDERS.into_iter().map(|order| own.of_order(order).supposed());
    let orders = orders.filter(|own| tick_s.is_none_or(|tick_s| own.is_in_band(tick_s)));
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

/// The likeliest low pass of each channel, then each other one of each with the likeliest of the others, and how unlikely that is; and one that is
/// seen on one channel on the other, too: what is before one converter is likely before all.
pub(crate) fn alternatives(bench: &Bench, seen: &[(ChannelKind, Likely)]) -> Vec<(f64, Forms)> {
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

/// A fit from one comes to the other.
pub(crate) fn alike(forms: &Forms, others: &Forms) -> bool {
    let alike = |((kind, own), (other_kind, other)): (&(ChannelKind, LowPass), &(ChannelKind, LowPass))| {
        let corner_hz = other.corner_hz;
        let moved = LowPass { corner_hz, ..*own };
        kind == other_kind && moved == *other && (own.corner_hz / corner_hz).ln().abs() < SAME_CORNER
    };
    forms.len() == others.len() && forms.iter().zip(others).all(alike)
}
