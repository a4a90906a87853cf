//! A measured run made ready for a model: what drives it, in which state it finds the material, and what is compared.
//!
//! **Drive.** The command where there is one; else the measured field, made fit for a rate-independent model, which takes every sign
//! change of a noisy dH for a reversal: over time through a play of three standard deviations of its noise, in a sweep (the whole of
//! which is known) as the monotone sequence between its turns ([`sweep::monotone_between_turns`]).
//! **Start.** [`Start`]: a statement about the measurement, not about the material.
//! **Channels.** Measured field beside a command, displacement, strain, magnetization, each with its noise. The zero of strain and
//! magnetization is the instrument's; that of a displacement is the model's, unless there is no time or the caller says otherwise.

use std::ops::Range;

use anhyst_measured::{MeasuredRun, NoiseFloor, OUTPUTS, Quantity, noise_floor, rests, sweep};
use anhyst_model::{ActuatorModel, ActuatorOutputs, Drive, MagneticState, Magnetostriction, Play};

use crate::error::IdentifyError;

/// Samples of a sweep without time are taken for this far apart: only rates per sample matter then.
pub const SWEEP_TICK_S: f64 = 1e-3;
/// Half width of the play in standard deviations of the field's noise.
const PLAY_DEVIATIONS: f64 = 3.0;
/// A sweep whose ends differ by less than this share of its range is closed.
const CLOSURE: f64 = 0.01;
/// A field whose middle is below this share of its range goes as far either way.
const SYMMETRIC: f64 = 0.05;
/// A first drive below this share of the largest is none.
const DRIVEN: f64 = 0.02;

/// Where a run finds its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Over time: demagnetised, and in equilibrium with the first sample.
    Demagnetised,
    /// Over time: demagnetised and undriven before the first sample, which already has a drive. Rows cut out of a file begin in the
    /// middle of a motion; a file that begins with a drive found the actuator at rest.
    Undriven,
    /// A closed sweep: run twice from this state, the second time compared. A field that goes as far either way makes its loop
    /// from the demagnetised state; of any other the first magnetization tells on which of many loops it is.
    Cycled(MagneticState),
    /// An open sweep whose magnetization was measured: its own first sample, less the instrument's zero where a field that goes as
    /// far either way tells it (the middle of M). One sample with the instrument's noise: a guess for who fits it.
    Magnetized(MagneticState),
    /// An open sweep of nothing but strain or displacement: from zero to the end of the sweep's own field opposite to where it begins
    /// to go, and from there to its first value.
    FarEnd,
}

/// What was measured of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedChannel {
    /// Field (beside a command), displacement, strain or magnetization.
    pub quantity: Quantity,
    /// SI units, sample by sample.
    pub measured: Vec<f64>,
    /// The zero is the instrument's own: to be fitted.
    pub free_zero: bool,
}

impl PreparedChannel {
    /// How loud the measurement itself is; `rests` are the run's. None for fewer than [`anhyst_measured::MIN_NOISE_SAMPLES`] samples.
    pub fn noise(&self, rests: &[Range<usize>]) -> Option<NoiseFloor> {
        noise_floor(&self.measured, rests)
    }
}

/// A run made ready.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedRun {
    /// Where the data come from.
    pub source: String,
    /// Time of each sample, s; none for a sweep.
    pub time_s: Option<Vec<f64>>,
    /// Between samples, s; none for a sweep.
    pub tick_s: Option<f64>,
    /// Command, or measured field made fit for a model, A/m.
    pub drive_a_per_m: Vec<f64>,
    /// Which of the two.
    pub drive: Drive,
    /// Measured temperature of the rod, K.
    pub temperature_k: Option<Vec<f64>>,
    /// Measured force on the tip, N.
    pub force_n: Option<Vec<f64>>,
    /// Where it finds the material.
    pub start: Start,
    /// Samples at the beginning that are simulated and not compared.
    pub settling_rows: usize,
    /// Stretches in which every command stands still.
    pub rests: Vec<Range<usize>>,
    /// Samples that the recorder lost and the reader filled in.
    pub filled: Vec<usize>,
    /// All that can be compared with a model.
    pub channels: Vec<PreparedChannel>,
    /// What was decided on the way, in sentences.
    pub notes: Vec<String>,
}

/// How a run is made ready.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrepareOptions {
    /// The first seconds are simulated and not compared: a start from an unknown state.
    pub settle_s: f64,
    /// The zero of a displacement is the instrument's too.
    pub free_zero: bool,
    /// Retreat of a sweep's field that counts as a reversal, as a share of its range.
    pub reversal_threshold: f64,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        PrepareOptions {
            settle_s: 0.0,
            free_zero: false,
            reversal_threshold: sweep::DEFAULT_THRESHOLD,
        }
    }
}

