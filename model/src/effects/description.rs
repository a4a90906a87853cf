//! What every effect says of itself, as data: whoever fits, screens, writes or reports effects reads it here and need not know a kind.

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

/// What a parameter is to its effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterRole {
    /// With every size at its identity the effect is absent.
    Size {
        /// A value within the bounds.
        identity: f64,
    },
    /// Fitted beside the sizes; without meaning while the effect is absent.
    Shape,
    /// Hardly fixed by ordinary data: stays at `typical` unless told otherwise, and may be left out of a model file.
    Held,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// With its unit, `time_constant_s`.
    pub name: &'static str,
    /// SI; empty for a number without unit.
    pub unit: &'static str,
    /// Smallest value accepted.
    pub lower: f64,
    /// Largest value accepted.
    pub upper: f64,
    /// Smallest size worth finding at a noise of 20 nm, or the usual value of another parameter.
    pub typical: f64,
    /// Spread starting values by ratio between `typical` and `upper`, not evenly.
    pub logarithmic: bool,
    /// Size, shape or held.
    pub role: ParameterRole,
}

impl EffectParameter {
    /// A size whose identity is 0.
    pub(super) const fn size(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        typical: f64,
    ) -> EffectParameter {
        EffectParameter {
            name,
            unit,
            lower,
            upper,
            typical,
            logarithmic: false,
            role: ParameterRole::Size { identity: 0.0 },
        }
    }

    /// A limit: at its upper bound it never bites.
    pub(super) const fn limit(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        typical: f64,
    ) -> EffectParameter {
        EffectParameter {
            logarithmic: true,
            role: ParameterRole::Size { identity: upper },
            ..Self::size(name, unit, [lower, upper], typical)
        }
    }

    pub(super) const fn shape(
        name: &'static str,
        unit: &'static str,
        bounds: [f64; 2],
        typical: f64,
    ) -> EffectParameter {
        EffectParameter {
            role: ParameterRole::Shape,
            ..Self::size(name, unit, bounds, typical)
        }
    }

    pub(super) const fn held(
        name: &'static str,
        unit: &'static str,
        bounds: [f64; 2],
        typical: f64,
    ) -> EffectParameter {
        EffectParameter {
            role: ParameterRole::Held,
            ..Self::size(name, unit, bounds, typical)
        }
    }

    pub(super) const fn by_ratio(self) -> EffectParameter {
        EffectParameter {
            logarithmic: true,
            ..self
        }
    }

    /// It does nothing until it bites: its identity is its upper bound.
    pub fn is_limit(&self) -> bool {
        self.identity() == Some(self.upper)
    }

    /// The value at which it contributes nothing; none unless it is a size.
    pub fn identity(&self) -> Option<f64> {
        match self.role {
            ParameterRole::Size { identity } => Some(identity),
            ParameterRole::Shape | ParameterRole::Held => None,
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
    pub parameters: &'static [EffectParameter],
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
