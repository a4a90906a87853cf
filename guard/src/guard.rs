//! v_k = v_{k−1} + clip(clip(target, ±limit) − v_{k−1}, ±slew·T), where the state chooses target and slew.
//!
//! Transfer function: 1 from command to field in `Normal` while no limit acts; constant otherwise.
//! Ports: in command (A/m, the field for t_{k+2}) and measurement of t_k; out field (A/m) for t_{k+2}, status bits, event.
//!
//! | state     | target     | slew                | leaves when                     | to        | event         |
//! |-----------|------------|---------------------|---------------------------------|-----------|---------------|
//! | Normal    | command    | the limit, if any   | a fault is noticed              | Ramping   | the fault     |
//! | Ramping   | safe field | the ramp's          | the safe field is reached       | Safe      |               |
//! | Safe      | safe field | the ramp's          | [`Guard::rearm`] and no fault   | Returning | `rearmed`     |
//! | Returning | command    | the ramp's          | the command is reached          | Normal    |               |
//! | Returning | command    | the ramp's          | a fault is noticed              | Ramping   | the fault     |
//!
//! A fault is latched: in Ramping and Safe nothing that is heard changes the field, and no further event is raised.
//! Coming back is bumpless because Returning walks from the safe field to the command at the ramp's slew.

use crate::limits::{Limited, Limits};
use crate::watch::{Heard, Watch};
use crate::{Event, GuardSettings};
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Where the guard stands: see the table at the head of this file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Follows the command within the limits.
    Normal,
    /// On the way to the safe field.
    Ramping,
    /// At the safe field, until [`Guard::rearm`].
    Safe,
    /// On the way from the safe field to the command.
    Returning,
}

/// Why the guard does not come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Rearm {
    /// Only a guard that stands at the safe field can be sent back.
    #[error("the guard is {0:?}, but only from Safe is there a way back")]
    NotSafe(State),
    /// What was heard last is still faulty.
    #[error("the guard still notices {0}: remove the cause first")]
    StillFaulty(Event),
}

/// What one tick gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Given {
    pub field_a_per_m: f64,
    pub amplitude_limited: bool,
    pub slew_limited: bool,
    pub event: Option<Event>,
}

/// The guard: its settings and where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Guard {
    settings: GuardSettings,
    limits: Limits,
    ramp_step_a_per_m: f64,
    watch: Watch,
    state: State,
    field_a_per_m: f64,
    /// What was wrong in the tick before, latched or not.
    fault: Option<Event>,
    just_rearmed: bool,
}

impl Guard {
    /// A guard in `Normal` at zero field, which is what the coil has before the first token.
    ///
    /// # Errors
    /// If the settings contradict themselves, each other or the tick.
    pub fn new(settings: &GuardSettings, tick_s: f64) -> Result<Self, Invalid> {
        Invalid::unless_positive("tick_s", tick_s, "s")?;
        settings.validate(tick_s)?;
        Ok(Self {
            limits: Limits {
                field_limit_a_per_m: settings.field_limit_a_per_m,
                step_limit_a_per_m: settings.slew_limit_a_per_m_s.map(|slew| slew * tick_s),
            },
            ramp_step_a_per_m: settings.ramp_slew_a_per_m_s() * tick_s,
            settings: settings.clone(),
            watch: Watch::default(),
            state: State::Normal,
            field_a_per_m: 0.0,
            fault: None,
            just_rearmed: false,
        })
    }

    /// Where it stands.
    pub fn state(&self) -> State {
        self.state
    }

    /// The field given last, in A/m.
    pub fn field_a_per_m(&self) -> f64 {
        self.field_a_per_m
    }

    /// Sends the guard back from the safe field to the commands. The next tick says so with [`Event::Rearmed`].
    ///
    /// # Errors
    /// If it does not stand at the safe field, or if what it heard last is faulty.
    pub fn rearm(&mut self) -> Result<(), Rearm> {
        if self.state != State::Safe {
            return Err(Rearm::NotSafe(self.state));
        }
        if let Some(event) = self.fault {
            return Err(Rearm::StillFaulty(event));
        }
        self.state = State::Returning;
        self.just_rearmed = true;
        Ok(())
    }

    /// Advances by one tick.
    pub(crate) fn give(&mut self, heard: &Heard) -> Given {
        self.fault = self.watch.look(&self.settings, heard, self.field_a_per_m);
        let rearmed = std::mem::take(&mut self.just_rearmed).then_some(Event::Rearmed);
        let latched = matches!(self.state, State::Ramping | State::Safe);
        let event = if latched { None } else { self.fault.or(rearmed) };
        if !latched && self.fault.is_some() {
            self.state = State::Ramping;
        }
        let limited = match self.state {
            State::Normal => self.towards(heard.command_a_per_m, self.limits.step_limit_a_per_m),
            State::Returning => self.towards(heard.command_a_per_m, Some(self.ramp_step_a_per_m)),
            State::Ramping | State::Safe => {
                self.towards(self.settings.safe_field_a_per_m, Some(self.ramp_step_a_per_m))
            }
        };
        self.field_a_per_m = limited.field_a_per_m;
        match self.state {
            State::Ramping if self.field_a_per_m == self.settings.safe_field_a_per_m => self.state = State::Safe,
            State::Returning if !limited.slew => self.state = State::Normal,
            _ => {}
        }
        Given {
            field_a_per_m: limited.field_a_per_m,
            amplitude_limited: limited.amplitude,
            slew_limited: limited.slew,
            event,
        }
    }

    fn towards(&self, wanted_a_per_m: f64, step_limit_a_per_m: Option<f64>) -> Limited {
        self.limits
            .towards(self.field_a_per_m, wanted_a_per_m, step_limit_a_per_m)
    }
}
