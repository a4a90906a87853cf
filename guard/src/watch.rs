//! The checks of what the guard hears. No feedback, no model: finite, fresh, not jumping, not stuck.

use crate::{Event, GuardSettings};
use serde::{Deserialize, Serialize};

/// What the guard heard in one tick, freed from its messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Heard {
    /// The field asked for.
    pub command_a_per_m: f64,
    /// Every number of the command is finite.
    pub command_finite: bool,
    /// Distance in ticks between the command's tick and this one.
    pub command_age_ticks: u64,
    /// Measured displacement of the tip.
    pub displacement_m: f64,
    /// Every number of the measurement is finite.
    pub measurement_finite: bool,
    /// Distance in ticks between the measurement's tick and this one.
    pub measurement_age_ticks: u64,
}

/// The displacement last heard, and since when it has been the same.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Watch {
    displacement_m: Option<f64>,
    repetitions: u64,
    field_when_changed_a_per_m: f64,
}

impl Watch {
    /// Looks at what was heard while `field_a_per_m` is the field last given; the first fault that is found.
    pub fn look(&mut self, settings: &GuardSettings, heard: &Heard, field_a_per_m: f64) -> Option<Event> {
        if !heard.command_finite {
            return Some(Event::CommandNotFinite);
        }
        if !heard.measurement_finite {
            return Some(Event::MeasurementNotFinite);
        }
        if heard.command_age_ticks > settings.max_age_ticks {
            return Some(Event::CommandStale);
        }
        if heard.measurement_age_ticks > settings.max_age_ticks {
            return Some(Event::MeasurementStale);
        }
        self.look_at_displacement(settings, heard, field_a_per_m)
    }

    fn look_at_displacement(&mut self, settings: &GuardSettings, heard: &Heard, field_a_per_m: f64) -> Option<Event> {
        let before = self.displacement_m.replace(heard.displacement_m);
        // A token that is read twice says nothing about the sensor.
        let repeated = before.is_some_and(|value| value.to_bits() == heard.displacement_m.to_bits());
        if !repeated {
            self.repetitions = 0;
            self.field_when_changed_a_per_m = field_a_per_m;
        } else if heard.measurement_age_ticks == 0 {
            self.repetitions = self.repetitions.saturating_add(1);
        }
        let change_m = before.map_or(0.0, |value| (heard.displacement_m - value).abs());
        if settings.jump_limit_m.is_some_and(|limit| change_m > limit) {
            return Some(Event::DisplacementJump);
        }
        let field_change = (field_a_per_m - self.field_when_changed_a_per_m).abs();
        let stuck = settings
            .stuck
            .is_some_and(|stuck| self.repetitions >= stuck.ticks && field_change >= stuck.field_change_a_per_m);
        stuck.then_some(Event::DisplacementStuck)
    }
}
