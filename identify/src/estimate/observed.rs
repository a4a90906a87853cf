//! What a measured run offers to an estimator: one drive that a rate-independent model may have, one output, its noise.
//!
//! The drive is the command through the model's amplifier where there is a command; else the measured field through a play of
//! three standard deviations of its noise, because a noisy field ratchets a rate-independent model (docs/estimate.md).

use anhyst_measured::{MeasuredRun, NoiseFloor, Quantity};
use anhyst_model::{Actuator, ActuatorInputs, ActuatorModel, ActuatorOutputs, Drive, MagneticState, Play};

use crate::error::IdentifyError;

/// Samples of a sweep without time are taken for this far apart: only rates per sample matter then.
pub const SWEEP_TICK_S: f64 = 1e-3;
/// Width of the play in standard deviations of the field's noise.
const PLAY_DEVIATIONS: f64 = 3.0;
/// Points of the way on which a sweep's material is brought to its first field.
const APPROACH: usize = 400;

/// Which series is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Of the tip, m.
    Displacement,
    /// Without unit.
    Strain,
    /// A/m.
    Magnetization,
}

impl Output {
    /// Its column.
    pub fn quantity(self) -> Quantity {
        match self {
            Output::Displacement => Quantity::Displacement,
            Output::Strain => Quantity::Strain,
            Output::Magnetization => Quantity::Magnetization,
        }
    }

    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Output::Displacement => "displacement",
            Output::Strain => "strain",
            Output::Magnetization => "magnetization",
        }
    }

    /// SI.
    pub fn unit(self) -> &'static str {
        match self {
            Output::Displacement => "m",
            Output::Strain => "",
            Output::Magnetization => "A/m",
        }
    }

    /// The series of a simulated run.
    pub fn of(self, outputs: &ActuatorOutputs) -> &[f64] {
        match self {
            Output::Displacement => &outputs.displacement_m,
            Output::Strain => &outputs.strain,
            Output::Magnetization => &outputs.magnetization_a_per_m,
        }
    }
}

/// A run made ready.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Time of each sample, s; none for a sweep.
    pub time_s: Option<Vec<f64>>,
    /// Between samples, s.
    pub tick_s: f64,
    /// Command or field in the coil, A/m.
    pub drive_a_per_m: Vec<f64>,
    /// Which of the two.
    pub drive: Drive,
    /// Measured temperature of the rod, K.
    pub temperature_k: Option<Vec<f64>>,
    /// Which output.
    pub output: Output,
    /// The measured output.
    pub measured: Vec<f64>,
    /// Samples at the beginning that are simulated and not compared.
    pub settled: usize,
    /// rms of its noise.
    pub noise: f64,
    /// What was decided on the way, in sentences.
    pub notes: Vec<String>,
}

impl Observed {
    /// Chooses drive and output.
    ///
    /// # Errors
    /// A run without field or command, without an output that the model has, or with nothing left to compare after `settle_s`.
    pub fn of(run: &MeasuredRun, model: &ActuatorModel, settle_s: f64) -> Result<Self, IdentifyError> {
        let mut notes = Vec::new();
        let output = choose_output(run, model)?;
        let (drive_a_per_m, drive) = choose_drive(run, &mut notes)?;
        let measured = run.series(output.quantity()).unwrap_or_default().to_vec();
        let settled = settled(run, settle_s)?;
        let floor = run.noise(output.quantity());
        let noise = floor.map_or(0.0, |floor: NoiseFloor| floor.rms);
        if run.tick_s.is_none() {
            notes.push(
                "no time: a quasi-static sweep; its material comes from the opposite end of the sweep's field"
                    .to_owned(),
            );
        }
        Ok(Self {
            time_s: run.time_s.clone(),
            tick_s: run.tick_s.unwrap_or(SWEEP_TICK_S),
            drive_a_per_m,
            drive,
            temperature_k: run.series(Quantity::Temperature).map(<[f64]>::to_vec),
            output,
            measured,
            settled,
            noise,
            notes,
        })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.measured.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
    }

