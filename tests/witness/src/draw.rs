//! Draws from a seed; streams of one seed are independent of each other, so that what one thing draws moves no other.

use crate::noise::Noise;

pub(crate) struct Draw(Noise);

impl Draw {
    pub fn new(seed: u64, stream: u64) -> Self {
        // Far apart even for neighbouring seeds: an odd multiplier is a bijection.
        Draw(Noise::new(
            seed.wrapping_mul(0xd134_2543_de82_ef95) ^ stream.rotate_left(40),
        ))
    }

    pub fn normal(&mut self) -> f64 {
        self.0.normal()
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.uniform()
    }

    /// Uniform in the logarithm.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn one_of<T: Copy>(&mut self, items: &[T]) -> T {
        items[((self.0.uniform() * items.len() as f64) as usize).min(items.len() - 1)]
    }

    pub fn sign(&mut self) -> f64 {
        self.one_of(&[-1.0, 1.0])
    }

    pub fn phase(&mut self) -> f64 {
        self.between(0.0, std::f64::consts::TAU)
    }
}
