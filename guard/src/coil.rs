//! Does the coil follow? Two looks at the measured field y against p, what the believed amplifier makes of the fields given (A/m):
//!
//! at once, where |y − p| > |p|/2 in `FAST` ticks whose |p| is above a twentieth of the field's limit (`SLOW`, where next to nothing comes), and by
//! gain and shift over `WINDOW` ticks (`following.rs`). That look counts where p moves by more than a fiftieth of
//! the limit rms, and needs `AFTER` ticks beyond its bound and three standard deviations, which come from its own residual.
//! Assumptions: the probe is right within 5 %; z is anything.

use crate::Event;
use crate::believed::BelievedCoil;
use crate::following::Following;
use serde::{Deserialize, Serialize};

/// Ticks of the two looks at once.
const FAST: u64 = 10;
const SLOW: u64 = 200;
/// Least field of them, as a part of the limit, and mismatch, as a part of it.
const FLOOR: f64 = 0.05;
const MISMATCH: f64 = 0.5;
/// Below this part of the field next to nothing comes; above, with the other sign, it is reversed.
const NOTHING: f64 = 0.05;
const REVERSED: f64 = -0.3;
/// Beyond this multiple no zero explains it.
const UNIT: f64 = 3.0;
/// What comes is told from noise by so many standard deviations.
const TOLD: f64 = 5.0;
/// Of the least squares: memory, ticks beyond the bound, motion as a part of the limit.
const WINDOW: u64 = 200;
const AFTER: u64 = 20;
const MOTION: f64 = 0.02;
/// Bounds of gain and shift.
const GAIN: f64 = 0.05;
const SHIFT_TICKS: f64 = 0.75;
const DEVIATIONS: f64 = 3.0;

/// Ticks until `event` is raised, where the field is large enough and moves.
pub(crate) fn detection_ticks(event: Event) -> u64 {
    match event {
        Event::CoilReversed => FAST,
        Event::CoilStuck => SLOW,
        _ => WINDOW + AFTER,
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CoilWatch {
    timing: bool,
    limit_a_per_m: f64,
    following: Following,
    tick: Option<u64>,
    at_once: AtOnce,
    beyond: [u64; 3],
}

/// Sums over ticks with a mismatch.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct AtOnce {
    ticks: u64,
    p: f64,
    y: f64,
    pp: f64,
    py: f64,
    yy: f64,
}

impl CoilWatch {
    pub fn new(believed: BelievedCoil, limit_a_per_m: f64, tick_s: f64) -> Self {
        Self {
            timing: believed.timing,
            limit_a_per_m,
            following: Following::new(believed, tick_s, WINDOW),
            tick: None,
            at_once: AtOnce::default(),
            beyond: [0; 3],
        }
    }

    /// Takes the field given in the tick before and, if there is one, the field measured in this; what is wrong.
    pub fn look(&mut self, tick: u64, given_a_per_m: f64, measured_a_per_m: Option<f64>) -> Option<Event> {
        let follows = self.tick.is_none_or(|before| tick == before + 1);
        self.tick = Some(tick);
        let measured = measured_a_per_m.filter(|own| own.is_finite() && follows);
        self.following.hear(given_a_per_m, measured);
        let Some(measured) = measured else {
            (self.at_once, self.beyond) = Default::default();
            return None;
        };
        self.look_at_once(measured).or_else(|| self.look_longer())
    }

    fn look_at_once(&mut self, measured: f64) -> Option<Event> {
        let expected = self.following.field_a_per_m;
        if expected.abs() < FLOOR * self.limit_a_per_m {
            return None;
        }
        let own = &mut self.at_once;
        if (measured - expected).abs() <= MISMATCH * expected.abs() {
            *own = AtOnce::default();
            return None;
        }
        own.ticks += 1;
        own.p += expected;
        own.y += measured;
        own.pp += expected * expected;
        own.py += expected * measured;
        own.yy += measured * measured;
        if own.ticks < FAST {
            return None;
        }
        let n = own.ticks as f64;
        let (pp, py, yy) = (
            own.pp - own.p * own.p / n,
            own.py - own.p * own.y / n,
            own.yy - own.y * own.y / n,
        );
        // As a whole where much comes; where next to nothing does, beside the zero of the probe.
        let gain = own.py / own.pp;
        if gain <= REVERSED {
            return Some(Event::CoilReversed);
        }
        if gain >= UNIT {
            return Some(Event::CoilScaled);
        }
        // Where something comes, a zero of the probe may be all: the longer look tells.
        if gain >= -REVERSED || own.ticks < SLOW || pp <= 0.0 {
            return None;
        }
        let beside = py / pp;
        let left = (yy - beside * py).max(0.0) / n;
        Some(of_gain(beside, (left / pp).sqrt()))
    }

    fn look_longer(&mut self) -> Option<Event> {
        let told = self.following.gain_and_shift(MOTION * self.limit_a_per_m);
        let far = |value: f64, bound: f64, deviation: f64| value > bound + DEVIATIONS * deviation;
        let beyond = told.as_ref().map_or([false; 3], |told| {
            let timing = self.timing;
            [
                told.gain.abs() > NOTHING && far((told.gain - 1.0).abs(), GAIN, told.gain_deviation),
                timing && far(told.shift_ticks, SHIFT_TICKS, told.shift_deviation),
                timing && far(-told.shift_ticks, SHIFT_TICKS, told.shift_deviation),
            ]
        });
        for (ticks, beyond) in self.beyond.iter_mut().zip(beyond) {
            *ticks = if beyond { *ticks + 1 } else { 0 };
        }
        let told = told?;
        let of_gain = of_gain(told.gain, told.gain_deviation);
        let events = [of_gain, Event::CoilLate, Event::CoilEarly];
        let first = self.beyond.iter().position(|ticks| *ticks >= AFTER)?;
        Some(events[first])
    }
}

/// What a wrong gain is called.
fn of_gain(gain: f64, deviation: f64) -> Event {
    if gain < REVERSED {
        Event::CoilReversed
    } else if gain.abs() > TOLD * deviation {
        Event::CoilScaled
    } else {
        Event::CoilStuck
    }
}
