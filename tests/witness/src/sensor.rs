//! What is said of the sensor's end x, from the end to the reading:
//!
//! z̈ + 2ζω ż + ω² z = ω² x,   y = x + G(z − x);   y (1 − s m), ṁ = (x²/X² − m)/τ;   y + e sin(2πy/p);   y(t − d);   (1 + g) y;   ±L.
//!
//! A light resonance between rod and sensor (gain G, ω = 2πf), a gain that sags after activity (s; X = 20 μm, τ = 0.05 s), an encoder's
//! interpolation error (e and its period p, m), a pure delay d, a wrong scale g and a limit L. The other laws: the resonance damped against
//! the rod, z̈ + 2ζω(ż − ẋ) + ω² (z − x) = 0, and a limit that is round (`amplifier.rs`).

use crate::amplifier::clipped;
use crate::hidden::Laws;
use std::f64::consts::TAU;

/// X, m, and τ, s, of the gain that sags.
const ACTIVE_M: f64 = 2e-5;
const FATIGUE_S: f64 = 0.05;

/// A light resonance between rod and sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// G; 0 is absent.
    pub gain: f64,
    pub hz: f64,
    pub damping_ratio: f64,
}

/// A displacement sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    pub mode: Mode,
    /// s.
    pub fatigue: f64,
    /// e and p, m.
    pub encoder_m: [f64; 2],
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
        mode: Mode {
            gain: 0.0,
            hz: 400.0,
            damping_ratio: 0.03,
        },
        fatigue: 0.0,
        encoder_m: [0.0, 5e-6],
        delay_s: 0.0,
        relative_gain: 0.0,
        limit_m: f64::INFINITY,
        noise_m: 20e-9,
        resolution_m: 1e-9,
    };

    /// What it would say without noise, from points of the way that are `h` seconds apart; before the first one, at rest.
    pub(crate) fn look(&self, mut way: Vec<f64>, h: f64, laws: Laws) -> Vec<f64> {
        if self.mode.gain != 0.0 {
            self.mode.shake(&mut way, h, laws);
        }
        if self.fatigue != 0.0 {
            let mut memory = 0.0;
            for x in &mut way {
                memory += h / FATIGUE_S * ((*x / ACTIVE_M).powi(2) - memory);
                *x *= 1.0 - self.fatigue * memory;
            }
        }
        let [error, period] = self.encoder_m;
        if error != 0.0 {
            way.iter_mut().for_each(|x| *x += error * (TAU * *x / period).sin());
        }
        let back = self.delay_s / h;
        let point = |place: usize, steps: usize| way[place.saturating_sub(steps)];
        (0..way.len())
            .map(|place| {
                let (near, far) = (point(place, back as usize), point(place, back as usize + 1));
                let scaled = (near + (far - near) * back.fract()) * (1.0 + self.relative_gain);
                if self.limit_m.is_finite() {
                    clipped(scaled, self.limit_m, laws)
                } else {
                    scaled
                }
            })
            .collect()
    }
}

impl Mode {
    fn shake(&self, way: &mut [f64], h: f64, laws: Laws) {
        let mut shaking = Shaking::new(*self, way[0], laws);
        way[1..].iter_mut().for_each(|x| *x = shaking.step(*x, h));
    }
}

/// A resonance as time goes by: Runge and Kutta again, the way a straight line between its points.
#[derive(Clone, Debug)]
pub struct Shaking {
    mode: Mode,
    laws: Laws,
    z: f64,
    speed: f64,
    from: f64,
}

impl Shaking {
    /// At rest at a place, m.
    pub fn new(mode: Mode, at_m: f64, laws: Laws) -> Self {
        Shaking {
            mode,
            laws,
            z: at_m,
            speed: 0.0,
            from: at_m,
        }
    }

    /// What the sensor sees `h` seconds on, the rod there being at `to`, m.
    pub fn step(&mut self, to: f64, h: f64) -> f64 {
        let Shaking {
            mode,
            laws,
            z,
            speed,
            from,
        } = *self;
        let omega = TAU * mode.hz;
        let rate = (to - from) / h;
        let against = if laws == Laws::Usual { 0.0 } else { rate };
        let pull = |share: f64, z: f64, speed: f64| {
            omega * (omega * (from + share * (to - from) - z) - 2.0 * mode.damping_ratio * (speed - against))
        };
        let (a1, v1) = (pull(0.0, z, speed), speed);
        let (a2, v2) = (pull(0.5, z + 0.5 * h * v1, speed + 0.5 * h * a1), speed + 0.5 * h * a1);
        let (a3, v3) = (pull(0.5, z + 0.5 * h * v2, speed + 0.5 * h * a2), speed + 0.5 * h * a2);
        let (a4, v4) = (pull(1.0, z + h * v3, speed + h * a3), speed + h * a3);
        self.z += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4);
        self.speed += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
        self.from = to;
        to + mode.gain * (self.z - to)
    }
}
