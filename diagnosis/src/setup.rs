//! From measured runs and a model to channels, drives and noise.
//!
//! Compared are the output (displacement with a rod, else strain or displacement; of another law what it gives), the coil field where command and field were both
//! measured, and the magnetization where it was; what drives the model and where it finds the material: `anhyst_identify::prepared`.

use anhyst_identify::prepared::{PrepareOptions, PreparedRun, law_output};
use anhyst_model::{ActuatorModel, Drive, Effect, EffectKind};

use crate::channel::{Channel, ChannelKind};
use crate::error::DiagnosisError;
use crate::plant::{Memory, Plant};
use crate::spectrum::Spectrum;
use anhyst_measured::MeasuredRun;
use anhyst_measured::Quantity;

/// How the source of a model begins whose numbers were fitted to measurements; `anhyst fit` writes it so.
const FITTED: &str = "fitted to";
/// A lattice of more than this many noises is more than half of it: 1/√12 is all of it.
const COARSE: f64 = 2.4;
/// e^−10 of the rod's first motion is left after this many of its 1/k̂.
const TRANSIENT: f64 = 20.0;
/// Fewest rows that are compared.
const MIN_ROWS: usize = 20;
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
    /// `a` drifts while a run is made, evenly, and differently in each: standard deviation of by how much, A/m; none: it does not.
    pub shape_drift_a_per_m: Option<f64>,
}

pub(crate) fn setup(
    model: &ActuatorModel,
    runs: &[MeasuredRun],
    options: &DiagnoseOptions,
) -> Result<Plant, DiagnosisError> {
    let Some(first) = runs.first() else {
        return Err(refusal("there is no run to diagnose"));
    };
    let output = output_of(model, first)?;
    let (mut inputs, mut channels, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    let (mut lattice, mut from) = (None, 0);
    for (number, run) in runs.iter().enumerate() {
        let prepared = PreparedRun::of(
            run,
            &PrepareOptions {
                settle_s: options.settle_s,
                ..PrepareOptions::default()
            },
        )?;
        let mut compared = Vec::new();
        if prepared.drive == Drive::Command
            && let Some(field) = run.series(Quantity::Field)
        {
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
        let magnetic = matches!(output, Quantity::Magnetization | Quantity::FluxDensity);
        if !magnetic
            && model.material.law.is_none()
            && let Some(magnetization) = run.series(Quantity::Magnetization)
        {
            compared.push((ChannelKind::Magnetization, Quantity::Magnetization, magnetization));
        }
        let settling = run.tick_s.map_or(0, |tick_s| {
            // However the tip moved before the first row, it has forgotten.
            let transient_s = model.rod.map_or(0.0, |rod| TRANSIENT / rod.damping_per_s);
            let transient = ((transient_s / tick_s).ceil() as usize).min(run.len() / 50);
            let settling = prepared.settling_rows.max(transient);
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
        inputs.push(prepared);
    }
    let plant = Plant {
        memory: Memory::of(inputs.len(), channels.len()),
        model: with_slow_creep(model, &inputs),
        whole: inputs
            .iter()
            .map(|run| Spectrum::new(run.drive_a_per_m.len()))
            .collect(),
        runs: inputs,
        channels,
        measured,
        output,
        fitted: options.fitted_model || model.source.starts_with(FITTED),
        shape_drift_a_per_m: options.shape_drift_a_per_m,
        lattice,
        halved: false,
    };
    Ok(plant)
}

fn refusal(sentence: &str) -> DiagnosisError {
    DiagnosisError::NoDiagnosis {
        sentence: sentence.to_owned(),
    }
}

fn output_of(model: &ActuatorModel, run: &MeasuredRun) -> Result<Quantity, DiagnosisError> {
    let only = law_output(model);
    let wanted: &[Quantity] = match &only {
        Some(only) => std::slice::from_ref(only),
        None if model.rod.is_some() => &[Quantity::Displacement, Quantity::Magnetization],
        None => &[Quantity::Strain, Quantity::Displacement, Quantity::Magnetization],
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

/// Creep of long runs is given time constants up to the run's length.
fn with_slow_creep(model: &ActuatorModel, runs: &[PreparedRun]) -> ActuatorModel {
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
