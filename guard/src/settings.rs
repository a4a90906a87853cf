//! What the guard is told: limits, the safe field, and what counts as a fault.

use crate::coil;
use crate::monitors::CoilWatching;
use crate::{Event, Monitors, Reaction, Responses, WayBack};
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Memory of the mean square of the error; an error of 1.26 times the reference is noticed within it.
pub(crate) const DIVERGING_TICKS: u64 = 100;

/// Settings of the guard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuardSettings {
    /// Largest magnitude of the field that may leave the guard.
    pub field_limit_a_per_m: f64,
    /// The lowest field that may leave the guard, 0 or below; none: as far as the limit. A piezo stack must not be driven far below 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lowest_field_a_per_m: Option<f64>,
    /// Largest magnitude of the field's rate, or none.
    #[serde(default)]
    pub slew_limit_a_per_m_s: Option<f64>,
    /// The field at which nothing can happen.
    #[serde(default)]
    pub safe_field_a_per_m: f64,
    /// Time of the longest ramp to the safe field, the one that starts at the far limit; it sets the slew of every ramp.
    #[serde(default = "default_ramp_time_s")]
    pub ramp_time_s: f64,
    /// How many ticks a token's own tick may differ from the tick it is read in. In lockstep they never differ.
    #[serde(default = "default_max_age_ticks")]
    pub max_age_ticks: u64,
    /// Largest believable change of the displacement in one tick, or no such check.
    #[serde(default)]
    pub jump_limit_m: Option<f64>,
    /// When a displacement that does not change counts as stuck, or no such check.
    #[serde(default = "default_stuck")]
    pub stuck: Option<StuckSettings>,
    /// Further monitors: temperature, current, tracking error, estimate, deadlines.
    #[serde(default)]
    pub monitors: Monitors,
    /// What is done about an event where it is not the usual, by the event's name.
    #[serde(default)]
    pub reactions: Responses,
}

/// A displacement is stuck if it repeats itself bit for bit while the field moves; at rest repeating is no fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StuckSettings {
    /// So many repetitions in a row, and more, are suspicious.
    pub ticks: u64,
    /// The field must have moved this far from where it was when the displacement last changed.
    pub field_change_a_per_m: f64,
}

/// Ten milliseconds at 20 kHz in which the field moves by what moves any rod.
fn default_stuck() -> Option<StuckSettings> {
    Some(StuckSettings {
        ticks: 200,
        field_change_a_per_m: 2e3,
    })
}

fn default_ramp_time_s() -> f64 {
    0.02
}

fn default_max_age_ticks() -> u64 {
    3
}

impl GuardSettings {
    /// Slew of every ramp, to the safe field and back: the far limit is reached from the safe field in `ramp_time_s`.
    pub fn ramp_slew_a_per_m_s(&self) -> f64 {
        (self.field_limit_a_per_m + self.safe_field_a_per_m.abs()) / self.ramp_time_s
    }

    /// Ticks after which the safe field is reached at the latest, the tick of the fault being the first.
    pub fn most_ramp_ticks(&self, tick_s: f64) -> u64 {
        // One more than the quotient, because the steps' rounding may leave a last step of a few ulp.
        (self.ramp_time_s / tick_s).ceil() as u64 + 1
    }

    /// The limit that acts: the field's, or that of the coil's current if it is smaller.
    pub fn acting_field_limit_a_per_m(&self) -> f64 {
        let of_current = self
            .monitors
            .current
            .map(|current| current.limit_a * current.coil_constant_per_m);
        of_current.map_or(self.field_limit_a_per_m, |limit| limit.min(self.field_limit_a_per_m))
    }

    /// Ends of the field that act.
    pub fn field_ends_a_per_m(&self) -> [f64; 2] {
        let limit = self.acting_field_limit_a_per_m();
        let lowest = self.lowest_field_a_per_m.unwrap_or(-limit);
        [lowest.max(-limit), limit]
    }

    /// Ticks from the first faulty token until the event is raised, its tick included; `None` if nobody watches for it.
    pub fn detection_ticks(&self, event: Event, tick_s: f64) -> Option<u64> {
        match event {
            Event::CommandNotFinite
            | Event::MeasurementNotFinite
            | Event::DemandNotFinite
            | Event::EstimateNotFinite => Some(1),
            // A token that is d ticks old has been missing for d ticks.
            Event::CommandStale | Event::MeasurementStale | Event::DemandStale | Event::EstimateStale => {
                Some(self.max_age_ticks.saturating_add(1))
            }
            Event::DisplacementJump => self.jump_limit_m.map(|_| 1),
            // From then on the field must also have moved far enough.
            Event::DisplacementStuck => self.stuck.map(|stuck| stuck.ticks),
            Event::TemperatureExceeded => self.monitors.temperature_limit_k.map(|_| 1),
            Event::CurrentExceeded => self.monitors.current.map(|_| 1),
            Event::TrackingLost => self.monitors.tracking.map(|tracking| tracking.after_ticks),
            Event::EstimateOutside => self.monitors.estimate.map(|_| 1),
            Event::EstimateUninformed => self.monitors.estimate.and_then(|estimate| estimate.uninformed_ticks),
            Event::DeadlineMissed => self.monitors.deadline_misses,
            Event::ErrorDiverging => self.monitors.diverging.then_some(DIVERGING_TICKS),
            Event::CoilReversed | Event::CoilStuck | Event::CoilScaled | Event::CoilLate | Event::CoilEarly => {
                (self.monitors.coil != CoilWatching::Off).then_some(coil::detection_ticks(event))
            }
            Event::HoldTooLong => Some(whole_ticks(self.monitors.hold_at_most_s, tick_s)),
            Event::Rearmed | Event::Resumed => None,
        }
    }

