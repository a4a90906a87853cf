//! From measured runs and a model to channels, drives and noise.
//!
//! A run is driven by its field command; where it has none, by its measured field through a play of 3σ. Compared are the output
//! (displacement with a rod, else strain or displacement), the coil field where command and field were both measured, and the
//! magnetization where it was. The zero of strain and magnetization is the instrument's; that of a displacement is the model's,
//! unless the run has no time or the model was itself fitted to measurements.

use anhyst_identify::prepared::closes;
use anhyst_model::{ActuatorModel, Drive, Effect, EffectKind, MagneticState, Play};

use crate::error::DiagnosisError;
use crate::plant::{Channel, ChannelKind, Plant, RunInputs};
use crate::spectrum::Spectrum;
use anhyst_measured::MeasuredRun;
use anhyst_measured::Quantity;

/// How the source of a model begins whose numbers were fitted to measurements; `anhyst fit` writes it so.
const FITTED: &str = "fitted to";
/// A lattice of more than this many noises is more than half of it: 1/√12 is all of it.
const COARSE: f64 = 2.4;
/// A first drive below this share of the largest is none.
const DRIVEN: f64 = 0.02;
/// A field whose middle is below this share of its span goes as far either way.
const SYMMETRIC: f64 = 0.05;
/// e^−10 of the rod's first motion is left after this many of its 1/k̂.
const TRANSIENT: f64 = 20.0;
/// Fewest rows that are compared.
const MIN_ROWS: usize = 20;
/// Half width of the play, in standard deviations of the field's noise.
const PLAY_DEVIATIONS: f64 = 3.0;
/// Runs longer than this (s) show creep slower than the library's usual three time constants.
const LONG_RUN_S: f64 = 10.0;
/// Their creep: time constants from and to these shares of the run. Faster creep is part of a cycle's shape.
const SHORTEST: f64 = 0.03;
const LONGEST: f64 = 3.0;

/// How to diagnose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiagnoseOptions {
    /// 0: as many as the machine runs side by side.
    pub threads: usize,
    /// The model's numbers were fitted to measurements, so they carry its errors: the instrument's zero is free, and effects are
    /// sought beside calibrated parameters.
    pub fitted_model: bool,
    /// The first seconds are simulated and not compared: a start from an unknown state.
    pub settle_s: f64,
}

/// A plant with what was measured on it.
pub(crate) struct Setup {
    pub plant: Plant,
    pub output: Quantity,
    /// Step on which the output's values stand, where its rounding is the larger part of the noise.
    pub lattice: Option<f64>,
}

