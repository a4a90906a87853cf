//! The actuator chain as a diagnosis sees it: runs in, the spectra of all channels out.

use std::borrow::Cow;
use std::f64::consts::{FRAC_2_PI, SQRT_2};
use std::ops::Range;
use std::sync::Arc;

use anhyst_identify::prepared::PreparedRun;
use anhyst_measured::Quantity;
use anhyst_model::{ActuatorModel, ActuatorOutputs, EffectKind, MagneticHalf, MagneticStart};

use realfft::num_complex::Complex;

use crate::acquisition::{Before, Likely, LowPass, periodic};
use crate::channel::{Channel, ChannelKind};
use crate::composition::Composition;
use crate::memory::{Recent, Tally};
use crate::shape::Shape;
use crate::spectrum::Spectrum;
use crate::term::Term;
use crate::unknown::drive_zero_a_per_m;

/// Magnetic halves that are kept, of each run: those of what is being fitted, and what it is held against.
const HALVES: usize = 32;
/// Time courses that are kept, of each channel.
const SHAPES: usize = 12;
/// Low passes, and spectra of the field, that are kept of each run.
const FIELDS: usize = 6;
/// Residuals in which a low pass was looked for, that are kept.
const SEEN: usize = 8;

/// Standard deviation of the drive's gain.
const DRIVE_GAIN: f64 = 2e-3;

/// Of the noise beneath a converter's steps, by the step: wider, nothing is left of them.
const MAX_SPREAD: f64 = 0.3;

/// A nominal model and the runs that it has to explain.
#[derive(Clone)]
pub(crate) struct Plant {
    pub model: ActuatorModel,
    pub runs: Vec<PreparedRun>,
    /// Of each run, all its rows.
    pub whole: Vec<Spectrum>,
    pub channels: Vec<Channel>,
    /// By channel, rows as compared, in its unit.
    pub measured: Vec<Vec<f64>>,
    /// What is compared first.
    pub output: Quantity,
    /// The model's numbers were fitted to measurements, so they carry its errors.
    pub fitted: bool,
    /// `a` drifts while a run is made: standard deviation of by how much, A/m.
    pub shape_drift_a_per_m: Option<f64>,
    /// Step on which the output's values stand, where its rounding is the larger part of the noise.
    pub lattice: Option<f64>,
    /// Runs are simulated in ticks half as long as theirs.
    pub halved: bool,
    pub memory: Arc<Memory>,
}

/// What becomes of a converter's steps: they jump, so derivatives are of what is between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steps {
    Made,
    LeftOut,
}

/// What a magnetic half is of: run, its start, zero of the drive, how far `a` is above its value at the first sample and at the last (A/m), what the model has of it.
type Half = (usize, Option<MagneticStart>, f64, [f64; 2], ActuatorModel);
/// A run, the low pass of its recorder, and what is before that.
type Filtering = (usize, LowPass, Option<Before>);

/// Rounds in which a line settles on where the steps are.
const ROUNDS: usize = 5;

/// E round(u + e), e normal of standard deviation σ, at most [`MAX_SPREAD`].
fn stepped(value: f64, deviation: f64) -> f64 {
    let whole = value.floor();
    let risen = |at: f64| 0.5 * libm::erfc((at - (value - whole)) / (deviation * SQRT_2));
    whole - 1.0 + [-0.5, 0.5, 1.5].into_iter().map(risen).sum::<f64>()
}

/// What of a plant's simulations serves again.
pub(crate) struct Memory {
    halves: Recent<Half, MagneticHalf>,
    shapes: Recent<(Range<usize>, usize, Shape), Vec<f64>>,
    responses: Recent<Filtering, [Vec<Complex<f64>>; 2]>,
    /// Of a field, which most of what is fitted leaves alone.
    fields: Recent<Vec<f64>, Vec<f64>>,
    /// What the noise of a channel's residual shows of a low pass, from a share of the sampling rate on.
    pub seen: Recent<(Vec<f64>, f64), Likely>,
    /// Runs that were simulated, and those whose magnetic half was not there.
    pub simulated: Tally,
    pub magnetized: Tally,
}

impl Memory {
    pub fn of(runs: usize, channels: usize) -> Arc<Self> {
        Arc::new(Memory {
            halves: Recent::new(HALVES * runs),
            shapes: Recent::new(SHAPES * channels),
            responses: Recent::new(FIELDS * runs),
            fields: Recent::new(FIELDS * runs),
            seen: Recent::new(SEEN),
            simulated: Tally::default(),
            magnetized: Tally::default(),
        })
    }
}

