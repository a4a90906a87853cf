//! z = A (y − m)/σ: measured minus model over the noise, channel behind channel, with a share of time held out.
//!
//! y measured, m model, σ noise rms, A the filter that whitens noise of first-order colour φ, z_t = (r_t − φ r_{t−1})/√(1 − φ²).
//! A is linear, so measured and model are whitened one by one, and a sum of squares of z is a χ².
//! Time is cut into `BLOCKS` blocks; every fourth is held out of all fits and only predicted.
//! Assumption: noise of different channels is independent.

use std::ops::Range;

use crate::system::{Channel, ChannelKind};

/// Blocks of each run.
const BLOCKS: usize = 40;
/// Every so many is held out.
const HELD_OUT: usize = 4;

/// All that was measured and is explained.
pub(crate) struct Observation {
    pub channels: Vec<Channel>,
    /// In the channels' units.
    pub measured: Vec<f64>,
    /// Whitened.
    pub whitened: Vec<f64>,
    pub training: Vec<Range<usize>>,
    pub held_out: Vec<Range<usize>>,
}

impl Observation {
    pub fn new(channels: Vec<Channel>, measured: Vec<f64>) -> Self {
        let (mut training, mut held_out) = (Vec::new(), Vec::new());
        for channel in &channels {
            let start = (channel.rows.start + channel.settling_rows).min(channel.rows.end);
            let length = channel.rows.end - start;
            for block in 0..BLOCKS {
                let rows = start + block * length / BLOCKS..start + (block + 1) * length / BLOCKS;
                if rows.is_empty() {
                    continue;
                }
                if block % HELD_OUT == HELD_OUT / 2 {
                    held_out.push(rows)
                } else {
                    training.push(rows)
                }
            }
        }
        let mut observation = Observation {
            whitened: Vec::new(),
            channels,
            measured,
            training: joined(training),
            held_out,
        };
        observation.whitened = observation.whiten(observation.measured.clone());
        observation
    }

    /// Rows that count in a fit.
    pub fn training_rows(&self) -> usize {
        self.training.iter().map(ExactSizeIterator::len).sum()
    }

    /// A·m/σ in place.
    pub fn whiten(&self, mut outputs: Vec<f64>) -> Vec<f64> {
        for channel in &self.channels {
            let colour = channel.autoregression;
            let rows = &mut outputs[channel.rows.clone()];
            let scale = 1.0 / channel.noise_rms;
            let innovation = scale / (1.0 - colour * colour).sqrt();
            let mut before = None;
            for value in rows {
                let own = *value;
                *value = match before {
                    Some(before) if colour != 0.0 => (own - colour * before) * innovation,
                    _ => own * scale,
                };
                before = Some(own);
            }
        }
        outputs
    }

    /// A⁻¹ z·σ: whitened values in the channels' units again.
    pub fn unwhiten(&self, mut z: Vec<f64>) -> Vec<f64> {
        for channel in &self.channels {
            let colour = channel.autoregression;
            let innovation = channel.noise_rms * (1.0 - colour * colour).sqrt();
            let mut before = None;
            for value in &mut z[channel.rows.clone()] {
                *value = match before {
                    Some(before) if colour != 0.0 => colour * before + *value * innovation,
                    _ => *value * channel.noise_rms,
                };
                before = Some(*value);
            }
        }
        z
    }

    /// Constants of the channels whose zero is free, whitened.
    pub fn zeros(&self) -> Vec<Vec<f64>> {
        let free = self.channels.iter().filter(|channel| channel.free_zero);
        free.map(|channel| {
            let mut column = vec![0.0; self.measured.len()];
            column[channel.rows.clone()].fill(channel.noise_rms);
            self.whiten(column)
        })
        .collect()
    }

    /// Channels of one kind.
    pub fn of_kind(&self, kind: ChannelKind) -> impl Iterator<Item = &Channel> {
        self.channels.iter().filter(move |channel| channel.kind == kind)
    }

    /// The part of the held-out (or training) rows that lies in a channel.
    pub fn rows_in<'a>(
        &'a self,
        channel: &'a Channel,
        of: &'a [Range<usize>],
    ) -> impl Iterator<Item = Range<usize>> + 'a {
        of.iter().filter_map(|range| {
            let rows = range.start.max(channel.rows.start)..range.end.min(channel.rows.end);
            (!rows.is_empty()).then_some(rows)
        })
    }
}

/// Neighbouring ranges as one.
fn joined(ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => joined.push(range),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(rows: Range<usize>, autoregression: f64, free_zero: bool) -> Channel {
        Channel {
            run: 0,
            kind: ChannelKind::Output,
            rows,
            noise_rms: 2.0,
            autoregression,
            free_zero,
            settling_rows: 0,
        }
    }

    /// Guards held-out scores: no row may be both fitted and held out, and none may be lost.
    #[test]
    fn every_row_is_fitted_or_held_out() {
        let channels = vec![channel(0..1003, 0.0, false), channel(1003..1500, 0.0, true)];
        let observation = Observation::new(channels, vec![1.0; 1500]);
        let mut count = vec![0; 1500];
        for range in observation.training.iter().chain(&observation.held_out) {
            count[range.clone()].iter_mut().for_each(|n| *n += 1);
        }
        assert!(count.iter().all(|n| *n == 1));
        let held_out: usize = observation.held_out.iter().map(ExactSizeIterator::len).sum();
        assert!((held_out as f64 / 1500.0 - 0.25).abs() < 0.01);
        assert_eq!(observation.zeros().len(), 1);
        assert_eq!(observation.zeros()[0][1003], 1.0);
    }

    /// Guards χ² on coloured noise: whitened AR(1) noise has unit variance and no correlation.
    #[test]
    fn coloured_noise_becomes_white() {
        let mut noise = anhyst_model::Noise::new(3, 0);
        let colour = 0.8_f64;
        let mut value = 2.0 * noise.normal();
        let measured: Vec<f64> = (0..40_000)
            .map(|_| {
                value = colour * value + 2.0 * (1.0 - colour * colour).sqrt() * noise.normal();
                value
            })
            .collect();
        let observation = Observation::new(vec![channel(0..40_000, colour, false)], measured);
        let z = &observation.whitened;
        let variance = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        let covariance = z.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / z.len() as f64;
        assert!((variance - 1.0).abs() < 0.02, "{variance}");
        assert!(covariance.abs() < 0.02, "{covariance}");
        let back = observation.unwhiten(z.clone());
        let farthest = back
            .iter()
            .zip(&observation.measured)
            .map(|(back, own)| (back - own).abs());
        assert!(farthest.fold(0.0, f64::max) < 1e-12);
    }
}
