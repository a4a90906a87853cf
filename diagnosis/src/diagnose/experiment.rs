//! Which drive would separate explanations that tie? The one that puts their predictions furthest apart.
//!
//! Distance of two models under a drive: rms over its rows of their outputs' difference over the noise (and of the coil
//! field's, where that is measured). For several models the smallest distance of any two counts, and the drive with the largest
//! such distance is advised (T-optimal design over a fixed menu; Atkinson and Fedorov 1975).

use std::f64::consts::TAU;

use anhyst_model::{ActuatorModel, Drive};
use serde::{Deserialize, Serialize};

use super::plant::{RunInputs, amended};
use super::statistics::rms;
use super::system::Setting;
use crate::parallel;

/// Below this distance (noises, rms) a drive separates nothing in practice.
const SEPARATES: f64 = 0.1;

/// A drive signal for the command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum DriveSignal {
    /// Triangle between ± the amplitude.
    Triangle { amplitude_a_per_m: f64, frequency_hz: f64 },
    /// Sine whose frequency grows by a constant ratio.
    Sweep {
        amplitude_a_per_m: f64,
        from_hz: f64,
        to_hz: f64,
    },
    /// Equal steps up and down, each held.
    Staircase {
        amplitude_a_per_m: f64,
        steps: u32,
        hold_s: f64,
    },
    /// Sine about a constant field.
    Biased {
        bias_a_per_m: f64,
        amplitude_a_per_m: f64,
        frequency_hz: f64,
    },
    /// Sine with an amplitude that grows from zero.
    Growing { amplitude_a_per_m: f64, frequency_hz: f64 },
    /// The field is put on, then nothing moves.
    StepAndRest { amplitude_a_per_m: f64 },
}

/// The advice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    pub drive: Option<DriveSignal>,
    pub duration_s: f64,
    /// Smallest distance of any two explanations under it, in noises rms.
    pub distance: f64,
    pub advice: String,
    /// The same as a snippet for a file.
    pub scenario: String,
}

impl DriveSignal {
    /// Command at a time, A/m.
    pub fn at(&self, time_s: f64, duration_s: f64) -> f64 {
        match *self {
            DriveSignal::Triangle {
                amplitude_a_per_m,
                frequency_hz,
            } => {
                let turns = time_s * frequency_hz;
                amplitude_a_per_m * (4.0 * ((turns + 0.25).fract() - 0.5).abs() - 1.0)
            }
            DriveSignal::Sweep {
                amplitude_a_per_m,
                from_hz,
                to_hz,
            } => {
                let ratio = (to_hz / from_hz).ln();
                let turns = from_hz * duration_s / ratio * ((ratio * time_s / duration_s).exp() - 1.0);
                amplitude_a_per_m * (TAU * turns).sin()
            }
            DriveSignal::Staircase {
                amplitude_a_per_m,
                steps,
                hold_s,
            } => {
                let step = (time_s / hold_s) as i64 % (4 * i64::from(steps));
                let steps = i64::from(steps);
                let level = if step <= steps {
                    step
                } else if step <= 3 * steps {
                    2 * steps - step
                } else {
                    step - 4 * steps
                };
                amplitude_a_per_m * level as f64 / steps as f64
            }
            DriveSignal::Biased {
                bias_a_per_m,
                amplitude_a_per_m,
                frequency_hz,
            } => {
                let rise = (time_s / 0.1).min(1.0);
                bias_a_per_m * rise + amplitude_a_per_m * rise * (TAU * frequency_hz * time_s).sin()
            }
            DriveSignal::Growing {
                amplitude_a_per_m,
                frequency_hz,
            } => amplitude_a_per_m * time_s / duration_s * (TAU * frequency_hz * time_s).sin(),
            DriveSignal::StepAndRest { amplitude_a_per_m } => {
                amplitude_a_per_m * ((time_s - 0.1) / 0.02).clamp(0.0, 1.0)
            }
        }
    }

    fn sentence(&self) -> String {
        match self {
            DriveSignal::Triangle { frequency_hz, .. } => {
                format!("slow triangles ({frequency_hz} Hz) through the whole range")
            }
            DriveSignal::Sweep { from_hz, to_hz, .. } => format!("a sweep from {from_hz} to {to_hz:.0} Hz"),
            DriveSignal::Staircase { hold_s, .. } => format!("a staircase with holds of {hold_s} s"),
            DriveSignal::Biased {
                bias_a_per_m,
                frequency_hz,
                ..
            } => {
                format!("a small sine ({frequency_hz} Hz) about a bias of {bias_a_per_m:.0} A/m")
            }
            DriveSignal::Growing { frequency_hz, .. } => format!("loops growing from zero at {frequency_hz} Hz"),
            DriveSignal::StepAndRest { .. } => "one step and a long rest".to_owned(),
        }
    }
}