impl Plant {
    /// The converter's steps are in the model.
    pub fn is_quantised(&self, composition: &Composition) -> bool {
        let mut terms = composition.terms().into_iter();
        self.model.effect(EffectKind::Quantisation).is_some() || terms.any(Term::is_lattice)
    }

    /// All runs under a composition, its steps made or left out; None where the model refuses its values.
    pub fn simulate(&self, composition: &Composition, steps: Steps) -> Option<Vec<ActuatorOutputs>> {
        let mut model = composition.model(&self.model).ok()?;
        let of = |kind: ChannelKind| composition.fitted_low_pass(kind);
        let low_passes = [of(ChannelKind::Field), of(ChannelKind::Output)];
        // The converter is last.
        let step_m = model.effect(EffectKind::Quantisation).map(|own| own.values()[0]);
        model.effects.retain(|own| own.kind() != EffectKind::Quantisation);
        let before = [Some(Before::of(&model)), None];
        let zero = composition.drive_zero_a_per_m().unwrap_or(0.0);
        let simulated = self.runs.iter().enumerate().map(|(index, run)| {
            let run = if self.halved {
                Cow::Owned(run.with_half_ticks())
            } else {
                Cow::Borrowed(run)
            };
            let first = run.drive_a_per_m.first().map_or(0.0, |drive| drive + zero);
            let mut outputs = ActuatorOutputs::default();
            let start = composition.start(index, first, &model.material);
            let above = composition.shape_above_a_per_m(index);
            let asked = (index, start, zero, above, model.magnetic_half());
            let magnetize = || {
                self.memory.magnetized.count();
                let mut run = Cow::Borrowed(&*run);
                if zero != 0.0 {
                    run.to_mut().drive_a_per_m.iter_mut().for_each(|drive| *drive += zero);
                }
                run.magnetize_from(start, &model, above).ok()
            };
            let half = self
                .memory
                .halves
                .get(|own| *own == asked, || asked.clone(), magnetize)?;
            self.memory.simulated.count();
            run.simulate_on(&half, &model, &mut outputs).ok()?;
            if self.halved {
                for series in [
                    &mut outputs.field_a_per_m,
                    &mut outputs.magnetization_a_per_m,
                    &mut outputs.displacement_m,
                ] {
                    *series = series.iter().copied().step_by(2).collect();
                }
            }
            let output = if self.magnetic() {
                &mut outputs.magnetization_a_per_m
            } else {
                &mut outputs.displacement_m
            };
            let parts = [&mut outputs.field_a_per_m, output];
            for ((series, low_pass), before) in parts.into_iter().zip(low_passes).zip(before) {
                if let Some(low_pass) = low_pass {
                    self.filter(series, index, low_pass, before);
                }
            }
            if let Some(step_m) = step_m.filter(|_| steps == Steps::Made && !self.magnetic()) {
                self.step(index, &mut outputs.displacement_m, step_m);
            }
            Some(outputs)
        });
        simulated.collect()
    }

    /// The displacement is rounded to a converter's steps under a composition.
    pub fn has_steps(&self, composition: &Composition) -> bool {
        let known = self.model.effect(EffectKind::Quantisation).is_some();
        known || composition.terms().into_iter().any(Term::is_lattice)
    }

    /// What a converter's steps make of a run's displacement, where its zero and slow drift have it: E round((y + e)/q) q, e normal. Noise and misfit
    /// move a row to another step than its own with probability √(2/π) σ/q, which gives σ.
    fn step(&self, run: usize, displacement_m: &mut [f64], step_m: f64) {
        let mut outputs = self.outputs().filter(|(_, own)| own.run == run);
        let Some((index, channel)) = outputs.next() else { return };
        let both = || {
            self.measured[index]
                .iter()
                .zip(&displacement_m[channel.rows.clone()])
                .enumerate()
        };
        let rows = channel.rows.len() as f64;
        let middle = 0.5 * (rows - 1.0);
        let (mut mean, mut slope, mut others) = (0.0, 0.0, 0.0);
        for round in 0..ROUNDS {
            let [mut sum, mut turned] = [0.0; 2];
            others = 0.0;
            for (row, (measured, own)) in both() {
                let from_middle = row as f64 - middle;
                let there = own + mean + slope * from_middle;
                // At first by what is between the steps, then by the rows that are on another one.
                let on_step = (there / step_m).round() * step_m;
                let off = measured - if round == 0 { there } else { on_step };
                sum += off;
                turned += off * from_middle;
                others += f64::from(u8::from((measured - on_step).abs() > 0.5 * step_m));
            }
            mean += sum / rows;
            slope += turned * 12.0 / rows.powi(3);
        }
        let spread = (others / rows / FRAC_2_PI.sqrt()).clamp(1e-6, MAX_SPREAD);
        let line = |row: f64| mean + slope * (row - middle);
        for (row, own) in displacement_m.iter_mut().enumerate() {
            let off = line(row as f64 - channel.rows.start as f64);
            *own = step_m * stepped((*own + off) / step_m, spread) - off;
        }
    }

