//! What every effect says of itself, as data: whoever fits, screens, writes or reports effects reads it here and need not know a kind.

use crate::parameter::ParameterSpec;

/// Where in the chain an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Between command and coil field; seen in a measured field, and absent where the model is driven by one.
    Amplifier,
    /// Between coil field and the field in the material.
    Field,
    /// In the hysteresis itself.
    Hysteresis,
    /// On the magnetization.
    Magnetization,
    /// Between magnetization and free strain.
    Strain,
    /// In the rod and its load.
    Rod,
    /// Between the tip and what the sensor says.
    Sensor,
}

impl Stage {
    /// One word for tables.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Amplifier => "amplifier",
            Stage::Field => "field",
            Stage::Hysteresis => "hysteresis",
            Stage::Magnetization => "magnetization",
            Stage::Strain => "strain",
            Stage::Rod => "rod",
            Stage::Sensor => "sensor",
        }
    }
}

/// Whether an effect is caused by a coil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoilNeed {
    /// It has nothing to do with one.
    Never,
    /// By the heat of its current; a measured temperature stands for any heat.
    UnlessTemperatureIsMeasured,
    /// By its current itself.
    Always,
}

/// An effect's row in the library.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Description {
    /// Where in the chain it acts.
    pub stage: Stage,
    /// A sweep without time can neither show nor have it: [`crate::Actuator::quasi_static`] refuses it.
    pub needs_time: bool,
    /// The output has a derivative, and in general not a vanishing one, in each size at its identity (one-sided where
    /// the identity is a bound). Not so for limits, which do nothing until they bite, and for quantisation.
    pub differentiable: bool,
    /// Whether its cause is a coil.
    pub coil: CoilNeed,
    /// What it is, in a sentence.
    pub summary: &'static str,
    /// How it shows in data.
    pub signature: &'static str,
    /// Where equation and range come from.
    pub source: &'static str,
    /// Names of effects (or `parameter_…`) that data may not be able to tell it from.
    pub confused_with: &'static [&'static str],
    /// Values of an [`super::Effect`] stand in this order; the first is a size.
    pub parameters: &'static [ParameterSpec],
}

impl Description {
    /// What an effect says that only differs where it must.
    pub(super) const USUAL: Description = Description {
        stage: Stage::Sensor,
        needs_time: true,
        differentiable: true,
        coil: CoilNeed::Never,
        summary: "",
        signature: "",
        source: "",
        confused_with: &[],
        parameters: &[],
    };
}
