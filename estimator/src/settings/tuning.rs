//! Laws tuned for a given sampling, noise and sensitivity: what their defaults are for 20 kHz, 10 nm and a cut of 40 µm.
//!
//! Folded, scalar and gradient: dead zone 1.25 times the noise that the filter κ lets through, σ √(κ dt/2). Gauss-Newton: a start
//! that is uniform over the range.

use super::{GaussNewtonSettings, LawSettings, MinMaxSettings};

/// What a law is tuned for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Θ, A/m.
    pub range_a_per_m: (f64, f64),
    /// First estimate, A/m.
    pub start_a_per_m: f64,
    /// Between samples, s.
    pub tick_s: f64,
    /// σ of the output's noise, m.
    pub noise_m: f64,
    /// rms of dY/da over the motion, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
    /// How fast `a` is expected to wander, (A/m)²/s; 0: it is constant.
    pub drift_variance_per_s: f64,
}

/// The dead zone's share of the noise behind the filter.
const DEAD_ZONE: f64 = 1.25;
/// The smallest dead zone, as the error of `a` that it hides, A/m: without noise a law still needs one.
const MIN_HIDDEN_A_PER_M: f64 = 0.05;

impl Tuning {
    fn dead_zone_m(&self, filter_per_s: f64) -> f64 {
        let share = (0.5 * filter_per_s * self.tick_s).min(1.0);
        let behind_filter = DEAD_ZONE * self.noise_m * share.sqrt();
        behind_filter.max(MIN_HIDDEN_A_PER_M * self.sensitivity_m_per_a_per_m)
    }

    /// Filters and rates faster than a quarter of the sampling would only be aliases of themselves.
    fn rate_per_s(&self, wanted: f64) -> f64 {
        wanted.min(0.25 / self.tick_s)
    }

    /// What all laws share that step along a slope.
    fn tune(&self, own: &mut MinMaxSettings) {
        own.range_a_per_m = self.range_a_per_m;
        own.start_a_per_m = self.start_a_per_m;
        own.adaptation_rate_per_s = self.rate_per_s(own.adaptation_rate_per_s);
        own.sensitivity_m_per_a_per_m = self.sensitivity_m_per_a_per_m;
    }
}

impl LawSettings {
    /// The law of that name ([`LawSettings::ADAPTIVE`]), tuned.
    pub fn tuned(name: &str, tuning: &Tuning) -> Option<Self> {
        let mut settings = Self::named(name)?;
        let Tuning {
            range_a_per_m,
            start_a_per_m,
            sensitivity_m_per_a_per_m,
            ..
        } = *tuning;
        match &mut settings {
            LawSettings::FixedShape { shape_a_per_m } => *shape_a_per_m = start_a_per_m,
            LawSettings::Folded(own) | LawSettings::Gradient(own) | LawSettings::Scalar(own) => {
                own.filter_per_s = tuning.rate_per_s(own.filter_per_s);
                own.dead_zone_m = tuning.dead_zone_m(own.filter_per_s);
                tuning.tune(own);
            }
            LawSettings::Matrix(own) => tuning.tune(own),
            LawSettings::MultiParameter(own) => own.start_a_per_m = start_a_per_m,
            LawSettings::Weights(_) | LawSettings::FixedWeights => {}
            LawSettings::GaussNewton(gauss_newton) => {
                *gauss_newton = GaussNewtonSettings {
                    range_a_per_m,
                    start_a_per_m,
                    start_deviation_a_per_m: (range_a_per_m.1 - range_a_per_m.0) / 12.0_f64.sqrt(),
                    noise_m: tuning.noise_m.max(1e-6 * sensitivity_m_per_a_per_m),
                    drift_variance_per_s: tuning.drift_variance_per_s,
                    ..*gauss_newton
                };
            }
        }
        Some(settings)
    }
}
