//! What an FMU holds of the loop, and which channels are its inputs and outputs.

use anhyst_ipc::{Channel, combine, fingerprint, layouts};

/// In the folder of resources: the scenario with all that decides it.
pub const SCENARIO_FILE: &str = "scenario.ron";
/// In the folder of resources: the name of the [`Kind`].
pub const KIND_FILE: &str = "kind.txt";

/// A part of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Amplifier and plant: field command in, measurement out.
    Plant,
    /// The hysteresis inverse alone: demanded magnetization and estimate in, field out.
    Inverse,
    /// Estimator, controller, inverse and guard: measurement in, demand and field out.
    Controller,
    /// All of it: nothing in.
    Loop,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Plant, Self::Inverse, Self::Controller, Self::Loop];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Inverse => "inverse",
            Self::Controller => "controller",
            Self::Loop => "loop",
        }
    }

    /// The one of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What it is, in a sentence.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Plant => "Amplifier and actuator with hysteresis: field command in, displacement out",
            Self::Inverse => "Hysteresis inverse: demanded magnetization in, field out",
            Self::Controller => "Estimator, feedforward and feedback, inverse and guard: displacement in, field out",
            Self::Loop => "The whole loop: trajectory, control and actuator",
        }
    }

    /// Fields of tokens that it is told, and where they begin.
    pub(crate) const fn inputs(self) -> &'static [(Channel, &'static [&'static str])] {
        match self {
            Self::Plant => &[(Channel::SafeField, &["field_a_per_m"])],
            Self::Inverse => &[
                (
                    Channel::Demand,
                    &["magnetization_a_per_m", "magnetization_rate_a_per_m_s"],
                ),
                (
                    Channel::Estimate,
                    &[
                        "shape_a_per_m",
                        "field_a_per_m",
                        "magnetization_a_per_m",
                        "next_field_a_per_m",
                        "saturation_magnetization_a_per_m",
                        "pinning_a_per_m",
                        "coupling",
                        "reversibility",
                    ],
                ),
                (Channel::SafeField, &["field_a_per_m", "status"]),
            ],
            Self::Controller => &[(
                Channel::Measurement,
                &["displacement_m", "coil_field_a_per_m", "temperature_k"],
            )],
            Self::Loop => &[],
        }
    }

    /// Channels of which it gives all fields.
    pub(crate) const fn outputs(self) -> &'static [Channel] {
        match self {
            Self::Plant => &[Channel::Measurement, Channel::Truth, Channel::CoilField],
            Self::Inverse => &[Channel::FieldCommand],
            Self::Controller => &[
                Channel::Estimate,
                Channel::Demand,
                Channel::FieldCommand,
                Channel::SafeField,
            ],
            Self::Loop => &Channel::ALL,
        }
    }

    pub(crate) const fn has_plant(self) -> bool {
        matches!(self, Self::Plant | Self::Loop)
    }

    pub(crate) const fn has_controller(self) -> bool {
        matches!(self, Self::Controller | Self::Loop)
    }
}

impl std::str::FromStr for Kind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::named(name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("there is no FMU of a {name}; there are {known}")
        })
    }
}

/// What tells a library that the description was written for it and for these resources: from the kind, the scenario's text, and
/// this build's version and tokens.
pub fn instantiation_token(kind: Kind, scenario_text: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    combine([(kind.name(), fingerprint(scenario_text)), (version, layouts())])
}
