//! Does the coil follow? y = g·p(t − s) + z: the measured field y against p, what the believed amplifier makes of the fields given (A/m).
//!
//! p: the field given, late by the believed delay and behind the believed lag, exact for straight lines between ticks. Two looks:
//! at once, where |y − p| > |p|/2 in `FAST` ticks whose |p| is above a twentieth of the field's limit (`SLOW`, where next to nothing comes), and by
//! least squares of y on (p, p_k − p_{k−1}, 1) that forgets in `WINDOW` ticks: gain g, shift s in ticks, zero z. That look counts where p moves by more than a fiftieth of
//! the limit rms, and needs `AFTER` ticks beyond its bound and three standard deviations, which come from its own residual.
//! Assumptions: the probe is right within 5 %; z is anything.

use crate::Event;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Ticks of the two looks at once.
const FAST: u64 = 10;
const SLOW: u64 = 200;
/// Least field of them, as a part of the limit, and mismatch, as a part of it.
const FLOOR: f64 = 0.05;
const MISMATCH: f64 = 0.5;
/// Below this part of the field next to nothing comes; above, with the other sign, it is reversed.
const NOTHING: f64 = 0.05;
const REVERSED: f64 = -0.3;
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

/// What is believed of the amplifier, beside a gain of 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BelievedCoil {
    /// More ticks from command to coil than the two of computing and hold.
    pub delay_ticks: u32,
    /// Time constant; 0: none.
    pub lag_s: f64,
    /// Whether late and early are events: not where ticks may be missed.
    pub timing: bool,
}

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
    believed: BelievedCoil,
    limit_a_per_m: f64,
    /// e^{−T/τ}, and the share of a tick's change that has come at its end.
    kept: f64,
    straight: f64,
    on_the_way: VecDeque<f64>,
    asked_a_per_m: f64,
    field_a_per_m: f64,
    tick: Option<u64>,
    at_once: AtOnce,
    fit: Fit,
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

/// Means that forget: weight, of p, d, y, and of their products.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Fit {
    n: f64,
    of: [f64; 3],
    products: [[f64; 3]; 3],
}

impl CoilWatch {
    pub fn new(believed: BelievedCoil, limit_a_per_m: f64, tick_s: f64) -> Self {
        let turns = tick_s / believed.lag_s;
        let (kept, straight) = if believed.lag_s > 0.0 {
            let kept = libm::exp(-turns);
            (kept, 1.0 - (1.0 - kept) / turns)
        } else {
            (0.0, 1.0)
        };
        Self {
            believed,
            limit_a_per_m,
            kept,
            straight,
            on_the_way: vec![0.0; 1 + believed.delay_ticks as usize].into(),
            asked_a_per_m: 0.0,
            field_a_per_m: 0.0,
            tick: None,
            at_once: AtOnce::default(),
            fit: Fit::default(),
            beyond: [0; 3],
        }
    }

    /// Takes the field given in the tick before and, if there is one, the field measured in this; what is wrong.
    pub fn look(&mut self, tick: u64, given_a_per_m: f64, measured_a_per_m: Option<f64>) -> Option<Event> {
        let follows = self.tick.is_none_or(|before| tick == before + 1);
        self.tick = Some(tick);
        self.on_the_way.push_back(given_a_per_m);
        let asked = self.on_the_way.pop_front().unwrap_or_default();
        let from = std::mem::replace(&mut self.asked_a_per_m, asked);
        let before = self.field_a_per_m;
        self.field_a_per_m = self.kept * before + (1.0 - self.kept) * from + self.straight * (asked - from);
        let measured = measured_a_per_m.filter(|own| own.is_finite() && follows);
        let Some(measured) = measured else {
            (self.at_once, self.fit, self.beyond) = Default::default();
            return None;
        };
        let at_once = self.look_at_once(measured);
        at_once.or_else(|| self.look_longer(self.field_a_per_m - before, measured))
    }

    fn look_at_once(&mut self, measured: f64) -> Option<Event> {
        let expected = self.field_a_per_m;
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
        let is_sure = gain.abs() > -REVERSED || own.ticks >= SLOW && pp > 0.0;
        is_sure.then(|| {
            let beside = py / pp;
            let left = (yy - beside * py).max(0.0) / n;
            of_gain(if gain.abs() > -REVERSED { gain } else { beside }, (left / pp).sqrt())
        })
    }

    fn look_longer(&mut self, change: f64, measured: f64) -> Option<Event> {
        self.fit.take([self.field_a_per_m, change, measured]);
        let told = self.fit.gain_and_shift(MOTION * self.limit_a_per_m);
        let far = |value: f64, bound: f64, deviation: f64| value > bound + DEVIATIONS * deviation;
        let beyond = told.as_ref().map_or([false; 3], |told| {
            let timing = self.believed.timing;
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

struct Told {
    gain: f64,
    gain_deviation: f64,
    shift_ticks: f64,
    shift_deviation: f64,
}

impl Fit {
    fn take(&mut self, values: [f64; 3]) {
        let forget = 1.0 / WINDOW as f64;
        self.n = (1.0 - forget) * self.n + forget;
        for (row, value) in values.into_iter().enumerate() {
            self.of[row] += forget * (value - self.of[row]);
            for (column, other) in values.into_iter().enumerate() {
                let own = &mut self.products[row][column];
                *own += forget * (value * other - *own);
            }
        }
    }

    /// None while p hardly moves, or not for half a window.
    fn gain_and_shift(&self, motion: f64) -> Option<Told> {
        // The first tick counts as if it had always been: divided out.
        let mean = |index: usize| self.of[index] / self.n;
        let spread = |row: usize, column: usize| self.products[row][column] / self.n - mean(row) * mean(column);
        let (pp, pd, dd) = (spread(0, 0), spread(0, 1), spread(1, 1));
        let (py, dy, yy) = (spread(0, 2), spread(1, 2), spread(2, 2));
        let determinant = pp * dd - pd * pd;
        if self.n < 0.4 || pp < motion * motion || determinant <= 1e-6 * pp * dd {
            return None;
        }
        let gain = (py * dd - dy * pd) / determinant;
        let slope = (dy * pp - py * pd) / determinant;
        let ticks = WINDOW as f64;
        let left = (yy - gain * py - slope * dy).max(0.0) / ticks;
        Some(Told {
            gain,
            gain_deviation: (left * dd / determinant).sqrt(),
            shift_ticks: -slope / gain,
            shift_deviation: (left * pp / determinant).sqrt() / gain.abs(),
        })
    }
}