impl PreparedRun {
    /// Makes a run ready.
    ///
    /// # Errors
    /// A run without field or command, or with nothing left to compare after the settling.
    pub fn of(run: &MeasuredRun, options: &PrepareOptions) -> Result<Self, IdentifyError> {
        let mut notes: Vec<String> = run.repair.iter().map(ToString::to_string).collect();
        let (drive_a_per_m, drive) = driven(run, options, &mut notes)?;
        let channel = |quantity: Quantity| {
            let of_instrument = matches!(
                quantity,
                Quantity::Strain | Quantity::Magnetization | Quantity::FluxDensity
            );
            let free = of_instrument || options.free_zero || run.tick_s.is_none();
            Some(PreparedChannel {
                quantity,
                measured: run.series(quantity)?.to_vec(),
                free_zero: quantity != Quantity::Field && free,
            })
        };
        let beside = (drive == Drive::Command).then_some(Quantity::Field);
        let outputs = [
            Quantity::Displacement,
            Quantity::Strain,
            Quantity::Magnetization,
            Quantity::FluxDensity,
        ];
        let series = |quantity: Quantity| run.series(quantity).map(<[f64]>::to_vec);
        Ok(PreparedRun {
            source: run.source.clone(),
            time_s: run.tick_s.and(run.time_s.clone()),
            tick_s: run.tick_s,
            start: start(run, &drive_a_per_m, &mut notes),
            drive_a_per_m,
            drive,
            temperature_k: series(Quantity::Temperature),
            force_n: series(Quantity::Force),
            settling_rows: settling_rows(run, options.settle_s)?,
            rests: rests(run),
            filled: run
                .repair
                .as_ref()
                .map_or_else(Vec::new, |repair| repair.filled.clone()),
            channels: beside.into_iter().chain(outputs).filter_map(channel).collect(),
            notes,
        })
    }

    /// The same over time with a sample between every two, to which everything that drives it goes straight.
    pub fn with_half_ticks(&self) -> Self {
        let between = |series: &Vec<f64>| {
            let pairs = series.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
            pairs.chain(series.last().copied()).collect::<Vec<f64>>()
        };
        PreparedRun {
            time_s: self.time_s.as_ref().map(between),
            tick_s: self.tick_s.map(|tick_s| 0.5 * tick_s),
            drive_a_per_m: between(&self.drive_a_per_m),
            temperature_k: self.temperature_k.as_ref().map(between),
            force_n: self.force_n.as_ref().map(between),
            ..self.clone()
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.drive_a_per_m.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.drive_a_per_m.is_empty()
    }

    /// What was measured of a quantity.
    pub fn channel(&self, quantity: Quantity) -> Option<&PreparedChannel> {
        self.channels.iter().find(|channel| channel.quantity == quantity)
    }

    /// The output that a model is compared with: displacement where it has a rod, else magnetization or strain.
    ///
    /// # Errors
    /// A run that has none of them.
    pub fn output(&self, model: &ActuatorModel) -> Result<&PreparedChannel, IdentifyError> {
        let wanted = match law_output(model) {
            Some(only) => vec![only],
            None => vec![Quantity::Displacement, Quantity::Magnetization, Quantity::Strain],
        };
        let usable = |quantity: &Quantity| match quantity {
            Quantity::Displacement => model.rod.is_some() || model.material.law.is_some(),
            Quantity::Strain => model.material.magnetostriction != Magnetostriction::Unmeasured,
            _ => true,
        };
        let mut channels = wanted.into_iter().filter(usable).filter_map(|own| self.channel(own));
        channels.next().ok_or_else(|| {
            let present: Vec<&str> = self.channels.iter().map(|own| own.quantity.name()).collect();
            IdentifyError::NoOutput {
                source_of_data: self.source.clone(),
                model: model.name.clone(),
                present: if present.is_empty() {
                    "none".to_owned()
                } else {
                    present.join(", ")
                },
            }
        })
    }
}

/// What a law in place of the domain wall's gives, by its unit; none where there is none.
pub fn law_output(model: &ActuatorModel) -> Option<Quantity> {
    let law = model.material.law.as_ref()?;
    OUTPUTS.into_iter().find(|quantity| quantity.unit() == law.output_unit)
}

/// The series of a simulated run that stands for a measured quantity; none for one that the model has not.
pub fn simulated<'a>(model: &ActuatorModel, outputs: &'a ActuatorOutputs, quantity: Quantity) -> Option<&'a [f64]> {
    let other = law_output(model).is_some_and(|own| own != quantity && quantity != Quantity::Field);
    Some(match quantity {
        _ if other => return None,
        Quantity::Field => &outputs.field_a_per_m,
        Quantity::FluxDensity if model.material.law.is_some() => &outputs.magnetization_a_per_m,
        Quantity::Magnetization => &outputs.magnetization_a_per_m,
        // Without a rod the sensor's end is that of a bar one metre long.
        Quantity::Strain if model.rod.is_some() => &outputs.strain,
        Quantity::Displacement | Quantity::Strain => &outputs.displacement_m,
        _ => return None,
    })
}

