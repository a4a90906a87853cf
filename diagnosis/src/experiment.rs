//! Which drive would separate explanations that tie? The one that puts their predictions furthest apart.
//!
//! Distance of two models under a drive: rms over its rows of their outputs' difference over the noise (and of the coil
//! field's, where that is measured). For several models the smallest distance of any two counts, and the drive with the largest
//! such distance is advised (T-optimal design over a fixed menu; Atkinson and Fedorov 1975).

use anhyst_model::{Actuator, ActuatorInputs, ActuatorModel, ActuatorOutputs, DriveSignal};
use serde::{Deserialize, Serialize};

use crate::statistics::rms;
use anhyst_identify::parallel;

/// Below this distance (noises, rms) a drive separates nothing in practice.
const SEPARATES: f64 = 0.1;

/// Stands in an experiment's scenario for the file of the rig's own.
const RIG: &str = "YOUR_RIG.ron";

/// The advice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    pub drive: Option<DriveSignal>,
    pub duration_s: f64,
    /// Smallest distance of any two explanations under it, in noises rms.
    pub distance: f64,
    pub advice: String,
    /// The same as a scenario, derived from one of the rig it is for: the inverse sends the drive, whatever is demanded.
    pub scenario: String,
}

fn sentence(drive: &DriveSignal) -> String {
    match *drive {
        DriveSignal::Triangle { period_s, .. } => format!("slow triangles ({period_s} s) through the whole range"),
        DriveSignal::Sweep { from_hz, to_hz, .. } => format!("a sweep from {from_hz} to {to_hz:.0} Hz"),
        DriveSignal::Staircase { hold_s, .. } => format!("a staircase with holds of {hold_s} s"),
        DriveSignal::Sine {
            frequency_hz,
            offset_a_per_m,
            ..
        } => format!("a small sine ({frequency_hz} Hz) about a bias of {offset_a_per_m:.0} A/m"),
        DriveSignal::Growing { frequency_hz, .. } => format!("loops growing from zero at {frequency_hz} Hz"),
        _ => "one step and a long rest".to_owned(),
    }
}

/// Drives within the amplitude and below the highest frequency, each with its duration in s.
fn menu(amplitude_a_per_m: f64, highest_hz: f64) -> Vec<(DriveSignal, f64)> {
    let fast = |frequency_hz: f64| frequency_hz.min(highest_hz);
    let sweep = |share: f64, from_hz: f64, to_hz: f64| DriveSignal::Sweep {
        amplitude_a_per_m: share * amplitude_a_per_m,
        from_hz,
        to_hz: fast(to_hz),
        duration_s: 4.0,
    };
    let biased = |share: f64, frequency_hz: f64| DriveSignal::Sine {
        amplitude_a_per_m: 0.2 * amplitude_a_per_m,
        frequency_hz: fast(frequency_hz),
        offset_a_per_m: share * amplitude_a_per_m,
        rise_s: 0.1,
    };
    let triangle = DriveSignal::Triangle {
        amplitude_a_per_m,
        period_s: 2.0,
    };
    let staircase = DriveSignal::Staircase {
        amplitude_a_per_m,
        steps: 4,
        hold_s: 0.5,
    };
    let growing = DriveSignal::Growing {
        amplitude_a_per_m,
        frequency_hz: 5.0,
        duration_s: 4.0,
    };
    let step_and_rest = DriveSignal::Ramp {
        from_a_per_m: 0.0,
        to_a_per_m: amplitude_a_per_m,
        duration_s: 0.02,
    };
    vec![
        (triangle, 4.0),
        (sweep(0.5, 1.0, 400.0), 4.0),
        (sweep(0.15, 10.0, 2000.0), 4.0),
        (staircase, 8.0),
        (biased(0.6, 50.0), 4.0),
        (biased(-0.6, 300.0), 4.0),
        (growing, 4.0),
        (step_and_rest, 10.0),
    ]
}

/// What the explanations are compared on.
pub(crate) struct Comparison<'a> {
    /// With each of the tied explanations.
    pub models: &'a [ActuatorModel],
    pub names: &'a [String],
    pub amplitude_a_per_m: f64,
    /// None for a sweep without time.
    pub tick_s: Option<f64>,
    pub output_noise: f64,
    /// Where the coil field is measured.
    pub field_noise: Option<f64>,
    pub threads: usize,
}

pub(crate) fn advise(comparison: &Comparison) -> Option<Experiment> {
    let tick_s = comparison.tick_s.unwrap_or(1e-3);
    let menu = menu(comparison.amplitude_a_per_m, 0.1 / tick_s);
    let distances = parallel::map(comparison.threads, &menu, |(drive, duration_s)| {
        distance(comparison, drive, *duration_s, tick_s)
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
            sentence(&drive)
        ),
        scenario: scenario(&names, duration_s, &text),
    })
}

/// A derived scenario; [`Experiment::for_rig`] says of which.
fn scenario(names: &str, duration_s: f64, drive: &str) -> String {
    format!(
        "// Separates {names}. The drive goes to the amplifier through the guard; nothing is tracked, so no tolerance holds.\n(\n    \
         based_on: \"{RIG}\",\n    name: \"experiment\",\n    set: {{\n        \"duration_s\": \"{duration_s:?}\",\n        \
         \"inverse.drive\": \"{drive}\",\n        \"expect.tolerance_m\": \"None\",\n    }},\n)\n"
    )
}

impl Experiment {
    /// The scenario, derived from the given one of the rig.
    pub fn for_rig(&self, scenario: &str) -> String {
        self.scenario.replace(RIG, scenario)
    }
}

fn distance(comparison: &Comparison, drive: &DriveSignal, duration_s: f64, tick_s: f64) -> f64 {
    let rows = (duration_s / tick_s) as usize;
    let commands: Vec<f64> = (0..rows).map(|row| drive.field_a_per_m(row as f64 * tick_s)).collect();
    let simulated = |model: &ActuatorModel| {
        let mut actuator = match comparison.tick_s {
            Some(tick_s) => Actuator::new(model, tick_s),
            None => Actuator::quasi_static(model),
        }
        .ok()?;
        let mut outputs = ActuatorOutputs::default();
        actuator.run(ActuatorInputs::commands(&commands), &mut outputs).ok()?;
        Some(outputs)
    };
    let Some(outputs) = comparison.models.iter().map(simulated).collect::<Option<Vec<_>>>() else {
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
