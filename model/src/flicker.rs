//! Noise whose power falls as 1/f, as a sum of first-order processes a factor 4 apart:
//!
//! x_i ← ρ_i x_i + √(1 − ρ_i²) n,   ρ_i = e^(−1/τ_i),   τ_i = 4^i samples,   y = Σ x_i / √N.
//!
//! n standard normal; y has variance 1 from the first sample on. Between 1/(2π τ_N) and 1/(2π) of the sampling rate the power falls
//! as 1/f within 1 dB; below it is flat. Source: van der Ziel, Physica 16 (1950) 359.

use serde::{Deserialize, Serialize};

use crate::Noise;

/// N; the slowest of them takes 16 384 samples.
const PROCESSES: usize = 8;

/// Standard 1/f noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flicker {
    noise: Noise,
    states: [f64; PROCESSES],
}

impl Flicker {
    /// Driven by this noise.
    pub fn new(mut noise: Noise) -> Self {
        let states = std::array::from_fn(|_| noise.normal());
        Flicker { noise, states }
    }

    /// The next sample, of variance 1.
    pub fn normal(&mut self) -> f64 {
        let mut sum = 0.0;
        let mut samples = 1.0;
        for state in &mut self.states {
            let kept = libm::exp(-1.0 / samples);
            *state = kept * *state + libm::sqrt(1.0 - kept * kept) * self.noise.normal();
            sum += *state;
            samples *= 4.0;
        }
        sum / libm::sqrt(PROCESSES as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the colour: means over windows of a 1/f noise hardly shrink, of a white one as 1/√n.
    #[test]
    fn its_means_shrink_slowly() {
        let mut own = Flicker::new(Noise::new(1, 0));
        let series: Vec<f64> = (0..1 << 18).map(|_| own.normal()).collect();
        let variance = |window: usize| {
            let means = series
                .chunks_exact(window)
                .map(|own| own.iter().sum::<f64>() / window as f64);
            means.clone().map(|mean| mean * mean).sum::<f64>() / means.count() as f64
        };
        assert!((variance(1) - 1.0).abs() < 0.3, "{}", variance(1));
        for window in [4, 64, 1024] {
            let ratio = variance(4 * window) / variance(window);
            assert!((0.55..0.95).contains(&ratio), "{window}: {ratio}, white 0.25");
        }
    }
}
