//! Commands: one that excites all that can be hidden in less than a second, and drawn ones for longer runs.
//!
//! All begin and end at 0 and are written with two decimals, as a rig's log has them.

use crate::draw::Draw;
use std::f64::consts::{PI, TAU};

/// Each part, s.
const PART_S: f64 = 0.2;
/// Levels of the staircase, A/m.
const LEVELS: [f64; 6] = [3e3, 8e3, -2e3, 6e3, -9e3, 0.0];

/// Four parts of 0.2 s with up to 12 kA/m, from 10 to 149 Hz, each from 0 to 0.
pub fn excitation(tick_s: f64) -> Vec<f64> {
    let samples = (4.0 * PART_S / tick_s).round() as usize;
    (0..samples).map(|sample| at(sample as f64 * tick_s)).collect()
}

fn at(time_s: f64) -> f64 {
    let part = (time_s / PART_S) as usize;
    let t = time_s - part as f64 * PART_S;
    // Up from 0 and back to it without a kink.
    let faded = (PI * t / PART_S).sin().powi(2);
    match part {
        0 => 12e3 * t / PART_S * (TAU * 20.0 * t).sin(),
        // From 10 to 120 Hz, each octave as long as the next.
        1 => {
            let rate = 12_f64.ln() / PART_S;
            9e3 * faded * (TAU * 10.0 * ((rate * t).exp() - 1.0) / rate).sin()
        }
        2 => staircase(t),
        _ => {
            let sines = [(23.0, 0.0), (61.0, 1.0), (97.0, 2.0), (149.0, 3.0)];
            let sum: f64 = sines.iter().map(|(hz, phase)| (TAU * hz * t + phase).sin()).sum();
            3e3 * faded * sum
        }
    }
}

/// From level to level within a tenth of a step.
fn staircase(t: f64) -> f64 {
    let step_s = PART_S / LEVELS.len() as f64;
    let step = ((t / step_s) as usize).min(LEVELS.len() - 1);
    let from = if step == 0 { 0.0 } else { LEVELS[step - 1] };
    let share = ((t - step as f64 * step_s) / (0.1 * step_s)).min(1.0);
    from + (LEVELS[step] - from) * share
}

/// What drives a drawn run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Growing loops, a sweep, a staircase with holds, several sines at once, shrinking loops.
    Broadband,
    /// Sines at once, over the whole run.
    Multisine,
    /// From level to level, with holds.
    Steps,
    /// One sweep.
    Sweep,
    /// A base with a third harmonic, whose size comes and goes: a profile that is cut.
    Cut,
}

impl Drive {
    pub const ALL: [Drive; 5] = [
        Drive::Broadband,
        Drive::Multisine,
        Drive::Steps,
        Drive::Sweep,
        Drive::Cut,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Drive::Broadband => "broadband",
            Drive::Multisine => "multisine",
            Drive::Steps => "steps",
            Drive::Sweep => "sweep",
            Drive::Cut => "cut",
        }
    }

    /// A command in A/m of 7 to 13 kA/m; one-sided about half of that.
    pub(crate) fn command(self, draw: &mut Draw, rows: usize, tick_s: f64, one_sided: bool) -> Vec<f64> {
        let amplitude = draw.between(7e3, 13e3);
        let duration_s = rows as f64 * tick_s;
        let shape: Shape = match self {
            Drive::Broadband => {
                let part_s = duration_s / 5.0;
                let parts = [
                    loops(draw.between(5.0, 12.0), part_s, true),
                    sweep(draw, part_s),
                    steps(draw, part_s),
                    sines(draw, part_s),
                    loops(draw.between(20.0, 40.0), part_s, false),
                ];
                Box::new(move |t| {
                    let part = ((t / part_s) as usize).min(parts.len() - 1);
                    parts[part](t - part as f64 * part_s)
                })
            }
            Drive::Multisine => sines(draw, duration_s),
            Drive::Steps => steps(draw, duration_s),
            Drive::Sweep => sweep(draw, duration_s),
            Drive::Cut => {
                let (hz, third) = (draw.between(20.0, 60.0), draw.between(0.1, 0.4));
                let (beat_hz, depth) = (draw.between(0.4, 1.5), draw.between(0.2, 0.8));
                Box::new(move |t| {
                    let profile = (TAU * hz * t).sin() + third * (3.0 * TAU * hz * t).sin();
                    let size = 1.0 - depth * (PI * beat_hz * t).sin().powi(2);
                    profile / (1.0 + third) * size * eased(t, duration_s)
                })
            }
        };
        let sided = |t: f64| {
            if one_sided {
                0.5 * (eased(t, duration_s) + shape(t))
            } else {
                shape(t)
            }
        };
        (0..rows)
            .map(|row| (100.0 * amplitude * sided(row as f64 * tick_s)).round() / 100.0)
            .collect()
    }
}

type Shape = Box<dyn Fn(f64) -> f64>;

/// From 0 to 1 within a twentieth of a part, and back at its end.
fn eased(t: f64, part_s: f64) -> f64 {
    let share = (20.0 * t.min(part_s - t) / part_s).clamp(0.0, 1.0);
    (0.5 * PI * share).sin().powi(2)
}

fn loops(hz: f64, part_s: f64, growing: bool) -> Shape {
    Box::new(move |t| {
        let size = if growing { t / part_s } else { 1.0 - t / part_s };
        size * (TAU * hz * t).sin() * eased(t, part_s)
    })
}

/// Each octave as long as the next.
fn sweep(draw: &mut Draw, part_s: f64) -> Shape {
    let (low_hz, high_hz) = (draw.log_between(1.0, 4.0), draw.between(120.0, 300.0));
    let (size, growth) = (draw.between(0.6, 1.0), (high_hz / low_hz).ln());
    Box::new(move |t| {
        let cycles = low_hz * part_s / growth * ((growth * t / part_s).exp() - 1.0);
        size * (TAU * cycles).sin() * eased(t, part_s)
    })
}

/// Holds of 30 to 160 ms, each step within 3 to 10 ms, back to 0 at the end.
fn steps(draw: &mut Draw, part_s: f64) -> Shape {
    let mut steps = Vec::new();
    let (mut at_s, mut level) = (draw.between(0.0, 0.05), 0.0);
    while at_s + 0.02 < part_s {
        let next_s = at_s + draw.between(0.03, 0.16);
        let wanted = if next_s + 0.02 < part_s {
            draw.between(-1.0, 1.0)
        } else {
            0.0
        };
        steps.push((at_s, draw.between(3e-3, 1e-2), wanted - level));
        (at_s, level) = (next_s, wanted);
    }
    Box::new(move |t| {
        let gone = |(at_s, rise_s, change): &(f64, f64, f64)| {
            let share = ((t - at_s) / rise_s).clamp(0.0, 1.0);
            change * (0.5 * PI * share).sin().powi(2)
        };
        steps.iter().map(gone).sum()
    })
}

fn sines(draw: &mut Draw, part_s: f64) -> Shape {
    let (count, high_hz) = (draw.one_of(&[8, 12, 20]), draw.between(150.0, 300.0));
    let tones: Vec<(f64, f64)> = (0..count)
        .map(|_| (draw.log_between(2.0, high_hz), draw.phase()))
        .collect();
    // Of unit rms a third of the sum: seldom beyond 1.
    let size = 0.35 * (2.0 / f64::from(count)).sqrt();
    Box::new(move |t| {
        let sum: f64 = tones.iter().map(|(hz, phase)| (TAU * hz * t + phase).sin()).sum();
        size * sum * eased(t, part_s)
    })
}
