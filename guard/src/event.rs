//! What the guard can notice. The numbers travel in `SafeField::event` and stand in recordings: they never change meaning.

use serde::{Deserialize, Serialize};

/// Something noticed in one tick; the number is the token's, 0 means nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u64)]
pub enum Event {
    /// A number of the command is NaN or infinite.
    CommandNotFinite = 1,
    /// A number of the measurement is NaN or infinite.
    MeasurementNotFinite = 2,
    /// The command's tick is further away than `max_age_ticks`: whoever computes it is silent, or its clock jumped.
    CommandStale = 3,
    /// The measurement's tick is further away than `max_age_ticks`.
    MeasurementStale = 4,
    /// The displacement moved by more than `jump_limit_m` in one tick.
    DisplacementJump = 5,
    /// The displacement repeated itself bit for bit while the field moved.
    DisplacementStuck = 6,
    /// Somebody asked the guard to follow commands again, and it does.
    Rearmed = 7,
    /// All has been well for the stated time, and the guard follows commands again by itself.
    Resumed = 8,
    /// The field was held for `hold_at_most_s` and no way back came: it goes on to the safe field.
    HoldTooLong = 9,
    /// A number of the demand is NaN or infinite.
    DemandNotFinite = 10,
    /// The demand's tick is further away than `max_age_ticks`: the controller is silent.
    DemandStale = 11,
    /// A number of the estimate is NaN or infinite.
    EstimateNotFinite = 12,
    /// The estimate's tick is further away than `max_age_ticks`: the estimator is silent.
    EstimateStale = 13,
    /// The estimate has left the range that `monitors.estimate` gives.
    EstimateOutside = 14,
    /// The estimate has said for `uninformed_ticks` with a measurement, in a row, that it is not informed.
    EstimateUninformed = 15,
    /// The rod is warmer than `monitors.temperature_limit_k`.
    TemperatureExceeded = 16,
    /// The measured field means a current above `trip_a`, whatever was commanded.
    CurrentExceeded = 17,
    /// The tracking error was beyond its bound for `after_ticks` in a row.
    TrackingLost = 18,
    /// Command or measurement of the tick was not there in time, `deadline_misses` times in a row.
    DeadlineMissed = 19,
    /// The tracking error is larger than the reference itself, rms over some hundred ticks.
    ErrorDiverging = 20,
    /// The coil's field has the other sign than the one given.
    CoilReversed = 21,
    /// The coil's field does not move with the one given.
    CoilStuck = 22,
    /// The coil's field is another multiple of the one given than the believed amplifier makes of it: a unit, a gain.
    CoilScaled = 23,
    /// The coil's field comes later than the believed amplifier would bring it.
    CoilLate = 24,
    /// It comes earlier.
    CoilEarly = 25,
}

impl Event {
    /// Every event, in the order of the numbers.
    pub const ALL: [Event; 25] = [
        Event::CommandNotFinite,
        Event::MeasurementNotFinite,
        Event::CommandStale,
        Event::MeasurementStale,
        Event::DisplacementJump,
        Event::DisplacementStuck,
        Event::Rearmed,
        Event::Resumed,
        Event::HoldTooLong,
        Event::DemandNotFinite,
        Event::DemandStale,
        Event::EstimateNotFinite,
        Event::EstimateStale,
        Event::EstimateOutside,
        Event::EstimateUninformed,
        Event::TemperatureExceeded,
        Event::CurrentExceeded,
        Event::TrackingLost,
        Event::DeadlineMissed,
        Event::ErrorDiverging,
        Event::CoilReversed,
        Event::CoilStuck,
        Event::CoilScaled,
        Event::CoilLate,
        Event::CoilEarly,
    ];

    /// The number in `SafeField::event`.
    pub const fn number(self) -> u64 {
        self as u64
    }

    /// The event with this number; `None` for 0 and for numbers that no event has.
    pub fn from_number(number: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|event| event.number() == number)
    }

    /// True for what the guard reacts to; the others tell of its way back.
    pub const fn is_fault(self) -> bool {
        !matches!(self, Event::Rearmed | Event::Resumed)
    }

    /// Its name in reports, recordings and scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Event::CommandNotFinite => "command_not_finite",
            Event::MeasurementNotFinite => "measurement_not_finite",
            Event::CommandStale => "command_stale",
            Event::MeasurementStale => "measurement_stale",
            Event::DisplacementJump => "displacement_jump",
            Event::DisplacementStuck => "displacement_stuck",
            Event::Rearmed => "rearmed",
            Event::Resumed => "resumed",
            Event::HoldTooLong => "hold_too_long",
            Event::DemandNotFinite => "demand_not_finite",
            Event::DemandStale => "demand_stale",
            Event::EstimateNotFinite => "estimate_not_finite",
            Event::EstimateStale => "estimate_stale",
            Event::EstimateOutside => "estimate_outside",
            Event::EstimateUninformed => "estimate_uninformed",
            Event::TemperatureExceeded => "temperature_exceeded",
            Event::CurrentExceeded => "current_exceeded",
            Event::TrackingLost => "tracking_lost",
            Event::DeadlineMissed => "deadline_missed",
            Event::ErrorDiverging => "error_diverging",
            Event::CoilReversed => "coil_reversed",
            Event::CoilStuck => "coil_stuck",
            Event::CoilScaled => "coil_scaled",
            Event::CoilLate => "coil_late",
            Event::CoilEarly => "coil_early",
        }
    }
}

impl std::fmt::Display for Event {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Event;

    /// Guards the numbers and names that stand in old recordings.
    #[test]
    fn numbers_and_names_are_stable() {
        let listed: Vec<_> = Event::ALL.iter().map(|event| (event.number(), event.name())).collect();
        assert_eq!(
            listed,
            [
                (1, "command_not_finite"),
                (2, "measurement_not_finite"),
                (3, "command_stale"),
                (4, "measurement_stale"),
                (5, "displacement_jump"),
                (6, "displacement_stuck"),
                (7, "rearmed"),
                (8, "resumed"),
                (9, "hold_too_long"),
                (10, "demand_not_finite"),
                (11, "demand_stale"),
                (12, "estimate_not_finite"),
                (13, "estimate_stale"),
                (14, "estimate_outside"),
                (15, "estimate_uninformed"),
                (16, "temperature_exceeded"),
                (17, "current_exceeded"),
                (18, "tracking_lost"),
                (19, "deadline_missed"),
                (20, "error_diverging"),
                (21, "coil_reversed"),
                (22, "coil_stuck"),
                (23, "coil_scaled"),
                (24, "coil_late"),
                (25, "coil_early"),
            ]
        );
        for event in Event::ALL {
            assert_eq!(Event::from_number(event.number()), Some(event));
            assert_eq!(serde_json::to_string(&event).unwrap(), format!("\"{}\"", event.name()));
        }
        assert_eq!(Event::from_number(0), None);
        assert_eq!(Event::from_number(26), None);
    }
}
