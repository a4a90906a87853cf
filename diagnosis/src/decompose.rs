//! measured = simulated(constants, effects) + nuisance + what is left: effects join one by one (`joining.rs`), each fitted with all that is in.
//!
//! 1. The nominal chain with its constants, starts and linear nuisance is fitted under the low passes of `recorder.rs`; lines are sought in what
//!    it leaves.
//! 2. Every term is screened beside it, the best few that can compete with the best are fitted, and the one with the lowest J joins if J falls
//!    by more than `JOINS` and the residual moves by more than a share of what is left. Until nothing joins.
//! 3. Those that only make up for others are taken out (`leaving.rs`), and then the one that is missed least, as long as the evidence
//!    (`evidence.rs`) falls by less than `JOINS`.
//! 4. A free curve that gained far more than all that joined after it, or leaves no misfit and gained more, has no name, and they go. What is no
//!    larger than the record of the drive may be off by does not join.
//! 5. Terms that were tried take the place of one that joined, or that one another place, where that explains more: what joins first may be
//!    what several others imitate.
//! 6. What another law of the same kind as the rest explains leaves (`forms.rs`).
//! 7. What leaves more than the model as given is no answer (`recorder.rs`).

use anhyst_identify::parallel;

use crate::acquisition::FROM;
use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::decomposition::{Decomposition, cost};
use crate::evidence::{Evidence, noise_rms};
use crate::fitting::Fitted;
use crate::joining::{at_a_bound, is_doubtful, is_out_of_band, sort, unbent};
use crate::leaving::TIES;
use crate::likelihood::Point;
use crate::lines::lines;
use crate::low_passes::shows_in_output;
use crate::screening::Screened;
use crate::search::{Depth, JOINS, Search};
use crate::term::Term;
use crate::unknown::{Slot, Unknown};
use crate::unlisted::{Unlisted, unlisted};

const MAX_TERMS: usize = 5;
const MAX_EXCHANGES: usize = 2;
/// A free curve must gain this much more than the best of the library, and this factor.
const NAMELESS: (f64, f64) = (60.0, 1.25);
/// First magnetizations that are tried, A/m per saturation.
const STARTS: [f64; 12] = [
    -0.4, -0.26, -0.18, -0.11, -0.06, -0.02, 0.02, 0.06, 0.11, 0.18, 0.26, 0.4,
];
/// Of another law so many each way, each so many times the next, and then these ratios to the best.
const LAW_STARTS: i32 = 24;
const LAW_RATIO: f64 = 1.2;
const CLOSER: [f64; 6] = [0.87, 0.91, 0.95, 1.05, 1.1, 1.15];
/// Where another law may have turned round before, of the ends of its input's extent, and how often that and the start are bettered.
const TURNS: [f64; 8] = [0.12, 0.25, 0.37, 0.5, 0.62, 0.75, 0.87, 1.0];
const TURN_ROUNDS: usize = 2;
const MAX_LINES: usize = 8;
/// A line that is not the mains' is a disturbance of the plant from this multiple of the noise on, and nuisance below: the
/// output alone does not tell which.
const LOUD: f64 = 3.0;

/// A free curve gains so much more than the library that what is missing has no name.
fn beats(free: f64, gain: f64) -> bool {
    free > gain + NAMELESS.0 && free > NAMELESS.1 * gain
}

/// What was come across on the way.
#[derive(Default)]
struct Gathered {
    tried: Vec<Fitted>,
    /// Fits that explain as well as the one whose term joined.
    ties: Vec<(Term, Fitted)>,
    unlisted: Vec<Unlisted>,
    nameless: bool,
    /// The first screening.
    screened: Option<Vec<Screened>>,
}

