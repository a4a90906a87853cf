//! Where to begin: settings of a term at which one simulation tells most.
//!
//! A smooth size is tried once, at the smallest value worth finding: the answer is nearly linear in it. Limits do nothing until
//! they bite, so they are tried at levels that the run's own signals reach; frequencies are tried over their range, or where
//! the residual's spectrum peaks.

use anhyst_model::{ActuatorModel, ParameterSpec, Screening, Signal};

use crate::search::Trials;
use crate::signals::Signals;
use crate::statistics::{quantile, sorted};
use crate::term::Term;

/// Shapes held, and for each size its value in a trial where the other sizes are absent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProbeGroup {
    /// All values with every size absent.
    pub absent: Vec<f64>,
    /// Places of the sizes and their trial values.
    pub sizes: Vec<(usize, f64)>,
}

/// Shares of the time for which a limit would bite.
const BITING: [f64; 8] = [0.0003, 0.002, 0.01, 0.04, 0.12, 0.3, 0.5, 0.7];
const MODE_FREQUENCIES: usize = 55;

/// What is known when probes are chosen.
pub(crate) struct Surroundings<'a> {
    pub model: &'a ActuatorModel,
    pub signals: &'a [Signals],
    /// Frequencies of lines in what is left that are not the mains', Hz.
    pub lines_hz: &'a [f64],
    /// Step on which the output's values stand, where its rounding is the larger part of the noise.
    pub lattice: Option<f64>,
    pub trials: &'a Trials,
}

impl Surroundings<'_> {
    /// The probes of a term: its table's rows say where to look.
    pub fn probes(&self, term: Term) -> Vec<ProbeGroup> {
        let specs = term.specs(self.model).unwrap_or_default();
        // What the model has of it already is where it is sought from, up or down.
        let mut absent: Vec<f64> = specs.iter().map(ParameterSpec::neutral).collect();
        let mut sizes: Vec<(usize, f64)> = Vec::new();
        for (place, own) in specs.iter().enumerate() {
            let known = self.known(term, place);
            absent[place] = known.unwrap_or(absent[place]);
            if let Some(identity) = own.identity() {
                sizes.push((place, known.map_or(own.typical, |known| known + own.typical - identity)));
            }
        }
        if self.known(term, 0).is_some() {
            return vec![ProbeGroup { absent, sizes }];
        }
        let looked_for = specs.iter().enumerate().find_map(|(place, own)| {
            Some((
                place,
                match own.screening {
                    Screening::Once => return None,
                    Screening::Levels(signal) => self.levels(signal),
                    Screening::Lattice => self.lattice.into_iter().collect(),
                    Screening::Band => self.band_hz(),
                    Screening::Lines => self.lines_hz.to_vec(),
                },
            ))
        });
        let Some((place, values)) = looked_for else {
            return vec![ProbeGroup { absent, sizes }];
        };
        // Another value of a size is a trial; of a shape, the place at which the sizes are tried.
        let is_size = specs[place].identity().is_some();
        let group = |value| {
            let (mut absent, mut sizes) = (absent.clone(), sizes.clone());
            if is_size {
                sizes = vec![(place, value)];
            } else {
                absent[place] = value;
            }
            ProbeGroup { absent, sizes }
        };
        values.into_iter().map(group).collect()
    }

    /// The model's own value of an effect's fitted row.
    fn known(&self, term: Term, row: usize) -> Option<f64> {
        let Term::Effect(kind) = term else { return None };
        let (place, _) = Term::fitted(kind, self.model).nth(row)?;
        Some(self.model.effect(kind)?.values()[place])
    }

    /// Values that a signal exceeds for given shares of the time.
    fn levels(&self, signal: Signal) -> Vec<f64> {
        let all = sorted(self.signals.iter().flat_map(|run| match signal {
            Signal::Drive => magnitudes(&run.drive),
            Signal::DriveRate => drive_rates(run),
            Signal::Output => magnitudes(&run.output),
        }));
        BITING
            .iter()
            .map(|share| quantile(&all, 1.0 - share))
            .filter(|level| *level > 0.0)
            .collect()
    }

    fn band_hz(&self) -> Vec<f64> {
        let Some(tick_s) = self.signals.iter().find_map(|run| run.tick_s) else {
            return Vec::new();
        };
        let (low, high) = (0.002 / tick_s, 0.3 / tick_s);
        let ratio = (high / low).powf(1.0 / (MODE_FREQUENCIES - 1) as f64);
        (0..MODE_FREQUENCIES)
            .map(|index| low * ratio.powi(index as i32))
            .collect()
    }
}

fn magnitudes(series: &[f64]) -> Vec<f64> {
    series.iter().map(|value| value.abs()).collect()
}

fn drive_rates(run: &Signals) -> Vec<f64> {
    let Some(tick_s) = run.tick_s else { return Vec::new() };
    run.drive
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs() / tick_s)
        .collect()
}