    /// Runs a model freely along the drive.
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn simulate(&self, model: &ActuatorModel, outputs: &mut ActuatorOutputs) -> Result<(), IdentifyError> {
        let mut actuator = match self.time_s {
            Some(_) => Actuator::new(model, self.tick_s),
            None => Actuator::quasi_static(model).map(|actuator| actuator.starting_at(self.first_state(model))),
        }?;
        let inputs = ActuatorInputs {
            drive_a_per_m: &self.drive_a_per_m,
            drive: self.drive,
            temperature_k: self.temperature_k.as_deref(),
            force_n: None,
        };
        Ok(actuator.run(inputs, outputs)?)
    }

    /// Where a sweep finds its material: at its first field, come from the other end of the sweep.
    fn first_state(&self, model: &ActuatorModel) -> MagneticState {
        let follow = |state, &field: &f64| model.material.hysteresis.advance(state, field);
        self.approach().iter().fold(MagneticState::default(), follow)
    }

    /// The way of a sweep's field from zero to the end opposite to where it begins to go, and from there to its first value, A/m; nothing
    /// for a run over time, which begins demagnetised.
    pub fn approach(&self) -> Vec<f64> {
        if self.time_s.is_some() {
            return Vec::new();
        }
        let first = self.drive_a_per_m.first().copied().unwrap_or_default();
        let leaves = self
            .drive_a_per_m
            .iter()
            .find(|field| **field != first)
            .copied()
            .unwrap_or(first);
        let peak = self
            .drive_a_per_m
            .iter()
            .fold(0.0_f64, |most, field| most.max(field.abs()));
        let far = if leaves > first { -peak } else { peak };
        let shares = (1..=APPROACH).map(|point| point as f64 / APPROACH as f64);
        let out = shares.clone().map(|share| far * share);
        out.chain(shares.map(|share| far + (first - far) * share)).collect()
    }
}

fn settled(run: &MeasuredRun, settle_s: f64) -> Result<usize, IdentifyError> {
    let refuse = |why: String| {
        Err(IdentifyError::Settle {
            source_of_data: run.source.clone(),
            settle_s,
            why,
        })
    };
    let Some(time_s) = &run.time_s else {
        return if settle_s > 0.0 {
            refuse("is for runs over time, and this one has none".into())
        } else {
            Ok(0)
        };
    };
    let begin_s = time_s.first().copied().unwrap_or_default();
    let settled = time_s.iter().take_while(|time_s| **time_s - begin_s < settle_s).count();
    if settled < time_s.len() {
        Ok(settled)
    } else {
        refuse(format!(
            "leaves nothing of {:.3} s to compare",
            time_s.last().copied().unwrap_or_default() - begin_s
        ))
    }
}

fn choose_output(run: &MeasuredRun, model: &ActuatorModel) -> Result<Output, IdentifyError> {
    let has = |output: Output| run.series(output.quantity()).is_some();
    let candidates = [Output::Displacement, Output::Magnetization, Output::Strain];
    let usable = |output: &Output| has(*output) && (*output != Output::Displacement || model.rod.is_some());
    candidates.into_iter().find(usable).ok_or_else(|| {
        let present: Vec<&str> = run.outputs().map(Quantity::name).collect();
        IdentifyError::NoOutput {
            source_of_data: run.source.clone(),
            model: model.name.clone(),
            present: if present.is_empty() {
                "none".to_owned()
            } else {
                present.join(", ")
            },
        }
    })
}

fn choose_drive(run: &MeasuredRun, notes: &mut Vec<String>) -> Result<(Vec<f64>, Drive), IdentifyError> {
    if let Some(command) = run.series(Quantity::FieldCommand) {
        return Ok((command.to_vec(), Drive::Command));
    }
    let Some(field) = run.series(Quantity::Field) else {
        return Err(IdentifyError::NoDrive {
            source_of_data: run.source.clone(),
        });
    };
    let noise = run.noise(Quantity::Field).map_or(0.0, |floor| floor.rms);
    // Steps of a sweep without time are no noise.
    if run.tick_s.is_none() || noise == 0.0 {
        return Ok((field.to_vec(), Drive::CoilField));
    }
    let width = PLAY_DEVIATIONS * noise;
    let mut play = Play::new(width)?;
    notes.push(format!(
        "no command: driven by the measured field through a play of {width:.2} A/m, three times its noise"
    ));
    let smooth = field.iter().map(|&field| {
        play.follow(field);
        play.output()
    });
    Ok((smooth.collect(), Drive::CoilField))
}
