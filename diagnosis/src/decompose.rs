//! measured = simulated(constants, effects) + nuisance + what is left: effects join one by one (`joining.rs`), each fitted with all that is in.
//!
//! 1. The nominal chain with its constants, starts and linear nuisance is fitted; the recorder's low pass and lines are sought in what it leaves.
//! 2. Every term is screened beside it, the best few are fitted, and the one with the lowest J joins if J falls by more than `JOINS`
//!    and the residual moves by more than a share of what is left. A free curve that gains far more than any of them ends the search:
//!    what is missing has no name.
//! 3. Until nothing joins. Then the one that is missed least is taken out (`leaving.rs`), as long as the evidence (`evidence.rs`) falls by less
//!    than `JOINS`.

use anhyst_identify::parallel;

use crate::acquisition::{Likely, LowPass};
use crate::channel::ChannelKind;
use crate::composition::{Composition, Slot};
use crate::evidence::{Evidence, noise_rms};
use crate::joining::{at_a_bound, sort, unbent};
use crate::leaving::TIES;
use crate::likelihood::{Bench, Fitted, Point};
use crate::lines::lines;
use crate::screening::Screened;
use crate::search::{JOINS, Search};
use crate::term::Term;
use crate::unlisted::{Unlisted, unlisted};

const MAX_TERMS: usize = 5;
/// A free curve must gain this much more than the best of the library, and this factor.
const NAMELESS: (f64, f64) = (60.0, 1.25);
/// First magnetizations that are tried, A/m per saturation.
const STARTS: [f64; 12] = [
    -0.4, -0.26, -0.18, -0.11, -0.06, -0.02, 0.02, 0.06, 0.11, 0.18, 0.26, 0.4,
];
const MAX_LINES: usize = 8;
/// A line that is not the mains' is a disturbance of the plant from this multiple of the noise on, and nuisance below: the
/// output alone does not tell which.
const LOUD: f64 = 3.0;

/// What came out.
pub(crate) struct Decomposition {
    /// The model as given, with its zero, nothing fitted.
    pub nominal: Point,
    /// Constants and nuisance, no term.
    pub base: Fitted,
    /// With all terms.
    pub last: Fitted,
    /// Fits that explain as well, each with one term in the place of another.
    pub ties: Vec<Fitted>,
    /// Fits that were tried at each stage.
    pub tried: Vec<Fitted>,
    /// What the free curves gain beside the last fit.
    pub unlisted: Vec<Unlisted>,
    /// A free curve ended the search.
    pub nameless: bool,
    /// The first screening.
    pub screened: Vec<Screened>,
}

impl Decomposition {
    /// By how much it explains the measurement worse than another: J, and what each term more has to earn.
    pub fn cost(&self) -> f64 {
        self.last.point.cost + JOINS * self.last.point.composition.terms().len() as f64
    }
}