impl Search<'_> {
    pub fn run(&mut self) -> Option<Decomposition> {
        let bench = self.bench;
        (self.progress)("the model as given", 0.0);
        self.begin();
        let nominal = bench.point(&Composition::default())?;
        let (base, off_mains) = self.base()?;
        let mut gathered = Gathered::default();
        let last = self.joined(base.clone(), off_mains, &mut gathered)?;
        let ties = self.ties(&last, &gathered.ties);
        Some(Decomposition {
            nominal,
            base,
            last,
            ties,
            tried: gathered.tried,
            unlisted: gathered.unlisted,
            nameless: gathered.nameless,
            screened: gathered.screened.unwrap_or_default(),
        })
    }

    /// The same where what was tried has taken the place of what joined, as long as that explains more.
    pub fn with_exchanges(&mut self, mut found: Decomposition) -> Decomposition {
        for _ in 0..MAX_EXCHANGES {
            let Some(mut other) = self.exchanged(&found.last, &found.tried) else {
                break;
            };
            let mut gathered = Gathered::default();
            let off_mains = self.lines(&mut other);
            let other = off_mains.and_then(|off_mains| self.joined(other, off_mains, &mut gathered));
            found.tried.append(&mut gathered.tried);
            let Some(other) = other.filter(|other| cost(other) < cost(&found.last)) else {
                break;
            };
            found.ties = self.ties(&other, &gathered.ties);
            (found.last, found.unlisted, found.nameless) = (other, gathered.unlisted, gathered.nameless);
        }
        found
    }

    /// Terms join until none is worth it, and those that earn nothing leave.
    fn joined(&mut self, mut base: Fitted, mut off_mains: Vec<f64>, gathered: &mut Gathered) -> Option<Fitted> {
        let bench = self.bench;
        let mut course: Vec<Point> = Vec::new();
        // Where a free curve beat what could join, what it gained, and whether that is all.
        let mut nameless: Option<(Fitted, f64, bool)> = None;
        // What the constants drive out of its range.
        let mut refused: Vec<Term> = Vec::new();
        for stage in base.point.composition.terms().len()..=MAX_TERMS {
            if stage == 1 && self.depth == Depth::Look {
                return Some(base);
            }
            (self.progress)("screening", 0.15 + 0.13 * stage as f64);
            let screened = self.screen(&base, &off_mains);
            let mut fits = self.fit_best(&base, &screened, stage);
            fits.retain(|(term, _)| !refused.contains(term));
            gathered.screened.get_or_insert(screened);
            let at_noise = fits
                .first()
                .is_some_and(|(_, fit)| !Evidence::new(bench, &fit.point).is_misfit);
            let is_open = stage == 0 && !at_noise && self.depth != Depth::Look;
            let other = is_open.then(|| unbent(bench, &base.point.composition)).flatten();
            // Once the constants move with it, the best may set them right.
            let best = other.as_ref().and(fits.first());
            let polished = best
                .and_then(|(_, fit)| bench.fit(&fit.point.composition, None))
                .filter(|fit| unbent(bench, &fit.point.composition).is_none());
            if let Some(other) = other.filter(|_| polished.is_none()) {
                let unbent = bench.unfitted(&other)?;
                (self.progress)("screening", 0.15);
                let screened = self.screen(&unbent, &off_mains);
                fits.extend(self.fit_best(&unbent, &screened, stage));
                fits.retain(|(_, fit)| fit.point.cost < base.point.cost);
                sort(&mut fits);
                let mut seen: Vec<Term> = Vec::new();
                fits.retain(|(term, _)| {
                    !seen.contains(term) && {
                        seen.push(*term);
                        true
                    }
                });
            }
            (self.progress)("curves without a name", 0.27 + 0.13 * stage as f64);
            gathered.tried.extend(fits.iter().map(|(_, fit)| fit.clone()));
            let best = polished.as_ref().or(fits.first().map(|(_, fit)| fit));
            let gain = best.map_or(0.0, |fit| base.point.cost - fit.point.cost);
            let joins = |best: &Fitted| gain >= JOINS && self.moves(&base, best) && stage < MAX_TERMS;
            let is_last = !best.is_some_and(joins);
            // What the best leaves above the noise is all that a curve could gain beyond it.
            let may_beat = |best: &Fitted| {
                beats(
                    gain + Evidence::new(bench, &best.point).to_noise(&best.point.levels),
                    gain,
                )
            };
            let is_sought = is_last || !bench.plant.fitted && best.is_some_and(may_beat);
            gathered.unlisted = if is_sought { unlisted(bench, &base) } else { Vec::new() };
            // Beside a fitted model's own error a curve proves nothing.
            let free = gathered
                .unlisted
                .first()
                .filter(|own| !bench.plant.fitted && beats(own.gain, gain));
            if let Some(free) = free {
                // Several terms together may explain more, and must where it explains all.
                nameless.get_or_insert((base.clone(), free.gain, !free.is_misfit));
            }
            let Some((term, best)) = fits.first().filter(|_| !is_last) else {
                break;
            };
            let evidence = Evidence::new(bench, &best.point);
            let least = evidence.cost(&best.point);
            let as_well = fits[1..]
                .iter()
                .filter(|(_, fit)| evidence.cost(&fit.point) - least < TIES);
            gathered.ties.extend(as_well.map(|(_, fit)| (*term, fit.clone())));
            (self.progress)(
                &format!("fitting {} and the constants", term.name()),
                0.27 + 0.13 * stage as f64,
            );
            let polished = polished.or_else(|| bench.fit(&best.point.composition, None));
            let Some(polished) = polished.map(|fit| self.restarted(fit)) else {
                break;
            };
            let composition = &polished.point.composition;
            let is_no_size = at_a_bound(composition, *term) && Evidence::new(bench, &polished.point).is_misfit;
            if is_no_size || is_out_of_band(bench, composition, *term) {
                gathered.ties.retain(|(own, _)| own != term);
                refused.push(*term);
                continue;
            }
            if is_doubtful(bench, &polished, *term) {
                gathered
                    .tried
                    .retain(|fit| !fit.point.composition.terms().contains(term));
                break;
            }
            course.push(std::mem::replace(&mut base, polished).point);
            off_mains = self.lines(&mut base)?;
            let is_enough = match self.depth {
                Depth::UntilSeen => shows_in_output(bench, &base.point, FROM[0]),
                Depth::UntilMisfit => course.len() == 1 && Evidence::new(bench, &base.point).is_misfit,
                Depth::Whole | Depth::Look => false,
            };
            if is_enough {
                gathered.ties.clear();
                return Some(base);
            }
            // Two that together leave the misfit as it was will leave again.
            let evidence = Evidence::new(bench, &base.point);
            let before = course.len().checked_sub(2).map(|own| evidence.cost(&course[own]));
            if before.is_some_and(|before| before - evidence.cost(&base.point) < JOINS) {
                break;
            }
        }
        // What shows a low pass only now is searched anew.
        if self.depth == Depth::UntilSeen && shows_in_output(bench, &base.point, FROM[1]) {
            gathered.ties.clear();
            return Some(base);
        }
        (self.progress)("taking each out again", 0.85);
        let last = self.without_those_that_earn_nothing(base)?;
        let beaten = nameless.filter(|(from, free, is_all)| {
            let gain = cost(from) - cost(&last);
            beats(*free, gain) || *is_all && *free > gain + NAMELESS.0
        });
        gathered.nameless = beaten.is_some();
        beaten.map_or(Some(last), |(from, _, _)| self.without_those_that_earn_nothing(from))
    }

    /// Where a misfit is left, the same from another first magnetization that explains more: what has joined may have moved it. Plays forget it.
    fn restarted(&self, fit: Fitted) -> Fitted {
        if self.model.material.law.is_some() || !Evidence::new(self.bench, &fit.point).is_misfit {
            return fit;
        }
        let own = &fit.point.composition;
        let other = self.started(own.clone(), &self.runs_in_time());
        let other = other.filter(|other| other != own);
        match other.and_then(|other| self.bench.fit(&other, None)) {
            Some(other) if other.point.cost < fit.point.cost => other,
            _ => fit,
        }
    }

    /// Runs whose rows are a time course.
    fn runs_in_time(&self) -> Vec<usize> {
        let runs = self.bench.plant.runs.iter().enumerate();
        let in_time = runs.filter(|(_, run)| run.tick_s.is_some());
        in_time.map(|(index, _)| index).collect()
    }

    /// Constants, starts, the recorder's low pass and lines.
    pub fn base(&mut self) -> Option<(Fitted, Vec<f64>)> {
        let bench = self.bench;
        let starts = self.runs_in_time();
        let plant = &bench.plant;
        let composition = Composition::nominal(self.model, &starts, plant.fitted, plant.shape_drift_a_per_m);
        let composition = composition.with_low_passes(&self.low_passes);
        (self.progress)("where the material was at the first row", 0.03);
        let composition = self.started(composition, &starts)?;
        (self.progress)("calibrating the constants", 0.06);
        let mut base = bench.fit(&composition, None)?;
        let off_mains = self.lines(&mut base)?;
        Some((base, off_mains))
    }

    /// A composition from the best of some first magnetizations, run by run.
    fn started(&self, mut composition: Composition, starts: &[usize]) -> Option<Composition> {
        let bench = self.bench;
        let size = self.model.material.start_scale();
        let mut least = bench.point(&composition)?;
        let shares = self.starts();
        for run in starts {
            let mut look = |slot: Slot, values: Vec<f64>| {
                let looked_for = |own: &&mut Unknown| own.slot == slot;
                let others = values.into_iter().map(|value| {
                    let mut tried = composition.clone();
                    if let Some(own) = tried.unknowns.iter_mut().find(looked_for) {
                        own.value = value;
                    }
                    tried
                });
                let others: Vec<Composition> = others.collect();
                let points = parallel::map(bench.threads, &others, |tried| bench.point(tried));
                for point in points.into_iter().flatten() {
                    if point.cost < least.cost {
                        composition = point.composition.clone();
                        least = point;
                    }
                }
                composition
                    .unknowns
                    .iter_mut()
                    .find(looked_for)
                    .map_or(0.0, |own| own.value)
            };
            let found = look(Slot::Start(*run), shares.iter().map(|share| share * size).collect());
            let Some(extent) = self.model.material.field_extent() else {
                continue;
            };
            let closer = |found: f64| CLOSER.iter().map(|ratio| ratio * found).collect();
            let found = look(Slot::Start(*run), closer(found));
            // Where it had turned round before, and then both by turns.
            let turns = TURNS.iter().flat_map(|share| extent.map(|end| share * end)).collect();
            let mut at = [found, look(Slot::Turn(*run), turns)];
            for _ in 0..TURN_ROUNDS {
                at = [
                    look(Slot::Start(*run), closer(at[0])),
                    look(Slot::Turn(*run), closer(at[1])),
                ];
            }
        }
        Some(composition)
    }

    /// First magnetizations that are tried, per saturation. Plays forget at once what a law's run began with, so that only what is
    /// close to the truth shows it.
    fn starts(&self) -> Vec<f64> {
        if self.model.material.law.is_none() {
            return STARTS.to_vec();
        }
        let sizes = (0..LAW_STARTS).map(|place| STARTS[STARTS.len() - 1] * LAW_RATIO.powi(-place));
        sizes.flat_map(|size| [-size, size]).collect()
    }

    /// Takes lines into a fit as nuisance; the frequencies of those that may be an effect.
    fn lines(&mut self, base: &mut Fitted) -> Option<Vec<f64>> {
        (self.progress)("lines", 0.12);
        let mut off_mains = Vec::new();
        let mut composition = base.point.composition.clone();
        for line in lines(self.bench, &base.point) {
            if composition.lines.len() >= MAX_LINES {
                break;
            }
            let mut with = composition.clone();
            with.lines.push(line);
            let Some(point) = self.bench.point(&with) else { continue };
            if base.point.cost - point.cost < JOINS {
                continue;
            }
            let noise_rms = noise_rms(self.bench, &base.point);
            let of_output = self.bench.plant.channels[line.channel].kind == ChannelKind::Output;
            if !of_output || line.of_mains() || point.nuisance.line_rms(composition.lines.len()) < LOUD * noise_rms {
                composition = with;
            } else {
                off_mains.push(line.frequency_hz);
            }
        }
        if composition != base.point.composition {
            *base = self.bench.fit(&composition, Some(base))?;
        }
        Some(off_mains)
    }
}
