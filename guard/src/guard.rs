//! v_k = v_{k−1} + clip(clip(target, ±limit) − v_{k−1}, ±slew·T), where the state chooses target and slew.
//!
//! Transfer function: 1 from command to field in `Normal` while no limit acts; constant otherwise.
//! Ports: in command (A/m, the field for t_{k+2}), measurement, demand and estimate of t_k; out field (A/m) for t_{k+2},
//! status bits, event.
//!
//! | state     | target     | slew                | leaves when                     | to        | event         |
//! |-----------|------------|---------------------|---------------------------------|-----------|---------------|
//! | Normal    | command    | the limit, if any   | a fault asks for a hold or ramp | that one  | the fault     |
//! | Holding   | last field | 0                   | a fault asks for a ramp         | Ramping   | the fault     |
//! | Holding   | last field | 0                   | held for `hold_at_most_s`       | Ramping   | `hold_too_long` |
//! | Holding   | last field | 0                   | its way back                    | Returning | `rearmed` or `resumed` |
//! | Ramping   | safe field | the ramp's          | the safe field is reached       | Safe      |               |
//! | Safe      | safe field | the ramp's          | its way back                    | Returning | `rearmed` or `resumed` |
//! | Returning | command + d | the limit, if any  | d = 0                           | Normal    |               |
//! | Returning | command + d | the limit, if any  | a fault asks for a hold or ramp | that one  | the fault     |
//!
//! The way back is a request ([`Guard::rearm`]: `rearmed`) while no fault is noticed, or so much time without a fault as the
//! response says (`resumed`). A fault is latched: in Ramping and Safe nothing that is heard changes the field, and no
//! further event of a hold or a ramp is raised. Coming back is bumpless: d begins as the difference between the field and the
//! command, and shrinks by the ramp's step a tick. So the command is reached in the time of two ramps at most, however
//! fast it moves within the slew limit; a field that only walked towards it could chase it for ever. Falling back goes beside these states: the field of the tick is the last one once more, and from the next tick on
//! the inverse hears it and walks to its nominal answer, until the estimate has been well for the stated time.

use crate::limits::{Limited, Limits};
use crate::settings::whole_ticks;
use crate::watch::{Beliefs, Faults, Observation, Watch};
use crate::{Event, GuardSettings, Reaction, WayBack};
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
    /// At the safe field, until its way back.
    Safe,
    /// On the way from where it stood to the command.
    Returning,
    /// Keeps the field where it is.
    Holding,
}

/// Why the guard does not come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Rearm {
    /// Only a guard that stands still can be sent back.
    #[error("the guard is {0:?}, but only from Safe and Holding is there a way back")]
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
    /// The field is held: not for the one tick of a fall-back, in which the loop stays closed.
    pub holding: bool,
    pub event: Option<Event>,
}

/// Health that a latched reaction waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Latch {
    AfterTicks(u64),
    UntilReset,
}

impl Latch {
    fn new(way_back: WayBack, tick_s: f64) -> Self {
        match way_back {
            WayBack::Reset => Latch::UntilReset,
            WayBack::AfterHealth { for_s } => Latch::AfterTicks(whole_ticks(for_s, tick_s)),
        }
    }

    /// Of two faults the one that is harder to come back from rules.
    fn harder(self, other: Self) -> Self {
        match (self, other) {
            (Latch::AfterTicks(one), Latch::AfterTicks(two)) => Latch::AfterTicks(one.max(two)),
            _ => Latch::UntilReset,
        }
    }

    fn opens_after(self, healthy_ticks: u64) -> bool {
        matches!(self, Latch::AfterTicks(ticks) if healthy_ticks >= ticks)
    }
}

/// The guard: its settings and where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Guard {
    settings: GuardSettings,
    limits: Limits,
    tick_s: f64,
    ramp_step_a_per_m: f64,
    /// Still to come, the last one first.
    reset_ticks: Vec<u64>,
    watch: Watch,
    state: State,
    field_a_per_m: f64,
    /// What asked for a hold or a ramp in the tick before, latched or not.
    fault: Option<Event>,
    /// What asked to fall back in the tick before.
    estimate_fault: Option<Event>,
    just_rearmed: bool,
    /// Of Returning: what is still between command and field; `None` before its first tick.
    offset_a_per_m: Option<f64>,
    /// Of Holding, Ramping and Safe.
    latch: Latch,
    /// The inverse is told to leave the estimate alone.
    fallen_back: Option<Latch>,
    /// Ticks in a row without a fault that asks for a hold or a ramp, and without one that asks to fall back.
    healthy_ticks: u64,
    estimate_healthy_ticks: u64,
    held_ticks: u64,
    /// Ticks in a row in Normal.
    following_ticks: u64,
}

