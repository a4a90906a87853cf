//! The two excitations of the development runs, with amplitude 1: standard and tracking; equations at the head of `mod.rs`.

use std::f64::consts::PI;

use super::shapes::sine;

const GROWING_HZ: f64 = 10.0;
const SHRINKING_HZ: f64 = 30.0;
const SWEEP_SHARE: f64 = 0.6;
const SWEEP_FROM_HZ: f64 = 1.0;
const SWEEP_RATIO: f64 = 200.0;
/// Levels of the staircase as shares of the amplitude.
const LEVELS: [f64; 8] = [
    0.887065, -0.281158, 0.569611, 0.182557, -0.411342, 0.845452, 0.738663, -0.271723,
];
const APPROACH_S: f64 = 4e-3;
const LINE_SHARE: f64 = 0.2;
/// Frequency (Hz) and phase (rad) of the multisine's lines.
const LINES: [(f64, f64); 6] = [
    (7.0, -0.171635),
    (23.0, 1.410013),
    (61.0, -1.224671),
    (97.0, -2.007157),
    (151.0, 2.958260),
    (283.0, 0.193458),
];
const FADE_S: f64 = 0.05;
const TRACKING_HZ: f64 = 50.0;
const TRACKING_THIRD_SHARE: f64 = 0.3125;
const TRACKING_RISE_S: f64 = 0.2;

/// The standard excitation with amplitude 1 and parts of length `part`.
pub(super) fn standard(time: f64, part: f64) -> f64 {
    let index = libm::floor(time / part);
    let index = if index < 4.0 { index } else { 4.0 };
    let inside = time - index * part;
    let share = inside / part;
    match index as u32 {
        0 => share * sine(GROWING_HZ, inside),
        1 => sweep(share, part),
        2 => staircase(inside, part / LEVELS.len() as f64),
        3 => multisine(inside, part),
        _ => (1.0 - 0.8 * share) * sine(SHRINKING_HZ, inside),
    }
}

fn sweep(share: f64, part: f64) -> f64 {
    let rate = libm::log(SWEEP_RATIO);
    SWEEP_SHARE * sine(SWEEP_FROM_HZ, part * libm::expm1(rate * share) / rate)
}

/// Each level is approached from where the one before ended, so that short holds stay continuous.
fn staircase(time: f64, hold: f64) -> f64 {
    let mut field = 0.0;
    let mut left = time;
    for level in LEVELS {
        let held = if left < hold { left } else { hold };
        field = level + (field - level) * libm::exp(-held / APPROACH_S);
        left -= hold;
        if left < 0.0 {
            break;
        }
    }
    field
}

fn multisine(time: f64, part: f64) -> f64 {
    let sum: f64 = LINES
        .iter()
        .map(|(frequency, phase)| libm::sin(2.0 * PI * frequency * time + phase))
        .sum();
    let to_edge = if time < part - time { time } else { part - time };
    let fade = to_edge / FADE_S;
    LINE_SHARE * sum * if fade < 1.0 { fade } else { 1.0 }
}

pub(super) fn tracking(time: f64) -> f64 {
    let rise = time / TRACKING_RISE_S;
    let third = libm::sin(2.0 * PI * 3.0 * TRACKING_HZ * time + 0.4);
    (if rise < 1.0 { rise } else { 1.0 }) * (sine(TRACKING_HZ, time) + TRACKING_THIRD_SHARE * third)
}
