//! The whole search: nominal, singles, pairs, and all nominal parameters calibrated, in this order, until one reaches the noise.
//!
//! A fit *reaches the noise* when no channel's held-out rms is above `AT_THE_FLOOR` of its noise and nothing is left
//! in any direction, or what is left is immaterial: below `IMMATERIAL_NOISE` of the noise, or `IMMATERIAL_GAP` of the gap that it
//! closed and `MOST_IMMATERIAL` of the noise (two simulators of one effect differ by about as much). The simplest that reaches it wins; among
//! equally simple ones the smallest BIC.

use anhyst_model::NominalParameter;

use anhyst_identify::engine::dot;

use crate::score::ScoreTest;
use crate::screening::Screened;
use crate::select::{
    Tested, fit_pairs, pairs_with, promising, promising_pairs, screen_beside, sort, starts_beside, terms, tested,
    try_singles,
};
use crate::statistics::rms;
use crate::system::Setting;
use crate::term::Term;
use crate::ties::UNDECIDED;
use crate::workbench::{Fitted, Workbench};

const AT_THE_FLOOR: f64 = 1.05;
const IMMATERIAL_NOISE: f64 = 0.1;
const IMMATERIAL_GAP: f64 = 0.004;
const MOST_IMMATERIAL: f64 = 0.3;
/// Fits whose remainder is looked at, best first.
const LOOKED_AT: usize = 4;

/// Which nominal parameters were free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// As given.
    Nominal,
    /// All fitted within their priors.
    Calibrated,
}

/// How the search ended.
pub(crate) struct Found {
    pub nominal: Tested,
    pub library: Vec<Screened>,
    /// All fits, best first.
    pub singles: Vec<Fitted>,
    pub pairs: Vec<Fitted>,
    pub calibrated: Vec<Fitted>,
    /// The simplest that reaches the noise; none if nothing does.
    pub winner: Option<(Level, Tested)>,
}

