//! Where to begin: settings of a term at which one simulation tells most.
//!
//! A smooth size is tried once, at the smallest value worth finding: the answer is nearly linear in it. Limits do nothing until
//! they bite, so they are tried at levels that the run's own signals reach; frequencies are tried over their range, or where
//! the residual's spectrum peaks.

use std::f64::consts::TAU;

use anhyst_model::{ActuatorModel, ParameterSpec, Screening, Signal};

use crate::statistics::{quantile, sorted};
use crate::system::Signals;
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
const MODE_FREQUENCIES: usize = 18;
/// Lines of the residual's spectrum that are tried.
const LINES: usize = 2;

/// What is known when probes are chosen.
pub(crate) struct Surroundings<'a> {
    pub model: &'a ActuatorModel,
    pub signals: &'a [Signals],
    /// Output residual of each run, in the output's unit.
    pub residuals: &'a [Vec<f64>],
    /// Step on which the output's values stand, where its rounding is the larger part of the noise.
    pub lattice: Option<f64>,
}

impl Surroundings<'_> {
    /// The probes of a term: its table's rows say where to look.
    pub fn probes(&self, term: Term) -> Vec<ProbeGroup> {
        let specs = term.specs(self.model).unwrap_or_default();
        let absent: Vec<f64> = specs.iter().map(ParameterSpec::neutral).collect();
        let sizes = specs.iter().enumerate().filter(|(_, own)| own.identity().is_some());
        let sizes: Vec<(usize, f64)> = sizes.map(|(place, own)| (place, own.typical)).collect();
        let looked_for = specs.iter().enumerate().find_map(|(place, own)| {
            Some((
                place,
                match own.screening {
                    Screening::Once => return None,
                    Screening::Levels(signal) => self.levels(signal),
                    Screening::Lattice => self.lattice.into_iter().collect(),
                    Screening::Band => self.band_hz(),
                    Screening::Lines => self.lines_hz(),
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

    /// Where the residual's spectrum peaks.
    fn lines_hz(&self) -> Vec<f64> {
        let Some((run, tick_s)) = self
            .signals
            .iter()
            .enumerate()
            .find_map(|(run, of)| Some((run, of.tick_s?)))
        else {
            return Vec::new();
        };
        let Some(residual) = self.residuals.get(run).filter(|residual| residual.len() > 64) else {
            return Vec::new();
        };
        let powers = powers(residual);
        let mut order: Vec<usize> = (2..powers.len().saturating_sub(1)).collect();
        order.sort_by(|one, other| powers[*other].total_cmp(&powers[*one]));
        let mut lines: Vec<usize> = Vec::new();
        for bin in order {
            if lines.len() == LINES {
                break;
            }
            if lines.iter().all(|line| line.abs_diff(bin) > 3) {
                lines.push(bin);
            }
        }
        // Padded to twice the length, so a bin is half a line wide; the parabola finds the rest.
        let length = 2 * powers.len();
        let refined = |bin: usize| {
            let (a, b, c) = (powers[bin - 1], powers[bin], powers[bin + 1]);
            let bend = a - 2.0 * b + c;
            bin as f64 + if bend < 0.0 { 0.5 * (a - c) / bend } else { 0.0 }
        };
        lines
            .into_iter()
            .map(|bin| refined(bin) / (length as f64 * tick_s))
            .collect()
    }
}

/// Power of the bins of a series padded to at least twice its length.
pub(crate) fn powers(series: &[f64]) -> Vec<f64> {
    let length = (2 * series.len()).next_power_of_two();
    let mut buffer: Vec<(f64, f64)> = series.iter().map(|value| (*value, 0.0)).collect();
    buffer.resize(length, (0.0, 0.0));
    fourier(&mut buffer);
    buffer[..length / 2].iter().map(|(re, im)| re * re + im * im).collect()
}

/// In-place transform of a power of two (Cooley and Tukey 1965).
fn fourier(buffer: &mut [(f64, f64)]) {
    let length = buffer.len();
    let mut reversed = 0;
    for index in 1..length {
        let mut bit = length >> 1;
        while reversed & bit != 0 {
            reversed ^= bit;
            bit >>= 1;
        }
        reversed |= bit;
        if index < reversed {
            buffer.swap(index, reversed);
        }
    }
    let mut half = 1;
    while half < length {
        let twiddles: Vec<(f64, f64)> = (0..half)
            .map(|k| {
                let (sine, cosine) = (-TAU * k as f64 / (2 * half) as f64).sin_cos();
                (cosine, sine)
            })
            .collect();
        for block in buffer.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for ((a, b), (cosine, sine)) in low.iter_mut().zip(high).zip(&twiddles) {
                let turned = (b.0 * cosine - b.1 * sine, b.0 * sine + b.1 * cosine);
                (*a, *b) = ((a.0 + turned.0, a.1 + turned.1), (a.0 - turned.0, a.1 - turned.1));
            }
        }
        half *= 2;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards starts of disturbances: a line between two bins is found within a hundredth of a line width.
    #[test]
    fn a_line_is_found_between_bins() {
        let tick_s = 1e-3;
        let residual: Vec<f64> = (0..3000)
            .map(|k| (TAU * 51.237 * tick_s * f64::from(k)).sin())
            .collect();
        let signals = [Signals {
            tick_s: Some(tick_s),
            ..Signals::default()
        }];
        let model = ActuatorModel::terfenol_d();
        let surroundings = Surroundings {
            model: &model,
            signals: &signals,
            residuals: &[residual],
            lattice: None,
        };
        let found = surroundings.lines_hz()[0];
        assert!((found - 51.237).abs() < 0.03, "{found}");
    }
}
