//! u = H + τ dH/dt,  dH/dt = (dM/dt)/(dM/dH): the command whose first-order lag gives H.
//!
//! Two lags in series, τ₁ and τ₂, ask for u = H + (τ₁ + τ₂) dH/dt + τ₁τ₂ d²H/dt², the last from consecutive dH/dt. An amplifier of second
//! order asks for qτ² more of it, a diffusion for dτ²/3 less: the second moment of its lags is (1 + d/3) τ², by Σ 1/x⁴ = 1/32 and Σ 1/x⁶ = 1/192.
//! H field wanted in the coil (A/m), τ lag of the amplifier (s), dM/dt rate of the demand (A/(m s)), dM/dH slope of the
//! hysteresis at the end of the inversion (no unit).
//! Two others were measured in the loop (2 kHz amplifier, 20 kHz ticks, ±40 µm at 50 Hz and 30 % at 150 Hz, 10 nm noise;
//! tracking error rms / max, and the rms of the command's second difference, which is what the coil's driver must take):
//! this one 4.1 nm / 13 nm, 13 A/m; dH/dt from consecutive fields 3.8 / 19 nm, 17 A/m; the exact inverse of one tick of the
//! lag with its first-order hold, u⁺ = (H⁺ − E H − (g − E) u)/(1 − g), 3.3 / 12 nm, 49 A/m (at 500 Hz 396 A/m against 33).
//! That inverse has its own pole at −(g − E)/(1 − g), −0.82 at 2 kHz and towards −1 for longer lags: it rings from tick to
//! tick for a nanometre, and asks four times the roughness of an amplifier whose slew is limited.

use anhyst_model::{Effect, EffectKind};
use serde::{Deserialize, Serialize};

/// The largest lead as a part of the field limit: where the curve is flat dH/dt has no bound, and the lead must not take
/// the whole range of the amplifier.
const MAX_LEAD: f64 = 0.25;

/// Compensation of lags.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Sum of the lags, and what counts of d²H/dt²: their product, and more where an effect says so.
    lag_s: f64,
    product_s2: f64,
    largest_a_per_m: f64,
    tick_s: f64,
    /// dH/dt of the tick before, A/(m s).
    last_rate: f64,
}

impl Lead {
    /// For two lags in series (s; 0: no lag), ticks of `tick_s`, and commands within `field_limit_a_per_m`.
    pub fn series(lags_s: [f64; 2], field_limit_a_per_m: f64, tick_s: f64) -> Self {
        Self {
            lag_s: lags_s[0] + lags_s[1],
            product_s2: lags_s[0] * lags_s[1],
            largest_a_per_m: MAX_LEAD * field_limit_a_per_m,
            tick_s,
            last_rate: 0.0,
        }
    }

    /// The same where the lags of known effects are not of first order.
    pub fn of_second_order(mut self, effects: &[Effect]) -> Self {
        for effect in effects {
            self.product_s2 += match (effect.kind(), effect.values()) {
                (EffectKind::AmplifierBandwidth, [lag_s, second_order, ..]) => second_order * lag_s * lag_s,
                (EffectKind::EddyCurrent, [lag_s, diffusion, ..]) => -diffusion * lag_s * lag_s / 3.0,
                _ => 0.0,
            };
        }
        self
    }

    /// The lead of this tick in A/m, to be asked for once a tick: finite and bounded whatever the slope.
    pub fn step(&mut self, magnetization_rate_a_per_m_s: f64, slope: f64) -> f64 {
        let first = self.field_a_per_m(magnetization_rate_a_per_m_s, slope);
        if self.product_s2 == 0.0 {
            return first;
        }
        let rate = magnetization_rate_a_per_m_s / slope;
        if !rate.is_finite() {
            return first;
        }
        let second = self.product_s2 * (rate - self.last_rate) / self.tick_s;
        self.last_rate = rate;
        (first + second).clamp(-self.largest_a_per_m, self.largest_a_per_m)
    }

    /// τ dH/dt in A/m: finite and bounded whatever the slope.
    pub fn field_a_per_m(&self, magnetization_rate_a_per_m_s: f64, slope: f64) -> f64 {
        let lead = self.lag_s * magnetization_rate_a_per_m_s / slope;
        if lead.is_nan() {
            0.0
        } else {
            lead.clamp(-self.largest_a_per_m, self.largest_a_per_m)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::{Amplifier, AmplifierConstants};

    // Guards the purpose: a ramp behind a 2 kHz amplifier is followed without lag once it has settled.
    #[test]
    fn a_ramp_is_followed_without_lag() {
        let constants = AmplifierConstants {
            bandwidth_hz: Some(2000.0),
            ..AmplifierConstants::default()
        };
        let mut amplifier = Amplifier::new(constants, 5e-5).unwrap();
        let lead = Lead::series([constants.lag_s(), 0.0], 50_000.0, 5e-5);
        let (slope, magnetization_rate) = (25.0, 2.5e7);
        let rate = magnetization_rate / slope;
        let mut field = 0.0;
        for k in 0..200 {
            let wanted = rate * 5e-5 * f64::from(k);
            field = amplifier
                .step(wanted + lead.field_a_per_m(magnetization_rate, slope))
                .field_a_per_m;
        }
        // The command of tick 199 is for t_201; the field returned is that of t_200, commanded in tick 198.
        assert!((field - rate * 5e-5 * 198.0).abs() < 1e-6);
    }

    // Guards two lags in series: once settled, a parabola behind both is followed but for the half tick of a difference.
    #[test]
    fn a_parabola_behind_two_lags_is_followed() {
        let lags_s = [8e-5, 1.8e-4];
        let tick_s = 5e-5;
        let constants = |lag_s: f64| AmplifierConstants {
            bandwidth_hz: Some(1.0 / (2.0 * std::f64::consts::PI * lag_s)),
            ..AmplifierConstants::default()
        };
        let mut first = Amplifier::new(constants(lags_s[0]), tick_s).unwrap();
        let mut second = Amplifier::new(constants(lags_s[1]), tick_s).unwrap();
        let mut lead = Lead::series(lags_s, 1e12, tick_s);
        let (slope, bend) = (25.0, 2e8);
        let wanted = |time_s: f64| 0.5 * bend * time_s * time_s;
        let mut field = 0.0;
        for k in 0..400 {
            let time_s = tick_s * f64::from(k);
            let command = wanted(time_s) + lead.step(slope * bend * time_s, slope);
            field = second.step(first.step(command).field_a_per_m).field_a_per_m;
        }
        // Each amplifier returns what it was asked for a tick before: tick 399 returns what was commanded in tick 397.
        let error = field - wanted(tick_s * 397.0);
        let curvature = bend * tick_s * tick_s;
        assert!(
            error.abs() < 2.0 * curvature,
            "{error} A/m, {} of T²H″",
            error / curvature
        );
    }

    // Guards against flat curves and broken numbers.
    #[test]
    fn the_lead_is_bounded() {
        let lead = Lead::series([8e-5, 0.0], 1000.0, 5e-5);
        for slope in [0.0, -0.0, 1e-300, f64::NAN, f64::INFINITY, -1.0] {
            for rate in [0.0, 1e300, -1e300, f64::NAN, f64::INFINITY] {
                assert!(lead.field_a_per_m(rate, slope).abs() <= 250.0);
            }
        }
        assert_eq!(Lead::series([0.0, 0.0], 1000.0, 5e-5).field_a_per_m(1e8, 20.0), 0.0);
    }
}