impl Guard {
    /// A guard in `Normal` at zero field, which is what the coil has before the first token.
    ///
    /// # Errors
    /// If the settings contradict themselves, each other or the tick.
    pub fn new(settings: &GuardSettings, tick_s: f64) -> Result<Self, Invalid> {
        Invalid::unless_positive("tick_s", tick_s, "s")?;
        settings.validate(tick_s)?;
        let at_tick = |at_s: &f64| (at_s / tick_s).round() as u64;
        let mut reset_ticks: Vec<u64> = settings.monitors.reset_at_s.iter().map(at_tick).collect();
        reset_ticks.sort_unstable_by(|one, other| other.cmp(one));
        Ok(Self {
            limits: Limits {
                ends_a_per_m: settings.field_ends_a_per_m(),
                step_limit_a_per_m: settings.slew_limit_a_per_m_s.map(|slew| slew * tick_s),
            },
            ramp_step_a_per_m: settings.ramp_slew_a_per_m_s() * tick_s,
            reset_ticks,
            settings: settings.clone(),
            tick_s,
            watch: Watch::default(),
            state: State::Normal,
            field_a_per_m: 0.0,
            fault: None,
            estimate_fault: None,
            just_rearmed: false,
            offset_a_per_m: None,
            latch: Latch::UntilReset,
            fallen_back: None,
            healthy_ticks: 0,
            estimate_healthy_ticks: 0,
            held_ticks: 0,
            following_ticks: 0,
        })
    }

    /// The same with what others believe of the loop.
    #[must_use]
    pub fn believing(mut self, beliefs: &Beliefs) -> Self {
        self.watch.believing(beliefs, self.limits.ends_a_per_m[1], self.tick_s);
        self
    }

    /// Where it stands.
    pub fn state(&self) -> State {
        self.state
    }

    /// True while the inverse is told to leave the estimate alone.
    pub fn fallen_back(&self) -> bool {
        self.fallen_back.is_some()
    }

    /// The field given last, in A/m.
    pub fn field_a_per_m(&self) -> f64 {
        self.field_a_per_m
    }

    /// Sends the guard back from where it stands still to the commands, and the inverse back to the estimate. The next tick says so with [`Event::Rearmed`].
    ///
    /// # Errors
    /// If it does not stand still, or if what it heard last is faulty.
    pub fn rearm(&mut self) -> Result<(), Rearm> {
        let stands_still = matches!(self.state, State::Safe | State::Holding);
        if !stands_still && self.fallen_back.is_none() {
            return Err(Rearm::NotSafe(self.state));
        }
        let cause = if stands_still { self.fault } else { self.estimate_fault };
        if let Some(event) = cause {
            return Err(Rearm::StillFaulty(event));
        }
        if stands_still {
            self.state = State::Returning;
        }
        if self.estimate_fault.is_none() {
            self.fallen_back = None;
        }
        self.just_rearmed = true;
        Ok(())
    }

    /// Advances by one tick.
    pub(crate) fn give(&mut self, observed: &Observation) -> Given {
        let following_s = (self.state == State::Normal).then_some(self.following_ticks as f64 * self.tick_s);
        let faults = self
            .watch
            .look(&self.settings, observed, self.field_a_per_m, following_s);
        self.take_health(faults);
        let mut back = std::mem::take(&mut self.just_rearmed).then_some(Event::Rearmed);
        if self.reset_is_due(observed.tick) && self.rearm().is_ok() {
            self.just_rearmed = false;
            back = Some(Event::Rearmed);
        }
        let relied_on_estimate = self.fallen_back.is_none();
        let raised = self.react(faults);
        let event = raised.or(back).or_else(|| self.come_back());
        // The inverse hears it a tick later: this tick's command still relies on the estimate.
        let falls_back = relied_on_estimate && self.fallen_back.is_some();
        let follows = matches!(self.state, State::Normal | State::Returning);
        let holding = self.state == State::Holding || follows && !observed.command_a_per_m.is_finite();
        let held = holding || follows && falls_back;
        let limited = if self.state == State::Returning && !held {
            self.approach(observed.command_a_per_m)
        } else {
            self.offset_a_per_m = None;
            self.limited(observed.command_a_per_m, held)
        };
        self.field_a_per_m = limited.field_a_per_m;
        self.advance_state();
        Given {
            field_a_per_m: limited.field_a_per_m,
            amplitude_limited: limited.amplitude,
            slew_limited: limited.slew,
            holding,
            event,
        }
    }

    /// A tick in which nobody is heard any more: the links are gone. `None` once the safe field has been given.
    pub(crate) fn give_alone(&mut self) -> Option<Given> {
        if self.state == State::Safe {
            return None;
        }
        let event = (self.state != State::Ramping).then_some(Event::CommandStale);
        (self.state, self.latch) = (State::Ramping, Latch::UntilReset);
        let limited = self.limited(self.field_a_per_m, false);
        self.field_a_per_m = limited.field_a_per_m;
        self.advance_state();
        Some(Given {
            field_a_per_m: limited.field_a_per_m,
            amplitude_limited: false,
            slew_limited: limited.slew,
            holding: false,
            event,
        })
    }

    /// A planned reset falls on this tick, or fell on one that was left out before it.
    fn reset_is_due(&mut self, tick: u64) -> bool {
        let before = self.reset_ticks.len();
        while self.reset_ticks.last().is_some_and(|due| *due <= tick) {
            self.reset_ticks.pop();
        }
        self.reset_ticks.len() < before
    }

