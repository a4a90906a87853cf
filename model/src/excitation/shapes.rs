//! Shapes of drives with amplitude 1, as functions of time (s): sine, triangle, sweep, staircase.

use std::f64::consts::PI;

/// sin(2π·frequency·t).
pub(super) fn sine(frequency_hz: f64, time: f64) -> f64 {
    libm::sin(2.0 * PI * frequency_hz * time)
}

/// 0 → 1 → −1 → 0 over one period.
pub(super) fn triangle(periods: f64) -> f64 {
    let shifted = periods + 0.25;
    let share = shifted - libm::floor(shifted);
    1.0 - 4.0 * (share - 0.5).abs()
}

/// Sine whose frequency grows by a constant ratio from one to another within the duration:
/// φ = 2π f₀ T (r^(t/T) − 1)/ln r, r the ratio.
pub(super) fn sweep(time: f64, from_hz: f64, to_hz: f64, duration_s: f64) -> f64 {
    let rate = libm::log(to_hz / from_hz);
    let growth = rate * time / duration_s;
    // A ratio of 1 is a sine.
    let stretched = if rate.abs() < 1e-9 {
        time
    } else {
        duration_s * libm::expm1(growth) / rate
    };
    sine(from_hz, stretched)
}

/// 0, 1/n, …, 1, …, −1, …, 0 and on, each level held.
pub(super) fn staircase(time: f64, steps: u32, hold_s: f64) -> f64 {
    let steps = f64::from(steps);
    let count = libm::floor(time / hold_s);
    let inside = count - 4.0 * steps * libm::floor(count / (4.0 * steps));
    let level = if inside <= steps {
        inside
    } else if inside <= 3.0 * steps {
        2.0 * steps - inside
    } else {
        inside - 4.0 * steps
    };
    level / steps
}

/// 0 → 1 within the rise, then 1; no rise is there at once.
pub(super) fn rise(time: f64, rise_s: f64) -> f64 {
    if time < rise_s { time / rise_s } else { 1.0 }
}
