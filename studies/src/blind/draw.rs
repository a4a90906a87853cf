//! Uniform draws from a seed, the same on every machine.

use anhyst_model::Noise;

/// A stream of draws.
pub(super) struct Draw(Noise);

impl Draw {
    /// Streams of one seed are independent of each other.
    pub fn new(seed: u64, stream: u64) -> Self {
        Draw(Noise::new(seed, stream))
    }

    /// Between 0 and 1.
    pub fn unit(&mut self) -> f64 {
        // Φ of a normal number is uniform.
        0.5 * (1.0 + libm::erf(self.0.normal() / std::f64::consts::SQRT_2))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in the logarithm.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.between(libm::log(low), libm::log(high)))
    }

    pub fn one_of<T: Copy>(&mut self, items: &[T]) -> T {
        items[((self.unit() * items.len() as f64) as usize).min(items.len() - 1)]
    }
}
