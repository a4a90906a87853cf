//! v(t) = v₀ + Σ steps: settings that change while a run goes on, none of them with a jump.
//!
//! A change of tick c takes a setting from wherever it is to its value v_c: v ← v + (v_c − v)·S((t_k − t_c)/θ), S the blend with four
//! continuous derivatives of `trajectory/blend.rs`, θ 0.1 s and at least 100 ticks. So a gain's part of the demand moves in a tick by at
//! most 2.46·|Δv|·T/θ times the error, whatever the gain (bumpless without a shift of the integrator, which a PID without ki could
//! not forget). The amplitude goes the same way, from t_c + 2T on: what is decided at t_c is for then. The learner's own gain is no part
//! of the demand and changes at once. Every value is a function of the list and the tick alone, so a run that has the list from
//! the beginning has the same bits.

use crate::PidSettings;
use crate::trajectory::blend;
use anhyst_ipc::{Change, MAX_CHANGES, Tunable};
use serde::{Deserialize, Serialize};

/// θ, s, and in ticks at least.
const OVER: (f64, f64) = (0.1, 100.0);

/// Time over which a change takes effect.
pub fn change_over_s(tick_s: f64) -> f64 {
    OVER.0.max(OVER.1 * tick_s)
}

/// What settings are in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tuned {
    pub kp: f64,
    pub ki_per_s: f64,
    pub kd_s: f64,
    /// From 0 (held, and not heard) to 1.
    pub learning: f64,
    pub learning_gain: f64,
    /// Something is on its way.
    pub changing: bool,
}

/// The stated values and the changes, in the order of their ticks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tuning {
    stated: PidSettings,
    learning_gain: f64,
    tick_s: f64,
    /// Later than this after its tick no change moves anything any more.
    settled_s: f64,
    changes: Vec<Change>,
}

impl Tuning {
    /// `ahead_s`: by how much later than at t_{k+2} a command has its effect.
    pub fn new(feedback: Option<&PidSettings>, learning_gain: f64, tick_s: f64, ahead_s: f64) -> Self {
        Self {
            stated: feedback.cloned().unwrap_or_default(),
            learning_gain,
            tick_s,
            settled_s: change_over_s(tick_s) + 2.0 * tick_s + ahead_s,
            changes: Vec::new(),
        }
    }

    /// Adds a change; false if there is no room for it.
    pub fn add(&mut self, change: Change) -> bool {
        let room = self.changes.len() < MAX_CHANGES;
        if room {
            self.changes.push(change);
        }
        room
    }

    /// In a tick; none while nothing was ever changed.
    pub fn at(&self, tick: u64) -> Option<Tuned> {
        let first = self.changes.first()?;
        if first.tick > tick {
            return None;
        }
        let mut now = Tuned {
            kp: self.stated.kp,
            ki_per_s: self.stated.ki_per_s,
            kd_s: self.stated.kd_s,
            learning: 1.0,
            learning_gain: self.learning_gain,
            changing: false,
        };
        for change in self.changes.iter().take_while(|change| change.tick <= tick) {
            let gone_s = (tick - change.tick) as f64 * self.tick_s;
            now.changing |= gone_s < self.settled_s;
            let (value, part) = match change.set {
                Tunable::Kp => (&mut now.kp, blend(gone_s, change_over_s(self.tick_s))),
                Tunable::KiPerS => (&mut now.ki_per_s, blend(gone_s, change_over_s(self.tick_s))),
                Tunable::KdS => (&mut now.kd_s, blend(gone_s, change_over_s(self.tick_s))),
                Tunable::Learning => (&mut now.learning, blend(gone_s, change_over_s(self.tick_s))),
                Tunable::LearningGain => (&mut now.learning_gain, 1.0),
                Tunable::Amplitude | Tunable::Tolerance => continue,
            };
            // Its own value to the bit at the end.
            *value = if part < 1.0 {
                *value + part * (change.value - *value)
            } else {
                change.value
            };
        }
        Some(now)
    }
}
