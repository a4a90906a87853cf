//! measured = round((true + σ·n)/q)·q: additive white noise, then quantisation.
//!
//! σ noise (rms) and q resolution in the unit of what is measured; n standard normal. q = 0 switches quantisation off, σ = 0 noise.
//! Assumptions: no dynamics, no drift (those are effects of their own).
//! Noise is reproducible: ChaCha with 8 rounds keyed by the scenario's seed, one stream per sensor, Box-Muller with `libm`.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require_not_negative};

/// Standard normal numbers, the same for the same seed and stream on every machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    generator: ChaCha8Rng,
    /// Box-Muller makes two at a time.
    spare: Option<f64>,
}

impl Noise {
    /// Streams of one seed are independent of each other.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut generator = ChaCha8Rng::from_seed(key);
        generator.set_stream(stream);
        Noise { generator, spare: None }
    }

    /// Uniform in (0, 1], in steps of 2⁻⁵³.
    fn uniform(&mut self) -> f64 {
        const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
        ((self.generator.next_u64() >> 11) + 1) as f64 * STEP
    }

    /// Next standard normal number.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(self.uniform()));
        let (sine, cosine) = libm::sincos(2.0 * std::f64::consts::PI * self.uniform());
        self.spare = Some(radius * sine);
        radius * cosine
    }
}

/// A sensor's noise and resolution, in the unit of what it measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    pub noise_rms: f64,
    /// 0: no quantisation.
    pub resolution: f64,
}

impl Sensor {
    /// What the sensor says. Draws from `noise` even at zero noise, so that switching it off shifts no other draw.
    pub fn measure(&self, true_value: f64, noise: &mut Noise) -> f64 {
        let noisy = true_value + self.noise_rms * noise.normal();
        if self.resolution > 0.0 {
            libm::rint(noisy / self.resolution) * self.resolution
        } else {
            noisy
        }
    }

    pub fn validate(&self) -> Result<(), ModelError> {
        require_not_negative(self.noise_rms, "sensor noise", "(unit of the sensor), rms")?;
        require_not_negative(self.resolution, "sensor resolution", "(unit of the sensor)")
    }
}
