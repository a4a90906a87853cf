//! A command that excites all that can be hidden: growing loops, a sweep, a staircase with holds, several sines at once.

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
