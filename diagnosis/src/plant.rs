//! The actuator chain as a diagnosis sees it: runs in, the spectra of all channels out.

use std::ops::Range;
use std::sync::Arc;

use anhyst_identify::prepared::PreparedRun;
use anhyst_model::{ActuatorModel, ActuatorOutputs, MagneticHalf, MagneticState};

use crate::channel::{Channel, ChannelKind};
use crate::composition::Composition;
use crate::memory::{Recent, Tally};
use crate::nuisance::Shape;
use crate::spectrum::Spectrum;

/// Magnetic halves that are kept, of each run: those of what is being fitted, and what it is held against.
const HALVES: usize = 12;
/// Time courses that are kept, of each channel.
const SHAPES: usize = 12;

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
    /// The output is the magnetization itself.
    pub magnetic: bool,
    /// The model's numbers were fitted to measurements, so they carry its errors.
    pub fitted: bool,
    pub memory: Arc<Memory>,
}

/// What of a plant's simulations serves again.
pub(crate) struct Memory {
    halves: Recent<(usize, Option<MagneticState>, ActuatorModel), MagneticHalf>,
    shapes: Recent<(Range<usize>, usize, Shape), Vec<f64>>,
    /// Runs that were simulated, and those whose magnetic half was not there.
    pub simulated: Tally,
    pub magnetized: Tally,
}

impl Memory {
    pub fn of(runs: usize, channels: usize) -> Arc<Self> {
        Arc::new(Memory {
            halves: Recent::new(HALVES * runs),
            shapes: Recent::new(SHAPES * channels),
            simulated: Tally::default(),
            magnetized: Tally::default(),
        })
    }
}

impl Plant {
    /// All runs under a composition; None where the model refuses its values.
    pub fn simulate(&self, composition: &Composition) -> Option<Vec<ActuatorOutputs>> {
        let model = composition.model(&self.model).ok()?;
        let of = |kind: ChannelKind| composition.fitted_low_pass(kind);
        let low_passes = [of(ChannelKind::Field), of(ChannelKind::Output)];
        let simulated = self.runs.iter().enumerate().map(|(index, run)| {
            let first = run.drive_a_per_m.first().copied().unwrap_or(0.0);
            let mut outputs = ActuatorOutputs::default();
            let start = composition.start(index, first);
            let half = self.memory.halves.get((index, start, model.magnetic_half()), || {
                self.memory.magnetized.count();
                run.magnetize_from(start, &model).ok()
            })?;
            self.memory.simulated.count();
            run.simulate_on(&half, &model, &mut outputs).ok()?;
            let output = if self.magnetic {
                &mut outputs.magnetization_a_per_m
            } else {
                &mut outputs.displacement_m
            };
            for (series, low_pass) in [&mut outputs.field_a_per_m, output].into_iter().zip(low_passes) {
                if let Some((low_pass, tick_s)) = low_pass.zip(run.tick_s) {
                    low_pass.apply(series, tick_s, &self.whole[index]);
                }
            }
            Some(outputs)
        });
        simulated.collect()
    }

    /// A channel's series of a simulated run, all rows.
    pub fn series<'a>(&self, channel: &Channel, outputs: &'a ActuatorOutputs) -> &'a [f64] {
        match channel.kind {
            ChannelKind::Field => &outputs.field_a_per_m,
            ChannelKind::Output if !self.magnetic => &outputs.displacement_m,
            ChannelKind::Output | ChannelKind::Magnetization => &outputs.magnetization_a_per_m,
        }
    }

    /// The stacked spectra of all channels.
    pub fn spectra(&self, runs: &[ActuatorOutputs]) -> Option<Vec<f64>> {
        let mut stacked = Vec::with_capacity(self.length());
        for channel in &self.channels {
            let series = self.series(channel, &runs[channel.run]);
            stacked.extend(channel.spectrum.of(&series[channel.rows.clone()]));
        }
        stacked.iter().all(|value| value.is_finite()).then_some(stacked)
    }

    /// A time course of the nuisance of a channel among the stacked spectra.
    pub fn shape(&self, index: usize, shape: Shape) -> Arc<Vec<f64>> {
        let channel = &self.channels[index];
        let make = || {
            let series: Vec<f64> = (0..channel.rows.len()).map(|row| shape.at(row as f64)).collect();
            self.stacked(channel, &series)
        };
        let known = self
            .memory
            .shapes
            .get((channel.places.clone(), self.length(), shape), || Some(make()));
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