    /// Changes of the spectra by what nothing is fitted for, each by its standard deviation: gain and zero of the record of the
    /// drive, which a fit cannot tell from constants, limits and a bias, and, `with_tick`, what ticks half as long change. Its numbers are known no better.
    pub fn doubts(&self, composition: &Composition, simulated: &[f64], with_tick: bool) -> Vec<Vec<f64>> {
        let zero = drive_zero_a_per_m(&self.model.material);
        let answer = |(gain, zero, halved): (f64, f64, bool)| {
            let mut moved = self.clone();
            moved.memory = Memory::of(self.runs.len(), self.channels.len());
            moved.halved = halved;
            for drive in moved.runs.iter_mut().flat_map(|run| &mut run.drive_a_per_m) {
                *drive += gain * *drive + zero;
            }
            let mut spectra = moved.spectra(&moved.simulate(composition, Steps::Made)?)?;
            for (own, without) in spectra.iter_mut().zip(simulated) {
                *own -= without;
            }
            Some(spectra)
        };
        // A fitted model carries its own errors.
        let of_drive = !self.fitted;
        let of_zero = of_drive && composition.drive_zero_a_per_m().is_none();
        let of_tick = with_tick && self.runs.iter().all(|run| run.tick_s.is_some());
        let doubts = [
            (of_drive, (DRIVE_GAIN, 0.0, false)),
            (of_zero, (0.0, zero, false)),
            (of_tick, (0.0, 0.0, true)),
        ];
        let there = doubts.into_iter().filter(|(is_there, _)| *is_there);
        there.filter_map(|(_, own)| answer(own)).collect()
    }

    /// A series of all rows of a run after a low pass of its recorder: the coil's field with what is before it, or what moves, which is smooth.
    pub fn filter(&self, series: &mut [f64], run: usize, low_pass: LowPass, before: Option<Before>) {
        let Some(tick_s) = self.runs[run].tick_s else { return };
        let asked = (run, low_pass, before);
        let spectrum = &self.whole[run];
        let answer = || {
            let images = before.map(|before| low_pass.images(&before, tick_s, series.len()));
            let drive = periodic(&self.runs[run].drive_a_per_m, spectrum);
            let folded = images.unwrap_or_default().into_iter().zip(drive[1..].chunks(2));
            let folded = folded.map(|(image, own)| image * Complex::new(own[0], own.get(1).copied().unwrap_or(0.0)));
            Some([low_pass.responses(tick_s, series.len()), folded.collect()])
        };
        let responses = self.memory.responses.get(|own| *own == asked, || asked, answer);
        if let Some(known) = responses {
            let [responses, folded] = &*known;
            low_pass.apply(series, tick_s, spectrum, responses, folded);
        }
    }

    /// The output is the magnetization itself, or what a law gives in its place.
    pub fn magnetic(&self) -> bool {
        matches!(self.output, Quantity::Magnetization | Quantity::FluxDensity)
    }