    /// Ticks from the event until its reaction is complete, the event's tick included: the stated bound.
    pub fn reaction_ticks(&self, event: Event, tick_s: f64) -> u64 {
        match self.reactions.to(event).reaction {
            Reaction::Hold | Reaction::FallBack => 1,
            Reaction::RampToSafe => self.most_ramp_ticks(tick_s),
        }
    }

    /// Refuses settings that contradict themselves, each other or the tick.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("field_limit_a_per_m", self.field_limit_a_per_m, "A/m")?;
        let limit = self.field_limit_a_per_m;
        // A limit near the largest number would let differences of two permitted fields overflow.
        Invalid::unless_between("field_limit_a_per_m", limit, 0.0, 1e9, "A/m")?;
        Invalid::unless_between("safe_field_a_per_m", self.safe_field_a_per_m, -limit, limit, "A/m")?;
        if let Some(lowest) = self.lowest_field_a_per_m {
            let most = self.safe_field_a_per_m.min(0.0);
            Invalid::unless_between("lowest_field_a_per_m", lowest, -limit, most, "A/m")?;
        }
        Invalid::unless_positive("ramp_time_s", self.ramp_time_s, "s")?;
        if self.ramp_time_s < tick_s {
            return Err(Invalid::new(
                "ramp_time_s",
                format!(
                    "{} s is shorter than one tick of {tick_s} s: that is a jump, not a ramp",
                    self.ramp_time_s
                ),
            ));
        }
        if let Some(slew) = self.slew_limit_a_per_m_s {
            Invalid::unless_positive("slew_limit_a_per_m_s", slew, "A/(m s)")?;
            let ramp = self.ramp_slew_a_per_m_s();
            if ramp > slew {
                let shortest = (limit + self.safe_field_a_per_m.abs()) / slew;
                return Err(Invalid::new(
                    "ramp_time_s",
                    format!(
                        "{} s needs a slew of {ramp} A/(m s), above slew_limit_a_per_m_s = {slew} A/(m s): \
                         the ramp to the safe field must take at least {shortest} s",
                        self.ramp_time_s
                    ),
                ));
            }
        }
        if let Some(jump) = self.jump_limit_m {
            Invalid::unless_positive("jump_limit_m", jump, "m")?;
        }
        if let Some(stuck) = &self.stuck {
            if stuck.ticks == 0 {
                return Err(Invalid::new(
                    "stuck.ticks",
                    "0 ticks would call every measurement stuck; give at least 1",
                ));
            }
            Invalid::unless_positive("stuck.field_change_a_per_m", stuck.field_change_a_per_m, "A/m")?;
        }
        self.monitors.validate().map_err(|invalid| invalid.within("monitors"))?;
        let acting = self.acting_field_limit_a_per_m();
        Invalid::unless_between("safe_field_a_per_m", self.safe_field_a_per_m, -acting, acting, "A/m")?;
        self.validate_reactions()
    }

    fn validate_reactions(&self) -> Result<(), Invalid> {
        let refuse = |event: Event, sentence: String| Err(Invalid::new(format!("reactions.{event}"), sentence));
        for (event, response) in &self.reactions.0 {
            if !event.is_fault() {
                return refuse(*event, "tells of the way back: there is nothing to react to".into());
            }
            if *event == Event::HoldTooLong && response.reaction != Reaction::RampToSafe {
                return refuse(*event, "must ramp to the safe field: it ends a hold".into());
            }
            let about_command = matches!(
                event,
                Event::CommandNotFinite | Event::CommandStale | Event::DemandStale
            );
            if about_command && response.reaction == Reaction::FallBack {
                return refuse(
                    *event,
                    "is not the estimate's fault: falling back to the nominal inverse does not help".into(),
                );
            }
            let WayBack::AfterHealth { for_s } = response.way_back else {
                continue;
            };
            let hold_s = self.monitors.hold_at_most_s;
            if response.reaction == Reaction::Hold && for_s >= hold_s {
                return refuse(
                    *event,
                    format!(
                        "a way back after {for_s} s never comes: a hold lasts {hold_s} s (monitors.hold_at_most_s)"
                    ),
                );
            }
            Invalid::unless_between(&format!("reactions.{event}"), for_s, 0.0, 1e9, "s")?;
        }
        Ok(())
    }
}

/// A time in ticks, rounded up but for the quotient's own rounding, at least one.
pub(crate) fn whole_ticks(time_s: f64, tick_s: f64) -> u64 {
    ((time_s / tick_s - 1e-6).ceil() as u64).max(1)
}
