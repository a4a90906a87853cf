//! What a measured run offers to an estimator: the run made ready, and the one output that is compared.

use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, ActuatorOutputs};

use crate::error::IdentifyError;
use crate::prepared::{PrepareOptions, PreparedRun, SWEEP_TICK_S, simulated};

/// A run and its output.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Made ready.
    pub run: PreparedRun,
    /// Which output.
    pub output: Quantity,
    /// The measured output, in its unit.
    pub measured: Vec<f64>,
    /// rms of its noise.
    pub noise: f64,
}

impl Observed {
    /// Chooses the output that the model has.
    ///
    /// # Errors
    /// A run without field or command, without an output that the model has, or with nothing left to compare after `settle_s`.
    pub fn of(run: &MeasuredRun, model: &ActuatorModel, settle_s: f64) -> Result<Self, IdentifyError> {
        let options = PrepareOptions {
            settle_s,
            ..PrepareOptions::default()
        };
        let run = PreparedRun::of(run, &options)?;
        let channel = run.output(model)?.clone();
        Ok(Observed {
            output: channel.quantity,
            noise: channel.noise(&run.rests).map_or(0.0, |floor| floor.rms),
            measured: channel.measured,
            run,
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

    /// Between samples, s.
    pub fn tick_s(&self) -> f64 {
        self.run.tick_s.unwrap_or(SWEEP_TICK_S)
    }

    /// The output of a model that runs freely along the drive, and its strain.
    ///
    /// # Errors
    /// A model that cannot be run on this data.
    pub fn simulate(&self, model: &ActuatorModel) -> Result<[Vec<f64>; 2], IdentifyError> {
        let mut outputs = ActuatorOutputs::default();
        self.run.simulate(model, &mut outputs)?;
        let own = simulated(model, &outputs, self.output).unwrap_or_default().to_vec();
        Ok([own, outputs.strain])
    }
}
