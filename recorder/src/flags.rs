//! The status bits of the loop in words: one table, from which events and state lanes follow.

use crate::Scales;
use crate::row::Row;
use crate::run::Level;
use anhyst_ipc::{Channel, CoilField, Demand, Estimate, FieldCommand, SafeField};

/// One status bit.
pub(crate) struct Flag {
    /// Whose status word.
    pub channel: Channel,
    /// Which bit.
    pub bit: u64,
    /// How much it matters when it is set.
    pub level: Level,
    /// The producer's state while it is set.
    pub state: &'static str,
    /// What happened when it is set.
    pub set: &'static str,
    /// What happened when it is cleared.
    pub cleared: &'static str,
}

const fn flag(
    channel: Channel,
    bit: u64,
    level: Level,
    state: &'static str,
    set: &'static str,
    cleared: &'static str,
) -> Flag {
    Flag {
        channel,
        bit,
        level,
        state,
        set,
        cleared,
    }
}

/// Every status bit of the loop. Within a channel a later entry rules the state lane when several are set.
pub(crate) const FLAGS: [Flag; 22] = [
    flag(
        Channel::Estimate,
        Estimate::ADAPTING,
        Level::Info,
        "adapting",
        "adapts",
        "is inside its dead zone",
    ),
    flag(
        Channel::Estimate,
        Estimate::HELD,
        Level::Info,
        "held",
        "holds: the input does not inform",
        "is informed again",
    ),
    flag(
        Channel::Estimate,
        Estimate::UNMEASURED,
        Level::Info,
        "unmeasured",
        "has no usable measurement of the tick",
        "has measurements again",
    ),
    flag(
        Channel::Estimate,
        Estimate::AT_EDGE,
        Level::Warning,
        "at the edge",
        "a is at the edge of its range",
        "a is back inside its range",
    ),
    flag(
        Channel::Estimate,
        Estimate::FIXED,
        Level::Info,
        "fixed",
        "a is fixed by the scenario",
        "a is free",
    ),
    flag(
        Channel::Estimate,
        Estimate::OUTLIER,
        Level::Warning,
        "outlier",
        "leaves a measurement out: too far from the predicted",
        "believes the measurement again",
    ),
    flag(
        Channel::Demand,
        Demand::STARTING,
        Level::Info,
        "starting",
        "starts without a bump",
        "start finished",
    ),
    flag(
        Channel::Demand,
        Demand::INTEGRATION_STOPPED,
        Level::Warning,
        "anti-windup",
        "integration stopped (anti-windup)",
        "integrates again",
    ),
    flag(
        Channel::Demand,
        Demand::LEARNING,
        Level::Info,
        "learning",
        "learns what repeats",
        "learns nothing",
    ),
    flag(
        Channel::Demand,
        Demand::TAKEN_BACK,
        Level::Warning,
        "taken back",
        "the error grew while learning: takes back what was learnt",
        "goes on learning",
    ),
    flag(
        Channel::Demand,
        Demand::CHANGING,
        Level::Info,
        "changing",
        "a setting is changed",
        "the changed setting has its new value",
    ),
    flag(
        Channel::FieldCommand,
        FieldCommand::LIMITED,
        Level::Warning,
        "limited",
        "demand needs more field than the limit",
        "demand is within the limit",
    ),
    flag(
        Channel::SafeField,
        SafeField::SLEW_LIMITED,
        Level::Warning,
        "slew limit",
        "limits the slew of the field",
        "slew is within the limit",
    ),
    flag(
        Channel::SafeField,
        SafeField::AMPLITUDE_LIMITED,
        Level::Warning,
        "field limit",
        "limits the field",
        "field is within the limit",
    ),
    flag(
        Channel::SafeField,
        SafeField::FALL_BACK,
        Level::Warning,
        "fallen back",
        "tells the inverse to leave the estimate alone",
        "trusts the estimate again",
    ),
    flag(
        Channel::SafeField,
        SafeField::HOLDING,
        Level::Error,
        "holding",
        "holds the field",
        "holds the field no longer",
    ),
    flag(
        Channel::SafeField,
        SafeField::RAMPING,
        Level::Error,
        "to safe field",
        "ramps to the safe field",
        "ramp ended",
    ),
    flag(
        Channel::SafeField,
        SafeField::SAFE,
        Level::Error,
        "safe field",
        "is at the safe field",
        "leaves the safe field",
    ),
    flag(
        Channel::CoilField,
        CoilField::RETURNING,
        Level::Warning,
        "returning",
        "amplifier walks back to the commands",
        "amplifier follows the commands",
    ),
    flag(
        Channel::CoilField,
        CoilField::RAMPING,
        Level::Error,
        "nobody commands",
        "amplifier ramps to its safe field by itself",
        "amplifier's ramp ended",
    ),
    flag(
        Channel::CoilField,
        CoilField::SAFE,
        Level::Error,
        "by itself",
        "amplifier is at its safe field by itself",
        "amplifier leaves its safe field",
    ),
    flag(
        Channel::CoilField,
        CoilField::AMPLITUDE_LIMITED | CoilField::SLEW_LIMITED,
        Level::Warning,
        "limited",
        "amplifier is at a limit",
        "amplifier follows again",
    ),
];

/// The producers with a state lane, and their states when no bit is set.
pub(crate) const LANES: [(Channel, &str); 4] = [
    (Channel::Estimate, "dead zone"),
    (Channel::Demand, "tracking"),
    (Channel::FieldCommand, "inverting"),
    (Channel::SafeField, "passing"),
];

/// The status word of a channel.
pub(crate) fn status(channel: Channel, row: &Row) -> u64 {
    match channel {
        Channel::Estimate => row.estimate.status,
        Channel::Demand => row.demand.status,
        Channel::FieldCommand => row.field_command.status,
        Channel::SafeField => row.safe_field.status,
        Channel::CoilField => row.coil_field.status,
        Channel::Measurement | Channel::Truth => 0,
    }
}

/// The number that helps most in understanding a change of a channel's status.
pub(crate) fn detail(channel: Channel, row: &Row, scales: &Scales) -> String {
    // Rounded before 0.0 is added, so that no −0.00 is told.
    let field = |a_per_m: f64| {
        let (name, unit) = (if scales.shape { "field" } else { "input" }, &scales.input.unit);
        format!(
            "{name} {:.2} {unit}",
            (a_per_m * scales.input.factor * 1e2).round() * 1e-2 + 0.0
        )
    };
    match channel {
        Channel::Estimate if scales.shape => format!("a = {:.1} A/m", row.estimate.shape_a_per_m),
        Channel::Estimate | Channel::Demand => {
            let error = (row.demand.error_m * scales.error.factor).round() + 0.0;
            format!("error {error:.0} {}", scales.error.unit)
        }
        Channel::FieldCommand => field(row.field_command.field_a_per_m),
        Channel::SafeField => field(row.safe_field.field_a_per_m),
        Channel::CoilField => field(row.coil_field.field_a_per_m),
        Channel::Measurement | Channel::Truth => String::new(),
    }
}