/// What a stage of the search tells.
pub(crate) type Tell<'a> = &'a mut dyn FnMut(&'static str, f64);

pub(crate) fn search(bench: &Workbench, tell: Tell) -> Option<Found> {
    tell("simulating the nominal model", 0.0);
    let nominal = bench.fit(&[], false, bench.threads)?;
    let signals = bench.system.signals(&[])?;
    tell("screening the library", 0.02);
    let library = screen_beside(bench, &nominal, &signals, &terms(bench, &signals));
    let nominal = tested(bench, nominal, &library)?;
    let mut found = Found {
        nominal,
        library,
        singles: Vec::new(),
        pairs: Vec::new(),
        calibrated: Vec::new(),
        winner: None,
    };
    if !found.nominal.test.alarmed() {
        found.winner = Some((Level::Nominal, found.nominal.clone()));
        return Some(found);
    }
    tell("fitting single effects", 0.15);
    found.singles = try_singles(bench, &found.library);
    found.winner = found
        .first_at_the_floor(bench, &found.singles)
        .map(|own| (Level::Nominal, own));
    if found.winner.is_none() {
        tell("fitting pairs", 0.4);
        found.try_pairs(bench);
    }
    if found.winner.is_none() {
        tell("calibrating the nominal parameters", 0.7);
        found.calibrated = calibrate(bench, &found.library);
        found.winner = found
            .first_at_the_floor(bench, &found.calibrated)
            .map(|own| (Level::Calibrated, own));
    }
    if found.winner.is_none() && found.nominal.test.family_tail > SURE_ALARM {
        found.winner = Some((Level::Nominal, found.nominal.clone()));
    }
    tell("done searching", 0.9);
    Some(found)
}

/// Singles for which a second term is sought, and second terms fitted beside each.
const SEEDS: usize = 4;
const SECONDS: usize = 5;
/// Pairs that look best where all answers are taken as linear.
const LINEAR_PAIRS: usize = 8;
/// What a fit must lower the BIC by to be an explanation at all.
const LEAST_GAIN: f64 = 4.0;
/// An alarm that no listed explanation answers to counts from here on; above, it is taken for chance.
const SURE_ALARM: f64 = 1e-5;

impl Found {
    /// Fits of the same kind as the winner.
    pub fn rivals(&self, level: Level, winner: &Tested) -> &[Fitted] {
        match (level, winner.fit.settings.len()) {
            (Level::Calibrated, _) => &self.calibrated,
            (Level::Nominal, 0 | 1) => &self.singles,
            (Level::Nominal, _) => &self.pairs,
        }
    }

    /// Pairs of the best singles, until one reaches the noise; then also those of its second term, which is how a
    /// first term that was mistaken for another comes to light.
    fn try_pairs(&mut self, bench: &Workbench) {
        let pairs = promising_pairs(bench, &self.nominal.fit, &self.library, LINEAR_PAIRS);
        self.pairs.extend(fit_pairs(bench, &pairs, &self.singles));
        for seed in self.seeds(bench) {
            self.pairs
                .extend(pairs_with(bench, &self.singles[seed], &self.library, SECONDS));
            sort(&mut self.pairs);
            self.winner = self
                .first_at_the_floor(bench, &self.pairs)
                .map(|own| (Level::Nominal, own));
            if let Some((_, winner)) = &self.winner {
                let second = winner.fit.settings.last().map(|setting| setting.term);
                let other = self
                    .singles
                    .iter()
                    .find(|single| second.is_some_and(|term| single.has(term)));
                if let Some(other) = other {
                    self.pairs.extend(pairs_with(bench, other, &self.library, SECONDS));
                    sort(&mut self.pairs);
                    self.winner = self
                        .first_at_the_floor(bench, &self.pairs)
                        .map(|own| (Level::Nominal, own));
                }
                return;
            }
        }
    }

    /// The best singles, without those that predict what a better one predicts.
    fn seeds(&self, bench: &Workbench) -> Vec<usize> {
        let training = &bench.observation.training;
        let mut seeds: Vec<usize> = Vec::new();
        for (index, single) in self.singles.iter().enumerate() {
            let same = |seed: &usize| {
                let other = &self.singles[*seed].solution.residual;
                let difference: Vec<f64> = single.solution.residual.iter().zip(other).map(|(a, b)| a - b).collect();
                dot(training, &difference, &difference) < UNDECIDED
            };
            if !seeds.iter().any(same) {
                seeds.push(index);
            }
            if seeds.len() == SEEDS {
                break;
            }
        }
        seeds
    }

    fn first_at_the_floor(&self, bench: &Workbench, fits: &[Fitted]) -> Option<Tested> {
        for fit in fits.iter().take(LOOKED_AT) {
            // A fit beyond the floor needs no test.
            if largest_ratio(bench, fit) > AT_THE_FLOOR || fit.bic > self.nominal.fit.bic - LEAST_GAIN {
                continue;
            }
            let tested = tested(bench, fit.clone(), &self.library)?;
            if !tested.test.alarmed() || self.immaterial(bench, &tested) {
                return Some(tested);
            }
        }
        None
    }

    fn immaterial(&self, bench: &Workbench, tested: &Tested) -> bool {
        // The rounding of a noisy value is not the rounding of a model's: what is left has the lattice's own pattern.
        if tested.fit.settings.iter().any(|own| own.term.is_lattice()) {
            return true;
        }
        let rows = bench.observation.training_rows() as f64;
        let closed = ((self.nominal.fit.solution.chi_square - tested.fit.solution.chi_square) / rows)
            .max(0.0)
            .sqrt();
        left(&tested.test, rows) < IMMATERIAL_NOISE.max((IMMATERIAL_GAP * closed).min(MOST_IMMATERIAL))
    }
}

/// Rms, in noises, of the largest part of the residual that one group explains.
pub(crate) fn left(test: &ScoreTest, rows: f64) -> f64 {
    test.groups
        .iter()
        .map(|group| ((group.statistic - group.degrees as f64) / rows).max(0.0).sqrt())
        .fold(0.0, f64::max)
}

/// Largest held-out rms of any channel over its noise.
///
/// The noise was seen under the signal; once that is taken off, second differences of the residual show it better. They may
/// correct it by as much as such an estimate can be off.
pub(crate) fn largest_ratio(bench: &Workbench, fit: &Fitted) -> f64 {
    let observation = bench.observation;
    let ratios = observation.channels.iter().map(|channel| {
        let rows = observation.rows_in(channel, &observation.held_out);
        let held_out = rms(rows.flat_map(|range| fit.solution.residual[range].iter().copied()));
        let own = &fit.solution.residual[channel.rows.clone()];
        let bends = own.windows(3).map(|z| z[0] - 2.0 * z[1] + z[2]);
        held_out / (rms(bends) / 6.0_f64.sqrt()).clamp(1.0, MOST_CORRECTED)
    });
    ratios.fold(0.0, f64::max)
}

/// The noise is taken up to this many times as large as it was estimated.
const MOST_CORRECTED: f64 = 1.12;

/// Effects that are fitted beside the calibrated parameters.
const BESIDE_CALIBRATED: usize = 4;

/// All nominal parameters within their priors, alone and with one effect.
fn calibrate(bench: &Workbench, library: &[Screened]) -> Vec<Fitted> {
    let settings: Vec<Setting> = NominalParameter::ALL
        .into_iter()
        .filter_map(|parameter| {
            let value = parameter.of(bench.model)?;
            Some(Setting {
                term: Term::Parameter(parameter),
                values: vec![value],
            })
        })
        .collect();
    let Some(base) = bench.fit(&settings, true, bench.threads) else {
        return Vec::new();
    };
    let Some(signals) = bench.system.signals(&base.settings) else {
        return vec![base];
    };
    let beside = promising(bench, &base, library, BESIDE_CALIBRATED);
    let screened = screen_beside(bench, &base, &signals, &beside);
    let mut fits = bench.fit_all(&starts_beside(&base.settings, &screened), true);
    fits.push(base);
    sort(&mut fits);
    fits
}
