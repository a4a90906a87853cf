//! A model run freely along a measured drive, as a whole or in its two halves: what is magnetised, and what moves.

use anhyst_measured::sweep;
use anhyst_model::{
    Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs, MagneticHalf, MagneticStart, MagneticState,
};

use crate::error::IdentifyError;
use crate::prepared::{PreparedRun, Start};

/// Points of either leg of the way on which a sweep's material is brought to its first field.
const APPROACH: usize = 400;

impl PreparedRun {
    /// Runs a model freely along the drive, from the run's start.
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn simulate(&self, model: &ActuatorModel, outputs: &mut ActuatorOutputs) -> Result<(), IdentifyError> {
        self.simulate_from(None, model, outputs)
    }

    /// The same with the material as it was before the first sample, where that is being found out.
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn simulate_from(
        &self,
        start: Option<MagneticStart>,
        model: &ActuatorModel,
        outputs: &mut ActuatorOutputs,
    ) -> Result<(), IdentifyError> {
        let mut actuator = self.at_first_sample(start, model)?;
        Ok(actuator.run(self.inputs(), outputs)?)
    }

    /// The magnetic half of the same, the shape parameter drifting from so far above the model's (A/m) to so far: it serves all models that have one
    /// ([`ActuatorModel::magnetic_half`]).
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn magnetize_from(
        &self,
        start: Option<MagneticStart>,
        model: &ActuatorModel,
        above_a_per_m: [f64; 2],
    ) -> Result<MagneticHalf, IdentifyError> {
        let mut actuator = self.at_first_sample(start, model)?;
        Ok(actuator.magnetize_drifting(self.inputs(), above_a_per_m)?)
    }

    /// The rest of the same.
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn simulate_on(
        &self,
        half: &MagneticHalf,
        model: &ActuatorModel,
        outputs: &mut ActuatorOutputs,
    ) -> Result<(), IdentifyError> {
        Ok(self.new_actuator(model)?.run_from(half, self.inputs(), outputs)?)
    }

    /// As it is before the run, but for what was magnetised.
    fn new_actuator(&self, model: &ActuatorModel) -> Result<Actuator, IdentifyError> {
        let mut actuator = match self.tick_s {
            Some(tick_s) => Actuator::new(model, tick_s)?,
            None => Actuator::quasi_static(model)?,
        };
        if self.start == Start::Undriven {
            actuator.step(ActuatorInput {
                drive: self.drive,
                temperature_k: self.temperature_k.as_ref().map(|column| column[0]),
                ..ActuatorInput::command(0.0)
            });
        }
        Ok(actuator)
    }

    fn at_first_sample(&self, start: Option<MagneticStart>, model: &ActuatorModel) -> Result<Actuator, IdentifyError> {
        let actuator = self.new_actuator(model)?;
        if let Some(start) = start {
            return Ok(actuator.starting_at(start));
        }
        let found = match self.start {
            Start::Demagnetised | Start::Undriven => None,
            Start::Magnetized(state) => Some(state),
            Start::Cycled(state) => Some(self.left_by(self.inputs(), model, state)?),
            Start::FarEnd => {
                let way = self.way_from_far_end();
                let inputs = ActuatorInputs {
                    drive: self.drive,
                    ..ActuatorInputs::commands(&way)
                };
                Some(self.left_by(inputs, model, MagneticState::default())?)
            }
        };
        Ok(match found {
            Some(state) => actuator.starting_at(state),
            None => actuator,
        })
    }

    /// How a sweep without time leaves a material that it finds in a state.
    fn left_by(
        &self,
        inputs: ActuatorInputs,
        model: &ActuatorModel,
        state: MagneticState,
    ) -> Result<MagneticState, IdentifyError> {
        let mut before = Actuator::quasi_static(model)?.starting_at(state);
        before.magnetize(inputs)?;
        Ok(before.magnetic_state())
    }

    fn inputs(&self) -> ActuatorInputs<'_> {
        ActuatorInputs {
            drive_a_per_m: &self.drive_a_per_m,
            drive: self.drive,
            temperature_k: self.temperature_k.as_deref(),
            force_n: self.force_n.as_deref(),
        }
    }

    /// The way of [`Start::FarEnd`], A/m.
    fn way_from_far_end(&self) -> Vec<f64> {
        let drive = &self.drive_a_per_m;
        let first = drive.first().copied().unwrap_or_default();
        let leaves = drive.iter().find(|field| **field != first).copied().unwrap_or(first);
        let (low, high) = sweep::extremes(drive);
        let far = if leaves > first { low } else { high };
        let shares = (1..=APPROACH).map(|point| point as f64 / APPROACH as f64);
        let out = shares.clone().map(|share| far * share);
        out.chain(shares.map(|share| far + (first - far) * share)).collect()
    }
}
