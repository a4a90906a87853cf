//! Series as their real spectra: an orthonormal transform of each channel, and the bands on which a noise level is estimated.
//!
//! Z of N samples is N real numbers: the mean × √N, then for each frequency f = k/(N T), k = 1, 2, …, √(2/N) times real and
//! imaginary part of Σ z_n e^{−2πi kn/N}; sums of squares stay (Parseval). The mean is the instrument's zero and belongs to no band.
//! Bands are octaves from 8 lines up, and a third of that above a fortieth of the sampling rate, where filters cut.

use std::ops::Range;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Lines of the first band; fewer tell no level.
const FIRST_BAND: usize = 8;
/// Above this share of the sampling rate bands are narrower.
const UPPER: f64 = 1.0 / 40.0;
const NARROW: f64 = 4.0 / 3.0;

/// One channel's transform.
#[derive(Clone)]
pub(crate) struct Spectrum {
    length: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

impl Spectrum {
    pub fn new(length: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Spectrum {
            length,
            forward: planner.plan_fft_forward(length),
            backward: planner.plan_fft_inverse(length),
        }
    }

    /// The largest length up to this one whose transform is quick: of small prime factors.
    pub fn quick_length(length: usize) -> usize {
        let is_quick = |length: &usize| {
            let mut rest = *length;
            for prime in [2, 3, 5, 7, 11, 13] {
                while rest > 0 && rest.is_multiple_of(prime) {
                    rest /= prime;
                }
            }
            rest <= 1
        };
        (0..=length).rev().find(is_quick).unwrap_or(length)
    }

    /// The spectrum of a series of this length.
    pub fn of(&self, series: &[f64]) -> Vec<f64> {
        let mut lines = self.forward.make_output_vec();
        // The lengths are the plan's own, so it cannot fail.
        let _ = self.forward.process(&mut series.to_vec(), &mut lines);
        let size = (self.length as f64).sqrt().recip();
        let twice = std::f64::consts::SQRT_2 * size;
        let mut packed = Vec::with_capacity(self.length);
        packed.push(lines[0].re * size);
        for line in &lines[1..self.length.div_ceil(2)] {
            packed.extend([line.re * twice, line.im * twice]);
        }
        if self.length.is_multiple_of(2) {
            packed.push(lines[self.length / 2].re * size);
        }
        packed
    }

    /// The series that has this spectrum.
    pub fn back(&self, packed: &[f64]) -> Vec<f64> {
        let size = (self.length as f64).sqrt().recip();
        let half = std::f64::consts::FRAC_1_SQRT_2 * size;
        let mut lines = self.backward.make_input_vec();
        lines[0].re = packed[0] * size;
        for (line, pair) in lines[1..self.length.div_ceil(2)].iter_mut().zip(packed[1..].chunks(2)) {
            *line = Complex::new(pair[0], pair[1]) * half;
        }
        if self.length.is_multiple_of(2) {
            lines[self.length / 2].re = packed[self.length - 1] * size;
        }
        let mut series = self.backward.make_output_vec();
        let _ = self.backward.process(&mut lines, &mut series);
        series
    }

    /// Places of the bands in a spectrum.
    pub fn bands(&self) -> Vec<Range<usize>> {
        let lines = self.length / 2;
        let mut bands = Vec::new();
        let mut from = 1;
        while from <= lines {
            let wide = if (from as f64) < UPPER * self.length as f64 {
                2.0
            } else {
                NARROW
            };
            let mut to = ((from as f64 * wide) as usize).max(FIRST_BAND).max(from + 1);
            // A remainder too short to tell a level joins the last band.
            if lines + 1 < to + FIRST_BAND.max((0.2 * (to - from) as f64) as usize) {
                to = lines + 1;
            }
            bands.push(2 * from - 1..(2 * to - 1).min(self.length));
            from = to;
        }
        bands
    }

    /// Power of each line from 1 up: the mean of the squares of its two numbers.
    pub fn powers(packed: &[f64]) -> Vec<f64> {
        packed[1..]
            .chunks(2)
            .map(|line| line.iter().map(|own| own * own).sum::<f64>() / line.len() as f64)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards every likelihood: no energy is lost or invented, and each number but the mean lies in one band.
    #[test]
    fn energy_stays_and_bands_cover_the_spectrum() {
        for length in [1139, 5000, 40_000] {
            let series: Vec<f64> = (0..length).map(|k| ((k * k) as f64 * 0.37).sin() + 0.2).collect();
            let spectrum = Spectrum::new(length);
            let packed = spectrum.of(&series);
            assert_eq!(packed.len(), length);
            let energy = |own: &[f64]| own.iter().map(|value| value * value).sum::<f64>();
            assert!((energy(&packed) / energy(&series) - 1.0).abs() < 1e-12);
            let back = spectrum.back(&packed);
            assert!(back.iter().zip(&series).all(|(one, other)| (one - other).abs() < 1e-9));
            let bands = spectrum.bands();
            assert_eq!((bands[0].start, bands[bands.len() - 1].end), (1, length));
            assert!(bands.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(bands.iter().all(|band| band.len() >= 2 * FIRST_BAND - 2), "{bands:?}");
        }
    }
}
