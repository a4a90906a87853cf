//! What the guard can notice. The numbers travel in `SafeField::event` and stand in recordings: they never change meaning.

use serde::{Deserialize, Serialize};

/// Something noticed in one tick; the number is the token's, 0 means nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u64)]
pub enum Event {
    /// A field of the command is NaN or infinite.
    CommandNotFinite = 1,
    /// A field of the measurement is NaN or infinite.
    MeasurementNotFinite = 2,
    /// The command belongs to another tick, further away than `max_age_ticks`.
    CommandStale = 3,
    /// The measurement belongs to another tick, further away than `max_age_ticks`.
    MeasurementStale = 4,
    /// The displacement moved by more than `jump_limit_m` in one tick.
    DisplacementJump = 5,
    /// The displacement repeated itself bit for bit while the field moved.
    DisplacementStuck = 6,
    /// Somebody asked the guard to follow commands again, and it does.
    Rearmed = 7,
}

impl Event {
    /// Every event, in the order of the numbers.
    pub const ALL: [Event; 7] = [
        Event::CommandNotFinite,
        Event::MeasurementNotFinite,
        Event::CommandStale,
        Event::MeasurementStale,
        Event::DisplacementJump,
        Event::DisplacementStuck,
        Event::Rearmed,
    ];

    /// The number in `SafeField::event`.
    pub const fn number(self) -> u64 {
        self as u64
    }

    /// The event with this number; `None` for 0 and for numbers that no event has.
    pub fn from_number(number: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|event| event.number() == number)
    }

    /// Its name in reports and recordings.
    pub const fn name(self) -> &'static str {
        match self {
            Event::CommandNotFinite => "command_not_finite",
            Event::MeasurementNotFinite => "measurement_not_finite",
            Event::CommandStale => "command_stale",
            Event::MeasurementStale => "measurement_stale",
            Event::DisplacementJump => "displacement_jump",
            Event::DisplacementStuck => "displacement_stuck",
            Event::Rearmed => "rearmed",
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
            ]
        );
        for event in Event::ALL {
            assert_eq!(Event::from_number(event.number()), Some(event));
            assert_eq!(serde_json::to_string(&event).unwrap(), format!("\"{}\"", event.name()));
        }
        assert_eq!(Event::from_number(0), None);
        assert_eq!(Event::from_number(8), None);
    }
}
