//! From the command to the field that the amplifier asks of the coil's current loop, a straight line a substep:
//!
//! H_d(t) = clip(H_u(t − d), ±L) / (1 + βΔT),   |Ḣ_d| ≤ S,   ΔṪ = r (H/H₀)² − ΔT/τ.
//!
//! H_u command, d delay (s), L limit, S slew limit (A/(m s)), ΔT rise of the coil (K), β = 0.0039 1/K of copper, H₀ = 10 kA/m,
//! τ loss time (s). The other law of the limit is round: L x/(1 + |x|¹²)^(1/12), x = H_u/L.

use crate::hidden::{Hidden, Laws};
use std::collections::VecDeque;

const RESISTANCE_PER_K: f64 = 0.0039;
/// H₀, A/m.
pub(crate) const HEATING_FIELD_A_PER_M: f64 = 1e4;

/// The amplifier in motion, at rest at first.
#[derive(Clone, Debug)]
pub(crate) struct Amplifier {
    tick_s: f64,
    /// Commands at the last ticks, the newest first.
    past: VecDeque<f64>,
    rise_k: f64,
    drive: f64,
}

impl Amplifier {
    pub fn new(hidden: &Hidden, tick_s: f64) -> Self {
        let memory = (hidden.loop_delay_s / tick_s) as usize + 3;
        Amplifier {
            tick_s,
            past: std::iter::repeat_n(0.0, memory).collect(),
            rise_k: 0.0,
            drive: 0.0,
        }
    }

    /// The command at the end of the tick that begins now.
    pub fn hear(&mut self, command: f64) {
        self.past.pop_back();
        self.past.push_front(command);
    }

    /// Field at the begin of a substep of `h` seconds and at its end, `left` ticks before the end of the tick.
    pub fn line(&mut self, hidden: &Hidden, left: f64, h: f64) -> (f64, f64) {
        let age = left + hidden.loop_delay_s / self.tick_s;
        let (near, far) = (self.past[age as usize], self.past[age as usize + 1]);
        let mut wanted = near + (far - near) * age.fract();
        if hidden.field_limit_a_per_m > 0.0 {
            wanted = clipped(wanted, hidden.field_limit_a_per_m, hidden.laws);
        }
        let from = self.drive;
        if hidden.coil_heating_k_per_s > 0.0 {
            let square = (from / HEATING_FIELD_A_PER_M).powi(2);
            let loss = self.rise_k / hidden.constants.coil_loss_time_s;
            self.rise_k += h * (hidden.coil_heating_k_per_s * square - loss);
            wanted /= 1.0 + RESISTANCE_PER_K * self.rise_k;
        }
        if hidden.slew_a_per_m_s > 0.0 {
            let reach = hidden.slew_a_per_m_s * h;
            wanted = wanted.clamp(from - reach, from + reach);
        }
        self.drive = wanted;
        (from, wanted)
    }
}

/// Not beyond ±limit, with an edge or rounded off.
pub(crate) fn clipped(value: f64, limit: f64, laws: Laws) -> f64 {
    match laws {
        Laws::Usual => value.clamp(-limit, limit),
        Laws::Other => value / (1.0 + (value / limit).abs().powi(12)).powf(1.0 / 12.0),
    }
}
