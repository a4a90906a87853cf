//! What goes into the chain and what comes out of it, a sample at a time or by columns.

use crate::ModelError;

/// What drives the chain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drive {
    /// The command to the amplifier, A/m. With `coil_heating` it is the voltage, as the field that the cold coil would have.
    #[default]
    Command,
    /// The field in the coil, measured and made fit for a rate-independent model: effects of the amplifier are passed by.
    CoilField,
}

/// One sample of what drives the chain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorInput {
    /// Command or coil field, A/m.
    pub drive_a_per_m: f64,
    /// Which of the two.
    pub drive: Drive,
    /// Measured temperature of the rod, K; none: thermal effects reckon it from the field.
    pub temperature_k: Option<f64>,
    /// Force on the tip, N.
    pub force_n: f64,
}

impl ActuatorInput {
    /// A command and nothing else.
    pub fn command(drive_a_per_m: f64) -> Self {
        ActuatorInput {
            drive_a_per_m,
            ..Default::default()
        }
    }

    /// A coil field and nothing else.
    pub fn coil_field(drive_a_per_m: f64) -> Self {
        ActuatorInput {
            drive: Drive::CoilField,
            ..Self::command(drive_a_per_m)
        }
    }
}

/// A run's inputs by columns of equal length.
#[derive(Clone, Copy, Debug, Default)]
pub struct ActuatorInputs<'a> {
    /// Command or coil field, A/m.
    pub drive_a_per_m: &'a [f64],
    /// Which of the two.
    pub drive: Drive,
    /// Measured temperature of the rod, K.
    pub temperature_k: Option<&'a [f64]>,
    /// Force on the tip, N; none: 0.
    pub force_n: Option<&'a [f64]>,
}

impl<'a> ActuatorInputs<'a> {
    /// Commands and nothing else.
    pub fn commands(drive_a_per_m: &'a [f64]) -> Self {
        ActuatorInputs {
            drive_a_per_m,
            ..Default::default()
        }
    }

    /// Coil fields and nothing else.
    pub fn coil_fields(drive_a_per_m: &'a [f64]) -> Self {
        ActuatorInputs {
            drive: Drive::CoilField,
            ..Self::commands(drive_a_per_m)
        }
    }

    pub(super) fn validate(&self) -> Result<(), ModelError> {
        let needed = self.drive_a_per_m.len();
        for (column, quantity) in [(self.temperature_k, "the temperature"), (self.force_n, "the force")] {
            if let Some(given) = column.map(<[f64]>::len).filter(|&given| given != needed) {
                return Err(ModelError::LengthsDiffer {
                    quantity,
                    needed,
                    given,
                });
            }
        }
        Ok(())
    }

    pub(super) fn part(&self, from: usize, to: usize) -> Self {
        ActuatorInputs {
            drive_a_per_m: &self.drive_a_per_m[from..to],
            drive: self.drive,
            temperature_k: self.temperature_k.map(|column| &column[from..to]),
            force_n: self.force_n.map(|column| &column[from..to]),
        }
    }
}

/// One sample of what the chain does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorOutput {
    /// Field in the coil, A/m.
    pub field_a_per_m: f64,
    /// M with its creep, A/m.
    pub magnetization_a_per_m: f64,
    /// Free strain, no unit.
    pub strain: f64,
    /// What the displacement sensor says, without noise, m.
    pub displacement_m: f64,
    /// Temperature of the rod: measured, reckoned by a thermal effect, or ambient, K.
    pub temperature_k: f64,
}

/// What the chain did in a run, by columns. Reused from run to run, it allocates once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActuatorOutputs {
    /// Field in the coil, A/m.
    pub field_a_per_m: Vec<f64>,
    /// M with its creep, A/m.
    pub magnetization_a_per_m: Vec<f64>,
    /// Free strain, no unit.
    pub strain: Vec<f64>,
    /// What the displacement sensor says, without noise, m.
    pub displacement_m: Vec<f64>,
    /// Temperature of the rod: measured, reckoned by a thermal effect, or ambient, K.
    pub temperature_k: Vec<f64>,
}

impl ActuatorOutputs {
    pub(super) fn resize(&mut self, length: usize) {
        for column in [
            &mut self.field_a_per_m,
            &mut self.magnetization_a_per_m,
            &mut self.strain,
            &mut self.displacement_m,
            &mut self.temperature_k,
        ] {
            column.resize(length, 0.0);
        }
    }

    pub(super) fn begin_with(&mut self, half: &MagneticHalf) {
        for (own, known) in [
            (&mut self.field_a_per_m, &half.field_a_per_m),
            (&mut self.magnetization_a_per_m, &half.magnetization_a_per_m),
            (&mut self.temperature_k, &half.temperature_k),
        ] {
            own.clone_from(known);
        }
        self.resize(half.len());
    }

    pub(super) fn part(&mut self, from: usize, to: usize) -> Columns<'_> {
        Columns {
            field: &mut self.field_a_per_m[from..to],
            magnetization: &mut self.magnetization_a_per_m[from..to],
            strain: &mut self.strain[from..to],
            displacement: &mut self.displacement_m[from..to],
            temperature: &mut self.temperature_k[from..to],
        }
    }
}

/// Where a stretch of a run is written; all of one length.
pub(super) struct Columns<'a> {
    pub field: &'a mut [f64],
    pub magnetization: &'a mut [f64],
    pub strain: &'a mut [f64],
    pub displacement: &'a mut [f64],
    pub temperature: &'a mut [f64],
}

/// What drive, field and hysteresis make of a whole run, by columns: nothing of it depends on what lies behind them.
#[derive(Clone, Debug, PartialEq)]
pub struct MagneticHalf {
    field_a_per_m: Vec<f64>,
    /// Without creep.
    magnetization_a_per_m: Vec<f64>,
    temperature_k: Vec<f64>,
    mean_excess_a_per_m: Vec<f64>,
}

impl MagneticHalf {
    pub(super) fn of_length(length: usize) -> Self {
        let column = || vec![0.0; length];
        MagneticHalf {
            field_a_per_m: column(),
            magnetization_a_per_m: column(),
            temperature_k: column(),
            mean_excess_a_per_m: column(),
        }
    }

    pub(super) fn columns(&mut self) -> [&mut [f64]; 4] {
        [
            &mut self.field_a_per_m,
            &mut self.magnetization_a_per_m,
            &mut self.temperature_k,
            &mut self.mean_excess_a_per_m,
        ]
    }

    pub(super) fn len(&self) -> usize {
        self.field_a_per_m.len()
    }

    pub(super) fn mean_excess(&self, from: usize, to: usize) -> &[f64] {
        &self.mean_excess_a_per_m[from..to]
    }
}