    fn take_health(&mut self, faults: Faults) {
        let mut worst = None;
        self.estimate_fault = None;
        for event in faults.iter() {
            match self.settings.reactions.to(event).reaction {
                Reaction::FallBack => self.estimate_fault = self.estimate_fault.or(Some(event)),
                reaction => worst = worst.max(Some((reaction, std::cmp::Reverse(event)))),
            }
        }
        self.fault = worst.map(|(_, std::cmp::Reverse(event))| event);
        let count = |ticks: u64, well: bool| if well { ticks.saturating_add(1) } else { 0 };
        self.healthy_ticks = count(self.healthy_ticks, self.fault.is_none());
        self.estimate_healthy_ticks = count(self.estimate_healthy_ticks, self.estimate_fault.is_none());
    }

    /// Takes up the reactions to the faults of this tick; the event of the strongest new one.
    fn react(&mut self, faults: Faults) -> Option<Event> {
        let mut raised: Option<(Reaction, Event)> = None;
        for event in faults.iter() {
            let response = self.settings.reactions.to(event);
            let latch = Latch::new(response.way_back, self.tick_s);
            if self.take_up(response.reaction, latch)
                && raised.is_none_or(|(strongest, _)| response.reaction > strongest)
            {
                raised = Some((response.reaction, event));
            }
        }
        if raised.is_none() && self.state == State::Holding {
            self.held_ticks = self.held_ticks.saturating_add(1);
            if self.held_ticks >= whole_ticks(self.settings.monitors.hold_at_most_s, self.tick_s) {
                let way_back = self.settings.reactions.to(Event::HoldTooLong).way_back;
                (self.state, self.latch) = (State::Ramping, Latch::new(way_back, self.tick_s));
                return Some(Event::HoldTooLong);
            }
        }
        raised.map(|(_, event)| event)
    }

    /// True if the reaction is new.
    fn take_up(&mut self, reaction: Reaction, latch: Latch) -> bool {
        let (state, already) = match reaction {
            Reaction::FallBack => {
                let before = self.fallen_back;
                self.fallen_back = Some(before.map_or(latch, |before| before.harder(latch)));
                return before.is_none();
            }
            Reaction::Hold => (State::Holding, matches!(self.state, State::Holding)),
            Reaction::RampToSafe => (State::Ramping, matches!(self.state, State::Ramping | State::Safe)),
        };
        if already {
            self.latch = self.latch.harder(latch);
            return false;
        }
        if reaction == Reaction::Hold && matches!(self.state, State::Ramping | State::Safe) {
            return false;
        }
        (self.state, self.latch, self.held_ticks) = (state, latch, 0);
        true
    }

    /// The ways back that nobody has to ask for.
    fn come_back(&mut self) -> Option<Event> {
        if matches!(self.state, State::Safe | State::Holding) && self.latch.opens_after(self.healthy_ticks) {
            self.state = State::Returning;
            return Some(Event::Resumed);
        }
        let trusted = self
            .fallen_back
            .is_some_and(|latch| latch.opens_after(self.estimate_healthy_ticks));
        trusted.then(|| {
            self.fallen_back = None;
            Event::Resumed
        })
    }

    fn limited(&self, command_a_per_m: f64, held: bool) -> Limited {
        let (target, step) = match self.state {
            _ if held => (self.field_a_per_m, None),
            State::Normal | State::Holding | State::Returning => (command_a_per_m, self.limits.step_limit_a_per_m),
            State::Ramping | State::Safe => (self.settings.safe_field_a_per_m, Some(self.ramp_step_a_per_m)),
        };
        self.limits.towards(self.field_a_per_m, target, step)
    }

    /// A tick of Returning: the command, and what is left of the difference that there was.
    fn approach(&mut self, command_a_per_m: f64) -> Limited {
        let wanted = self.limits.clipped(command_a_per_m);
        let before = self.offset_a_per_m.unwrap_or(self.field_a_per_m - wanted);
        let left = before - before.clamp(-self.ramp_step_a_per_m, self.ramp_step_a_per_m);
        // The command itself once it is reached: a difference of nothing must not round.
        let target = if left == 0.0 { wanted } else { wanted + left };
        let limited = self
            .limits
            .towards(self.field_a_per_m, target, self.limits.step_limit_a_per_m);
        // What the slew limit holds back is difference again: it shrinks by the ramp's step, too.
        self.offset_a_per_m = Some(if limited.slew {
            limited.field_a_per_m - wanted
        } else {
            left
        });
        Limited {
            amplitude: wanted != command_a_per_m,
            slew: limited.slew || left != 0.0,
            ..limited
        }
    }

    fn advance_state(&mut self) {
        self.following_ticks = match self.state {
            State::Normal => self.following_ticks.saturating_add(1),
            _ => 0,
        };
        match self.state {
            State::Ramping if self.field_a_per_m == self.settings.safe_field_a_per_m => self.state = State::Safe,
            State::Returning if self.offset_a_per_m == Some(0.0) => self.state = State::Normal,
            _ => {}
        }
    }
}