pub(crate) fn setup(
    model: &ActuatorModel,
    runs: &[MeasuredRun],
    options: &DiagnoseOptions,
) -> Result<Setup, DiagnosisError> {
    let Some(first) = runs.first() else {
        return Err(refusal("there is no run to diagnose"));
    };
    let output = output_of(model, first)?;
    let (mut inputs, mut channels, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    let (mut lattice, mut from) = (None, 0);
    for (number, run) in runs.iter().enumerate() {
        let (input, has_command) = inputs_of(run)?;
        let mut compared = Vec::new();
        if has_command && let Some(field) = run.series(Quantity::Field) {
            compared.push((ChannelKind::Field, Quantity::Field, field));
        }
        let Some(own) = run.series(output) else {
            return Err(refusal(&format!(
                "{}: has no {}, which the first run has",
                run.source,
                output.name()
            )));
        };
        compared.push((ChannelKind::Output, output, own));
        if output != Quantity::Magnetization
            && let Some(magnetization) = run.series(Quantity::Magnetization)
        {
            compared.push((ChannelKind::Magnetization, Quantity::Magnetization, magnetization));
        }
        let settling = run.tick_s.map_or(0, |tick_s| {
            // However the tip moved before the first row, it has forgotten.
            let transient_s = model.rod.map_or(0.0, |rod| TRANSIENT / rod.damping_per_s);
            let transient = ((transient_s / tick_s).ceil() as usize).min(run.len() / 50);
            let settling = ((options.settle_s / tick_s) as usize).max(transient);
            run.len() - Spectrum::quick_length(run.len().saturating_sub(settling))
        });
        if run.len() < settling + MIN_ROWS {
            return Err(refusal(&format!(
                "{}: {} rows are left after settling, {MIN_ROWS} are needed",
                run.source,
                run.len().saturating_sub(settling)
            )));
        }
        for (kind, quantity, series) in compared {
            let floor = run.noise(quantity);
            let resolution = floor.and_then(|own| own.resolution).unwrap_or(0.0);
            if kind == ChannelKind::Output {
                let coarse = floor.is_some_and(|floor| resolution > COARSE * floor.rms);
                lattice = lattice.or(coarse.then_some(resolution));
            }
            let span = span(series);
            let rows = settling..series.len();
            channels.push(Channel {
                run: number,
                kind,
                places: from..from + rows.len(),
                spectrum: Spectrum::new(rows.len()),
                noise_rms: floor.map_or(1e-3 * span, |floor| floor.rms).max(1e-9 * span),
                resolution,
                rows: rows.clone(),
            });
            from += rows.len();
            measured.push(series[rows].to_vec());
        }
        inputs.push(input);
    }
    let plant = Plant {
        model: prepared(model, &inputs),
        runs: inputs,
        channels,
        measured,
        magnetic: output == Quantity::Magnetization,
        fitted: options.fitted_model || model.source.starts_with(FITTED),
    };
    Ok(Setup { plant, output, lattice })
}

fn refusal(sentence: &str) -> DiagnosisError {
    DiagnosisError::NoDiagnosis {
        sentence: sentence.to_owned(),
    }
}

fn output_of(model: &ActuatorModel, run: &MeasuredRun) -> Result<Quantity, DiagnosisError> {
    let wanted: &[Quantity] = if model.rod.is_some() {
        &[Quantity::Displacement, Quantity::Magnetization]
    } else {
        &[Quantity::Strain, Quantity::Displacement, Quantity::Magnetization]
    };
    wanted
        .iter()
        .copied()
        .find(|quantity| run.series(*quantity).is_some())
        .ok_or_else(|| {
            let names: Vec<&str> = wanted.iter().map(|quantity| quantity.name()).collect();
            refusal(&format!(
                "{}: the model \"{}\" predicts {}, and the run has no such column. Name one with --column {}=HEADER",
                run.source,
                model.name,
                names.join(" or "),
                wanted[0].key()
            ))
        })
}

/// What drives the model, and whether that is the command.
fn inputs_of(run: &MeasuredRun) -> Result<(RunInputs, bool), DiagnosisError> {
    let series = |quantity: Quantity| run.series(quantity).map(<[f64]>::to_vec);
    let (drive_a_per_m, drive) = match (series(Quantity::FieldCommand), series(Quantity::Field)) {
        (Some(command), _) => (command, Drive::Command),
        (None, Some(field)) => (played(run, &field)?, Drive::CoilField),
        (None, None) => {
            return Err(refusal(&format!(
                "{}: has neither a field command nor a field. Name what drove the actuator as one of them, with its field per \
                 unit, as in --column command=HEADER*1000",
                run.source
            )));
        }
    };
    let start = match (run.tick_s, run.series(Quantity::Magnetization)) {
        // The sweep's own first sample, unless it closes: then it is cycled. A field that goes as far either way tells the
        // instrument's zero; of another sweep the middle lies where it lies, and the instrument is believed.
        (None, Some(magnetization)) if !(closes(&drive_a_per_m) && closes(magnetization)) => Some(MagneticState {
            field_a_per_m: drive_a_per_m[0],
            magnetization_a_per_m: if middle(&drive_a_per_m).abs() < SYMMETRIC * span(&drive_a_per_m) {
                magnetization[0] - middle(magnetization)
            } else {
                magnetization[0]
            },
        }),
        _ => None,
    };
    let largest = drive_a_per_m.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let begins_driven = drive_a_per_m
        .first()
        .is_some_and(|first| first.abs() > DRIVEN * largest);
    let inputs = RunInputs {
        drive_a_per_m,
        drive,
        tick_s: run.tick_s,
        temperature_k: series(Quantity::Temperature),
        force_n: series(Quantity::Force),
        start,
        // Rows cut out of a file begin in the middle of a motion; a file that begins with a drive found the actuator at rest.
        from_rest: run.tick_s.is_some() && run.rows.first() == Some(&0) && begins_driven,
    };
    Ok((inputs, drive == Drive::Command))
}

fn played(run: &MeasuredRun, field: &[f64]) -> Result<Vec<f64>, DiagnosisError> {
    let noise_rms = run.noise(Quantity::Field).map_or(0.0, |floor| floor.rms);
    let mut play = Play::new(PLAY_DEVIATIONS * noise_rms).map_err(|error| refusal(&error.to_string()))?;
    Ok(field.iter().map(|value| play.follow(*value)).collect())
}

/// Creep of long runs is given time constants up to the run's length.
fn prepared(model: &ActuatorModel, runs: &[RunInputs]) -> ActuatorModel {
    let durations = runs
        .iter()
        .filter_map(|run| Some(run.tick_s? * run.drive_a_per_m.len() as f64));
    let longest_s = durations.fold(0.0, f64::max);
    let absent = Effect::identity(EffectKind::AfterEffect).with("longest_s", LONGEST * longest_s);
    match absent.and_then(|absent| absent.with("shortest_s", SHORTEST * longest_s)) {
        Ok(absent) if longest_s > LONG_RUN_S && model.effect(EffectKind::AfterEffect).is_none() => {
            model.clone().with_effect(absent)
        }
        _ => model.clone(),
    }
}

fn span(series: &[f64]) -> f64 {
    let low = series.iter().copied().fold(f64::INFINITY, f64::min);
    let high = series.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (high - low).max(f64::MIN_POSITIVE)
}

/// Half way between the extremes.
fn middle(series: &[f64]) -> f64 {
    let low = series.iter().copied().fold(f64::INFINITY, f64::min);
    low + 0.5 * span(series)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(field: Vec<f64>, magnetization: Vec<f64>) -> f64 {
        let series = vec![(Quantity::Field, field), (Quantity::Magnetization, magnetization)];
        let run = MeasuredRun::in_memory("sweep", None, series).unwrap();
        inputs_of(&run).unwrap().0.start.unwrap().magnetization_a_per_m
    }

    /// Guards the start of a sweep: a loop takes the instrument's zero off, a first quadrant begins where it was measured.
    #[test]
    fn a_sweep_begins_where_its_first_sample_is() {
        // Three quarters: a sweep that closes is cycled instead. Both ends of the field are among 99 samples.
        let turn = |samples: usize| (0..samples).map(move |k| 0.75 * std::f64::consts::TAU * k as f64 / samples as f64);
        let both: Vec<f64> = turn(99).map(|angle| 1e4 * angle.cos()).collect();
        let off = start(both.clone(), both.iter().map(|h| 30.0 * h + 5e3).collect());
        assert!((off - 3e5).abs() < 1.0, "{off} A/m");
        let one: Vec<f64> = turn(99).map(|angle| 1e4 * (1.0 - angle.cos())).collect();
        let own = start(one.clone(), one.iter().map(|h| 30.0 * h).collect());
        assert_eq!(own, 0.0);
    }
}
