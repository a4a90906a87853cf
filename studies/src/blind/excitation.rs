//! Drawn commands: loops that grow, sweeps, steps, sums of sines, and mixtures of them.
//!
//! The command is first-order smoothed (a time constant of ten samples), for real commands do not jump, and written with two decimals.

use serde::{Deserialize, Serialize};

use super::draw::Draw;

/// What drives a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Excitation {
    /// Growing loops, a sweep, steps and a sum of sines, a quarter of the run each.
    Mixture,
    /// A sine and its third harmonic.
    Cut,
    /// One sweep over the whole run.
    Sweep,
    /// Steps with a sum of sines upon them.
    Steps,
}

const TAU: f64 = std::f64::consts::TAU;
const SINES: usize = 12;
const STAIRS: [f64; 8] = [0.3, 0.8, 0.5, -0.2, -0.9, -0.4, 0.1, 0.0];
/// Share of the way to the wanted value in one sample.
const SMOOTHING: f64 = 0.1;

/// A drawn command.
pub(super) struct Command {
    pub kind: Excitation,
    pub amplitude_a_per_m: f64,
    duration_s: f64,
    base_hz: f64,
    highest_hz: f64,
    phases: [f64; SINES],
}

impl Command {
    pub fn drawn(draw: &mut Draw, duration_s: f64) -> Self {
        let kinds = [
            Excitation::Mixture,
            Excitation::Mixture,
            Excitation::Cut,
            Excitation::Sweep,
            Excitation::Steps,
        ];
        Command {
            kind: draw.one_of(&kinds),
            amplitude_a_per_m: draw.between(8e3, 18e3),
            duration_s,
            base_hz: draw.between(20.0, 60.0),
            highest_hz: draw.between(120.0, 300.0),
            phases: std::array::from_fn(|_| draw.between(0.0, TAU)),
        }
    }

    /// The command in A/m, sample by sample.
    pub fn samples(&self, rows: usize, tick_s: f64) -> Vec<f64> {
        let mut smooth = 0.0;
        (0..rows)
            .map(|row| {
                smooth += (self.value(row as f64 * tick_s) - smooth) * SMOOTHING;
                libm::rint(100.0 * self.amplitude_a_per_m * smooth) / 100.0
            })
            .collect()
    }

    fn value(&self, time_s: f64) -> f64 {
        let share = time_s / self.duration_s;
        match self.kind {
            Excitation::Mixture => self.mixture(share),
            Excitation::Cut => {
                let phase = TAU * self.base_hz * time_s;
                (libm::sin(phase) + 0.3 * libm::sin(3.0 * phase)) / 1.3 * eased(share, 10.0)
            }
            Excitation::Sweep => 0.8 * self.sweep(time_s, 1.0, self.duration_s),
            Excitation::Steps => (0.6 * stairs(share) + 0.4 * self.sines(time_s)) * eased(share, 20.0),
        }
    }

    fn mixture(&self, share: f64) -> f64 {
        let quarters = 4.0 * share;
        let within = quarters - libm::floor(quarters);
        let time_s = within * self.duration_s / 4.0;
        match quarters as usize {
            0 => within * libm::sin(TAU * 8.0 * time_s),
            1 => 0.6 * self.sweep(time_s, 2.0, self.duration_s / 4.0),
            2 => stairs(within),
            _ => 0.5 * self.sines(time_s) * eased(within, 20.0) * eased(1.0 - within, 20.0),
        }
    }

    /// A sine whose frequency grows exponentially, from `from_hz`.
    fn sweep(&self, time_s: f64, from_hz: f64, length_s: f64) -> f64 {
        let growth = libm::log(self.highest_hz / from_hz);
        libm::sin(TAU * from_hz * length_s / growth * (libm::exp(growth * time_s / length_s) - 1.0))
    }

    fn sines(&self, time_s: f64) -> f64 {
        let step_hz = self.highest_hz / SINES as f64;
        let sines = self.phases.iter().enumerate();
        sines
            .map(|(k, phase)| libm::sin(TAU * step_hz * (k + 1) as f64 * time_s + phase))
            .sum::<f64>()
            / 6.0
    }
}

/// Rises from 0 to 1 over the first 1/`rate` of a part.
fn eased(share: f64, rate: f64) -> f64 {
    (rate * share).clamp(0.0, 1.0)
}

fn stairs(share: f64) -> f64 {
    STAIRS[((share * STAIRS.len() as f64) as usize).min(STAIRS.len() - 1)]
}