fn menu(amplitude: f64, highest_hz: f64) -> Vec<(DriveSignal, f64)> {
    let fast = |frequency_hz: f64| frequency_hz.min(highest_hz);
    vec![
        (
            DriveSignal::Triangle {
                amplitude_a_per_m: amplitude,
                frequency_hz: 0.5,
            },
            4.0,
        ),
        (
            DriveSignal::Sweep {
                amplitude_a_per_m: 0.5 * amplitude,
                from_hz: 1.0,
                to_hz: fast(400.0),
            },
            4.0,
        ),
        (
            DriveSignal::Sweep {
                amplitude_a_per_m: 0.15 * amplitude,
                from_hz: 10.0,
                to_hz: fast(2000.0),
            },
            4.0,
        ),
        (
            DriveSignal::Staircase {
                amplitude_a_per_m: amplitude,
                steps: 4,
                hold_s: 0.5,
            },
            8.0,
        ),
        (
            DriveSignal::Biased {
                bias_a_per_m: 0.6 * amplitude,
                amplitude_a_per_m: 0.2 * amplitude,
                frequency_hz: fast(50.0),
            },
            4.0,
        ),
        (
            DriveSignal::Biased {
                bias_a_per_m: -0.6 * amplitude,
                amplitude_a_per_m: 0.2 * amplitude,
                frequency_hz: fast(300.0),
            },
            4.0,
        ),
        (
            DriveSignal::Growing {
                amplitude_a_per_m: amplitude,
                frequency_hz: 5.0,
            },
            4.0,
        ),
        (
            DriveSignal::StepAndRest {
                amplitude_a_per_m: amplitude,
            },
            10.0,
        ),
    ]
}

/// What the explanations are compared on.
pub(super) struct Comparison<'a> {
    pub model: &'a ActuatorModel,
    /// The tied explanations with their fitted values.
    pub explanations: &'a [Vec<Setting>],
    pub names: &'a [String],
    pub amplitude_a_per_m: f64,
    /// None for a sweep without time.
    pub tick_s: Option<f64>,
    pub output_noise: f64,
    /// Where the coil field is measured.
    pub field_noise: Option<f64>,
    pub threads: usize,
}

pub(super) fn advise(comparison: &Comparison) -> Option<Experiment> {
    let tick_s = comparison.tick_s.unwrap_or(1e-3);
    let models: Vec<ActuatorModel> = comparison
        .explanations
        .iter()
        .map(|settings| amended(comparison.model, settings).ok())
        .collect::<Option<_>>()?;
    let menu = menu(comparison.amplitude_a_per_m, 0.1 / tick_s);
    let distances = parallel::map(comparison.threads, &menu, |(drive, duration_s)| {
        distance(comparison, &models, drive, *duration_s, tick_s)
    });
    let (index, distance) = distances
        .iter()
        .copied()
        .enumerate()
        .max_by(|one, other| one.1.total_cmp(&other.1))?;
    let (drive, duration_s) = menu[index];
    let names = comparison.names.join(", ");
    if distance < SEPARATES {
        return Some(Experiment {
            drive: None,
            duration_s: 0.0,
            distance,
            advice: format!(
                "No drive of the menu separates {names} at this noise: it takes another sensor, such as a second reference of \
                 displacement, the coil field, flux density or force."
            ),
            scenario: String::new(),
        });
    }
    let text = ron::ser::to_string(&drive).unwrap_or_default();
    Some(Experiment {
        drive: Some(drive),
        duration_s,
        distance,
        advice: format!(
            "Drive it with {} for {duration_s} s: there {names} differ by at least {distance:.1} times the noise (rms).",
            drive.sentence()
        ),
        scenario: format!("// Separates {names}.\n(tick_s: {tick_s:e}, duration_s: {duration_s:.1}, drive: {text})"),
    })
}

fn distance(
    comparison: &Comparison,
    models: &[ActuatorModel],
    drive: &DriveSignal,
    duration_s: f64,
    tick_s: f64,
) -> f64 {
    let rows = (duration_s / tick_s) as usize;
    let run = RunInputs {
        drive_a_per_m: (0..rows).map(|row| drive.at(row as f64 * tick_s, duration_s)).collect(),
        drive: Drive::Command,
        tick_s: comparison.tick_s,
        ..RunInputs::default()
    };
    let Some(outputs) = models
        .iter()
        .map(|model| run.simulate(model).ok())
        .collect::<Option<Vec<_>>>()
    else {
        return 0.0;
    };
    let mut smallest = f64::INFINITY;
    for (index, one) in outputs.iter().enumerate() {
        for other in &outputs[..index] {
            let apart = |a: &[f64], b: &[f64]| rms(a.iter().zip(b).map(|(a, b)| a - b));
            let mut square = (apart(&one.displacement_m, &other.displacement_m) / comparison.output_noise).powi(2);
            if let Some(noise) = comparison.field_noise {
                square += (apart(&one.field_a_per_m, &other.field_a_per_m) / noise).powi(2);
            }
            smallest = smallest.min(square.sqrt());
        }
    }
    if smallest.is_finite() { smallest } else { 0.0 }
}
