//! What is said of the tip: a pure delay, a wrong scale, a limit, noise, and steps.

use crate::noise::Noise;
use std::collections::VecDeque;

/// A displacement sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Pure delay, s.
    pub delay_s: f64,
    /// The scale is off by this share.
    pub relative_gain: f64,
    /// Beyond it the sensor says only this, m.
    pub limit_m: f64,
    /// White noise, rms, m.
    pub noise_m: f64,
    /// Step, m.
    pub resolution_m: f64,
}

impl Sensor {
    /// 20 nm rms in steps of 1 nm.
    pub const GOOD: Sensor = Sensor {
        delay_s: 0.0,
        relative_gain: 0.0,
        limit_m: f64::INFINITY,
        noise_m: 20e-9,
        resolution_m: 1e-9,
    };

    /// What it says of the way until now, whose points are `substep_s` apart.
    pub fn measure(&self, way: &VecDeque<f64>, substep_s: f64, noise: &mut Noise) -> f64 {
        let (back, last) = (self.delay_s / substep_s, way.len() - 1);
        // Between two points a straight line; before the first one, at rest.
        let point = |steps: usize| last.checked_sub(steps).map_or(0.0, |index| way[index]);
        let (near, far) = (point(back as usize), point(back as usize + 1));
        let seen = near + (far - near) * back.fract();
        let scaled = (seen * (1.0 + self.relative_gain)).clamp(-self.limit_m, self.limit_m);
        let noisy = scaled + self.noise_m * noise.normal();
        (noisy / self.resolution_m).round() * self.resolution_m
    }

    /// So many points of the way are needed.
    pub fn memory(&self, substep_s: f64) -> usize {
        (self.delay_s / substep_s) as usize + 2
    }
}