    /// A channel's series of a simulated run, all rows.
    pub fn series<'a>(&self, channel: &Channel, outputs: &'a ActuatorOutputs) -> &'a [f64] {
        match channel.kind {
            ChannelKind::Field => &outputs.field_a_per_m,
            ChannelKind::Output if !self.magnetic() => &outputs.displacement_m,
            ChannelKind::Output | ChannelKind::Magnetization => &outputs.magnetization_a_per_m,
        }
    }

    /// The stacked spectra of all channels.
    pub fn spectra(&self, runs: &[ActuatorOutputs]) -> Option<Vec<f64>> {
        let mut stacked = Vec::with_capacity(self.length());
        for channel in &self.channels {
            let series = &self.series(channel, &runs[channel.run])[channel.rows.clone()];
            if channel.kind == ChannelKind::Field {
                let answer = || Some(channel.spectrum.of(series));
                let field = self
                    .memory
                    .fields
                    .get(|own| own == series, || series.to_vec(), answer)?;
                stacked.extend_from_slice(&field);
            } else {
                stacked.extend(channel.spectrum.of(series));
            }
        }
        stacked.iter().all(|value| value.is_finite()).then_some(stacked)
    }

    /// A time course of the nuisance of a channel among the stacked spectra.
    pub fn shape(&self, index: usize, shape: Shape) -> Arc<Vec<f64>> {
        let channel = &self.channels[index];
        let asked = (channel.places.clone(), self.length(), shape);
        let answer = || {
            let series: Vec<f64> = (0..channel.rows.len()).map(|row| shape.at(row as f64)).collect();
            Some(self.stacked(channel, &series))
        };
        let known = self.memory.shapes.get(|own| *own == asked, || asked.clone(), answer);
        known.unwrap_or_default()
    }

    /// A series of one channel among the stacked spectra, its mean left out.
    pub fn stacked(&self, channel: &Channel, series: &[f64]) -> Vec<f64> {
        let mut own = vec![0.0; self.length()];
        own[channel.places.clone()].copy_from_slice(&channel.spectrum.of(series));
        own[channel.places.start] = 0.0;
        own
    }

    /// The same of what was measured.
    pub fn measured_spectra(&self) -> Vec<f64> {
        let channels = self.channels.iter().zip(&self.measured);
        channels
            .flat_map(|(channel, series)| channel.spectrum.of(series))
            .collect()
    }

    /// Numbers of the stacked spectra.
    pub fn length(&self) -> usize {
        self.channels.last().map_or(0, |channel| channel.places.end)
    }

    /// The channels that hold the output, one a run.
    pub fn outputs(&self) -> impl Iterator<Item = (usize, &Channel)> {
        let channels = self.channels.iter().enumerate();
        channels.filter(|(_, channel)| channel.kind == ChannelKind::Output)
    }

    /// Bands of all channels among the stacked spectra, with their channel.
    pub fn bands(&self) -> Vec<Range<usize>> {
        let shifted = |channel: &Channel| {
            let from = channel.places.start;
            let bands = channel.spectrum.bands();
            bands.into_iter().map(move |band| band.start + from..band.end + from)
        };
        self.channels.iter().flat_map(shifted).collect()
    }

    /// The same plant with only a share of each channel's rows compared, from the first on.
    pub fn first_part(&self, share: f64) -> Self {
        self.part(|rows| rows.start..rows.start + (share * rows.len() as f64) as usize)
    }

    /// The same plant without the first seconds of what is compared.
    pub fn skipping(&self, time_s: f64) -> Self {
        let tick_s = self.runs.iter().find_map(|run| run.tick_s).unwrap_or(f64::INFINITY);
        self.part(|rows| {
            let start = rows.end.min(rows.start + (time_s / tick_s).ceil() as usize);
            rows.end - Spectrum::quick_length(rows.end - start)..rows.end
        })
    }

    fn part(&self, chosen: impl Fn(&Range<usize>) -> Range<usize>) -> Self {
        let mut part = self.clone();
        let mut from = 0;
        for (channel, measured) in part.channels.iter_mut().zip(&mut part.measured) {
            let rows = chosen(&channel.rows);
            *measured = measured[rows.start - channel.rows.start..rows.end - channel.rows.start].to_vec();
            channel.places = from..from + rows.len();
            channel.spectrum = Spectrum::new(rows.len());
            from += rows.len();
            channel.rows = rows;
        }
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the steps under noise: the mean of many rounded draws, and rounding itself where there is none.
    #[test]
    fn steps_are_as_noise_makes_them() {
        for value in [-2.7, -0.5, 0.1, 0.45, 1.62] {
            assert!((stepped(value, 1e-6) - f64::round(value)).abs() < 1e-9 || (value + 0.5) % 1.0 == 0.0);
            for deviation in [0.05, 0.15, MAX_SPREAD] {
                // Quantiles of the normal distribution by the sum of its density.
                let grid = (-6000..=6000).map(|step| f64::from(step) * 1e-3);
                let mean = grid.map(|e| 1e-3 * (-0.5 * e * e).exp() * (value + deviation * e + 1e-9).round());
                let expected = mean.sum::<f64>() / (2.0 * std::f64::consts::PI).sqrt();
                assert!(
                    (stepped(value, deviation) - expected).abs() < 2e-3,
                    "{value} {deviation}"
                );
            }
        }
    }
}