fn driven(
    run: &MeasuredRun,
    options: &PrepareOptions,
    notes: &mut Vec<String>,
) -> Result<(Vec<f64>, Drive), IdentifyError> {
    if let Some(command) = run.series(Quantity::FieldCommand) {
        return Ok((command.to_vec(), Drive::Command));
    }
    let Some(field) = run.series(Quantity::Field) else {
        return Err(IdentifyError::NoDrive {
            source_of_data: run.source.clone(),
        });
    };
    if run.tick_s.is_none() {
        let monotone = sweep::monotone_between_turns(field, options.reversal_threshold);
        return Ok((monotone, Drive::CoilField));
    }
    let width = PLAY_DEVIATIONS * run.noise(Quantity::Field).map_or(0.0, |floor| floor.rms);
    if width > 0.0 {
        notes.push(format!(
            "no command: driven by the measured field through a play of {width:.2} A/m, three times its noise"
        ));
    }
    let mut play = Play::new(width)?;
    Ok((
        field.iter().map(|value| play.follow(*value)).collect(),
        Drive::CoilField,
    ))
}

fn start(run: &MeasuredRun, drive: &[f64], notes: &mut Vec<String>) -> Start {
    let first = drive.first().copied().unwrap_or_default();
    if run.tick_s.is_some() {
        let largest = drive.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let whole = run.rows.first() == Some(&0);
        return if whole && first.abs() > DRIVEN * largest {
            Start::Undriven
        } else {
            Start::Demagnetised
        };
    }
    let magnetization = run.series(Quantity::Magnetization);
    let (low, high) = sweep::extremes(drive);
    let symmetric = (low + high).abs() < 2.0 * SYMMETRIC * (high - low);
    let measured = |zero: f64| MagneticState {
        field_a_per_m: first,
        magnetization_a_per_m: magnetization.map_or(0.0, |own| own[0] - zero),
    };
    let (start, how) = match magnetization {
        _ if closes(drive) && magnetization.is_none_or(closes) => {
            let from = match magnetization {
                Some(_) if !symmetric => measured(0.0),
                _ => MagneticState::default(),
            };
            (
                Start::Cycled(from),
                "closed, so it is run twice and compared the second time",
            )
        }
        Some(own) => {
            let (low, high) = sweep::extremes(own);
            let zero = if symmetric { 0.5 * (low + high) } else { 0.0 };
            (
                Start::Magnetized(measured(zero)),
                "open, so it begins at its first magnetization",
            )
        }
        None => (
            Start::FarEnd,
            "open, so its material comes from the opposite end of its field",
        ),
    };
    notes.push(format!("no time: a quasi-static sweep, {how}"));
    start
}

/// A series that ends where it began.
pub fn closes(series: &[f64]) -> bool {
    let (low, high) = sweep::extremes(series);
    match (series.first(), series.last()) {
        (Some(first), Some(last)) => (first - last).abs() < CLOSURE * (high - low),
        _ => false,
    }
}

fn settling_rows(run: &MeasuredRun, settle_s: f64) -> Result<usize, IdentifyError> {
    let refuse = |why: String| {
        Err(IdentifyError::Settle {
            source_of_data: run.source.clone(),
            settle_s,
            why,
        })
    };
    let Some(time_s) = run.tick_s.and(run.time_s.as_ref()) else {
        return if settle_s > 0.0 {
            refuse("is for runs over time, and this one has none".into())
        } else {
            Ok(0)
        };
    };
    let begin_s = time_s.first().copied().unwrap_or_default();
    let settling = time_s.iter().take_while(|time_s| **time_s - begin_s < settle_s).count();
    if settling < time_s.len() {
        Ok(settling)
    } else {
        refuse(format!(
            "leaves nothing of {:.3} s to compare",
            time_s.last().copied().unwrap_or_default() - begin_s
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what a diagnosis takes for the error of its ticks: between the same samples everything goes straight.
    #[test]
    fn half_ticks_lie_between_the_samples() {
        let series = vec![
            (Quantity::FieldCommand, vec![0.0, 2.0, -4.0]),
            (Quantity::Temperature, vec![293.0, 294.0, 296.0]),
            (Quantity::Displacement, vec![0.0, 1e-6, 2e-6]),
        ];
        let run = MeasuredRun::in_memory("three rows", Some(1e-4), series).unwrap();
        let halved = PreparedRun::of(&run, &PrepareOptions::default())
            .unwrap()
            .with_half_ticks();
        assert_eq!(halved.tick_s, Some(5e-5));
        assert_eq!(halved.drive_a_per_m, [0.0, 1.0, 2.0, -1.0, -4.0]);
        assert_eq!(halved.temperature_k, Some(vec![293.0, 293.5, 294.0, 295.0, 296.0]));
    }
}
