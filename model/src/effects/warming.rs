//! dΔT/dt = r (H/H₀)² (ρ + β ΔT) + q − ΔT/τ: warming by ohmic loss and from outside against a loss to the surroundings.
//!
//! ΔT rise over the surroundings (K), r heating (K/s) at the field H₀ = 10 kA/m, H coil field (A/m), ρ = 1 the coil's
//! resistance relative to that of r and β its growth (1/K), 0 unless told; q heating from outside (K/s), τ loss time (s).
//! Exact for the mean of H² over a tick in which H is a straight line; the resistance is that of the tick's begin.
//! Assumption: one lumped temperature. Source: Newton's law of cooling and Joule's of a current H/κ, κ field per current:
//! with a resistance R_coil, a heat capacity C and a thermal resistance R, r = R_coil (H₀/κ)²/C and τ = RC.

use serde::{Deserialize, Serialize};

use crate::parameter::ParameterSpec;

/// ΔT₀ of the first sample as a parameter: how long it had been heated as by H₀ before.
pub(super) const WARMED: ParameterSpec = ParameterSpec::fixed("warmed_s", "s", [0.0, 1e3], 0.0).believed(1.0);

/// r as a parameter, with the smallest value worth finding.
pub(super) const fn heating(typical: f64) -> ParameterSpec {
    ParameterSpec::size("heating_k_per_s", "K/s", [0.0, 2000.0], typical).by_ratio()
}

/// The rise of one lumped temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Warming {
    decay: f64,
    /// Rise after one tick at 1 (A/m)² and at a heating of 1 K/s, K.
    rise_per_square: f64,
    rise_per_heating: f64,
    resistance: f64,
    resistance_per_k: f64,
    /// q.
    heating_k_per_s: f64,
    field_a_per_m: f64,
    /// At the first sample, K.
    first_k: f64,
    rise_k: f64,
}

impl Warming {
    /// H₀, A/m.
    pub const REFERENCE_FIELD_A_PER_M: f64 = 1e4;

    /// By values of an effect: r, τ and how long it had been heated before.
    pub(crate) fn of(values: [f64; 3], tick_s: f64) -> Self {
        let [heating_k_per_s, loss_time_s, warmed_s] = values;
        Warming::new(heating_k_per_s, loss_time_s, tick_s).risen_by(heating_k_per_s * warmed_s)
    }

    /// At the surroundings' temperature.
    pub fn new(heating_k_per_s: f64, loss_time_s: f64, tick_s: f64) -> Self {
        let fallen = -libm::expm1(-tick_s / loss_time_s);
        let square = Self::REFERENCE_FIELD_A_PER_M * Self::REFERENCE_FIELD_A_PER_M;
        Warming {
            decay: 1.0 - fallen,
            rise_per_square: heating_k_per_s * loss_time_s * fallen / square,
            rise_per_heating: loss_time_s * fallen,
            resistance: 1.0,
            resistance_per_k: 0.0,
            heating_k_per_s: 0.0,
            field_a_per_m: 0.0,
            first_k: 0.0,
            rise_k: 0.0,
        }
    }

    /// The same with ρ and β of a coil that is as warm as the rod.
    pub fn with_resistance(self, resistance: f64, resistance_per_k: f64) -> Self {
        Warming {
            resistance,
            resistance_per_k,
            ..self
        }
    }

    /// The same, but warm by so many kelvins.
    pub fn risen_by(self, rise_k: f64) -> Self {
        Warming {
            first_k: rise_k,
            rise_k,
            ..self
        }
    }

    /// Heating from outside from now on, K/s.
    pub fn heat(&mut self, heating_k_per_s: f64) {
        self.heating_k_per_s = heating_k_per_s;
    }

    /// As warm as at first, with the coil at this field.
    pub fn steady_state(&mut self, field_a_per_m: f64) {
        self.rise_k = self.first_k;
        self.stand_at(field_a_per_m);
    }

    /// The coil has been at this field for ever; the temperature is what it is.
    pub fn stand_at(&mut self, field_a_per_m: f64) {
        self.field_a_per_m = field_a_per_m;
    }

    /// ΔT after one more tick, K; the field goes linearly to `field_a_per_m`.
    #[inline]
    pub fn step(&mut self, field_a_per_m: f64) -> f64 {
        let (from, to) = (self.field_a_per_m, field_a_per_m);
        let mean_square = (from * from + from * to + to * to) / 3.0;
        let resistance = self.resistance + self.resistance_per_k * self.rise_k;
        self.rise_k = self.decay * self.rise_k
            + self.rise_per_square * (resistance * mean_square)
            + self.rise_per_heating * self.heating_k_per_s;
        self.field_a_per_m = to;
        self.rise_k
    }

    /// ΔT, K.
    pub fn rise_k(&self) -> f64 {
        self.rise_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the thermal effects: at constant field the rise is rτ(H/H₀)²(1 − e^(−t/τ)), and settles at rτ(H/H₀)².
    #[test]
    fn the_rise_is_exponential_and_settles() {
        let (heating, loss_time_s, tick_s) = (2.0, 20.0, 1e-2);
        let mut warming = Warming::new(heating, loss_time_s, tick_s);
        warming.steady_state(5e3);
        let settled = heating * loss_time_s * 0.25;
        for k in 1..=20_000 {
            let rise = warming.step(5e3);
            let expected = -settled * libm::expm1(-tick_s * f64::from(k) / loss_time_s);
            assert!((rise - expected).abs() < 1e-10 * settled, "tick {k}");
        }
        assert!((warming.rise_k() / settled - 1.0).abs() < 1e-4);
    }

    /// Newton's law of cooling in closed form with heat from outside; two half ticks are one tick.
    #[test]
    fn heat_from_outside_is_exact_for_any_tick() {
        // 10 W into 150 J/K behind 2 K/W.
        let heated = |parts: u32, tick_s: f64| {
            let mut warming = Warming::new(0.0, 300.0, tick_s);
            warming.heat(10.0 / 150.0);
            (0..parts).for_each(|_| {
                warming.step(0.0);
            });
            warming
        };
        let whole = heated(1, 600.0);
        assert!((whole.rise_k() - 20.0 * (1.0 - (-600.0_f64 / 300.0).exp())).abs() < 1e-11);
        assert!((heated(2, 300.0).rise_k() - whole.rise_k()).abs() < 1e-11);
        let mut cooling = Warming::new(0.0, 300.0, 1e9).risen_by(207.0);
        assert!(cooling.step(0.0).abs() < 1e-9);
    }

    /// The coil's loss is square in the field and grows with its resistance.
    #[test]
    fn coil_loss_is_square_in_field_and_rises_with_temperature() {
        // 2 Ω and 1e4 A/m per A: at 2e4 A/m 8 W, here into 1 J/K that hardly loses any.
        let warmth = |field: f64, rise_k: f64| {
            let mut warming = Warming::new(2.0, 1e9, 1e-6)
                .with_resistance(1.0, 0.0039)
                .risen_by(rise_k);
            warming.stand_at(field);
            (warming.step(field) - rise_k) / 1e-6
        };
        assert!((warmth(-2e4, 0.0) - 8.0).abs() < 1e-6);
        assert!((warmth(2e4, 100.0) - 8.0 * 1.39).abs() < 1e-6);
    }
}