impl Search<'_> {
    pub fn run(&mut self) -> Option<Decomposition> {
        let bench = self.bench;
        (self.progress)("the model as given", 0.0);
        let nominal = bench.point(&Composition::default())?;
        let (mut base, mut off_mains) = self.base()?;
        let first = base.clone();
        let (mut tried, mut ties): (Vec<Fitted>, Vec<(Term, Fitted)>) = (Vec::new(), Vec::new());
        let mut screened_first = Vec::new();
        let mut free = Vec::new();
        let mut nameless = false;
        for stage in 0..=MAX_TERMS {
            (self.progress)("screening", 0.15 + 0.13 * stage as f64);
            let screened = self.screen(&base, &off_mains);
            if stage == 0 {
                screened_first.clone_from(&screened);
            }
            let mut fits = self.fit_best(&base, &screened, stage);
            let at_noise = fits
                .first()
                .is_some_and(|(_, fit)| !Evidence::new(bench, &fit.point).is_misfit);
            if stage == 0
                && !at_noise
                && let Some(unbent) = unbent(bench, &base)
            {
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
            free = unlisted(bench, &base);
            let best = fits.first();
            let gain = best.map_or(0.0, |(_, fit)| base.point.cost - fit.point.cost);
            // Beside a fitted model's own error a curve proves nothing.
            let beaten = free
                .first()
                .is_some_and(|own| !bench.plant.fitted && own.gain > gain + NAMELESS.0 && own.gain > NAMELESS.1 * gain);
            if beaten {
                nameless = true;
                tried.extend(fits.into_iter().map(|(_, fit)| fit));
                break;
            }
            let Some((term, best)) = best.cloned() else { break };
            if gain < JOINS || !self.moves(&base, &best) || stage == MAX_TERMS {
                tried.extend(fits.into_iter().map(|(_, fit)| fit));
                break;
            }
            let evidence = Evidence::new(bench, &best.point);
            let least = evidence.cost(&best.point);
            for (other, fit) in &fits {
                if *other != term && evidence.cost(&fit.point) - least < TIES {
                    ties.push((term, fit.clone()));
                }
            }
            tried.extend(fits.into_iter().map(|(_, fit)| fit));
            let polished = bench.fit(&best.point.composition, None)?;
            if at_a_bound(&polished.point.composition, term) {
                break;
            }
            base = polished;
            off_mains = self.lines(&mut base)?;
        }
        (self.progress)("taking each out again", 0.85);
        let last = self.without_those_that_earn_nothing(base)?;
        let ties = self.ties(&last, &ties);
        Some(Decomposition {
            nominal,
            base: first,
            last,
            ties,
            tried,
            unlisted: free,
            nameless,
            screened: screened_first,
        })
    }

    /// Constants, starts, the recorder's low pass and lines.
    fn base(&mut self) -> Option<(Fitted, Vec<f64>)> {
        let bench = self.bench;
        let starts: Vec<usize> = bench
            .plant
            .runs
            .iter()
            .enumerate()
            .filter(|(_, run)| run.tick_s.is_some())
            .map(|(index, _)| index)
            .collect();
        let mut composition = Composition::nominal(self.model, &starts, bench.plant.fitted);
        for (kind, low_pass) in &self.low_passes {
            composition = composition.with_low_pass(*kind, *low_pass);
        }
        (self.progress)("where the material was at the first row", 0.03);
        composition = self.started(composition, &starts)?;
        (self.progress)("calibrating the constants", 0.06);
        let mut base = bench.fit(&composition, None)?;
        let off_mains = self.lines(&mut base)?;
        Some((base, off_mains))
    }

    /// A composition from the best of some first magnetizations, run by run.
    fn started(&self, mut composition: Composition, starts: &[usize]) -> Option<Composition> {
        let bench = self.bench;
        let saturation = self.model.material.hysteresis.saturation_magnetization_a_per_m;
        let mut least = bench.point(&composition)?;
        for run in starts {
            let others: Vec<Composition> = STARTS
                .iter()
                .map(|share| {
                    let mut tried = composition.clone();
                    if let Some(own) = tried.unknowns.iter_mut().find(|own| own.slot == Slot::Start(*run)) {
                        own.value = share * saturation;
                    }
                    tried
                })
                .collect();
            let points = parallel::map(bench.threads, &others, |tried| bench.point(tried));
            for point in points.into_iter().flatten() {
                if point.cost < least.cost {
                    composition = point.composition.clone();
                    least = point;
                }
            }
        }
        Some(composition)
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
            if line.of_mains() || point.nuisance.line_rms(composition.lines.len()) < LOUD * noise_rms {
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

/// The recorder's low passes in what a point leaves of field and output. What a fitted model leaves of the output is its own
/// error, whose spectrum falls without any filter.
pub(crate) fn low_passes(bench: &Bench, point: &Point) -> Vec<(ChannelKind, Likely)> {
    let of = |kind: ChannelKind| {
        let is_noise = kind == ChannelKind::Field || !bench.plant.fitted;
        let channel = bench.plant.channels.iter().find(|own| own.kind == kind && is_noise)?;
        let tick_s = bench.plant.runs[channel.run].tick_s?;
        let seen = LowPass::seen(&bench.left(point, channel), tick_s, channel.resolution);
        (!seen.is_empty()).then_some((kind, seen))
    };
    let kinds = [ChannelKind::Field, ChannelKind::Output].into_iter();
    kinds.filter_map(of).collect()
}
