//! Settings of the recursive Gauss-Newton law.

use super::bank::validate_bank;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the recursive Gauss-Newton law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GaussNewtonSettings {
    /// Θ: the estimate stays within these shape parameters.
    pub range_a_per_m: (f64, f64),
    /// Where the estimate starts.
    pub start_a_per_m: f64,
    /// Standard deviation of that start.
    pub start_deviation_a_per_m: f64,
    /// Models in the bank, evenly spread over the range; five at least, so that slopes are accurate.
    pub members: usize,
    /// σ: rms noise of the displacement sensor.
    pub noise_m: f64,
    /// q: `a` is expected to wander by √(q t) in a time t, (A/m)²/s. 0: it is constant.
    pub drift_variance_per_s: f64,
}

impl Default for GaussNewtonSettings {
    /// The start is a uniform distribution's over the range. The drift is chosen so that on a 40 µm cut at 50 Hz with 10 nm noise
    /// (information 1250 per (A/m)² and second) a drift of 200 A/m per second lags by as much as the noise contributes.
    fn default() -> Self {
        Self {
            range_a_per_m: (6300.0, 7300.0),
            start_a_per_m: 6800.0,
            start_deviation_a_per_m: 289.0,
            members: 32,
            noise_m: 10e-9,
            drift_variance_per_s: 100.0,
        }
    }
}

impl GaussNewtonSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        validate_bank(self.range_a_per_m, self.start_a_per_m, self.members, 5)?;
        Invalid::unless_positive("start_deviation_a_per_m", self.start_deviation_a_per_m, "A/m")?;
        Invalid::unless_positive("noise_m", self.noise_m, "m")?;
        if self.noise_m * self.noise_m < f64::MIN_POSITIVE {
            let noise = self.noise_m;
            return Err(Invalid::new(
                "noise_m",
                format!("{noise} m is too small: its square is 0"),
            ));
        }
        let drift = self.drift_variance_per_s;
        if !(drift.is_finite() && drift >= 0.0) {
            return Err(Invalid::new(
                "drift_variance_per_s",
                format!("{drift} (A/m)^2/s must be finite and not below 0"),
            ));
        }
        Ok(())
    }
}
