//! Settings of the gradient law: those of the folded law without covers.

use super::FoldedSettings;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the plain gradient law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GradientSettings {
    /// Θ: the estimate stays within these shape parameters.
    pub range_a_per_m: (f64, f64),
    /// Where the estimate starts.
    pub start_a_per_m: f64,
    /// Models in the bank, evenly spread over the range.
    pub members: usize,
    /// κ: both filters' corner, 1/s.
    pub filter_per_s: f64,
    /// ε: output errors up to this change nothing.
    pub dead_zone_m: f64,
    /// How fast the estimate follows where the output is as sensitive as said below.
    pub adaptation_rate_per_s: f64,
    /// Typical change of the displacement with the shape parameter, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
}

impl Default for GradientSettings {
    /// Those of the folded law.
    fn default() -> Self {
        let folded = FoldedSettings::default();
        Self {
            range_a_per_m: folded.range_a_per_m,
            start_a_per_m: folded.start_a_per_m,
            members: folded.members,
            filter_per_s: folded.filter_per_s,
            dead_zone_m: folded.dead_zone_m,
            adaptation_rate_per_s: folded.adaptation_rate_per_s,
            sensitivity_m_per_a_per_m: folded.sensitivity_m_per_a_per_m,
        }
    }
}

impl GradientSettings {
    /// The folded law's settings of the same names, with covers over all of Θ.
    pub fn with_covers(&self) -> FoldedSettings {
        FoldedSettings {
            range_a_per_m: self.range_a_per_m,
            start_a_per_m: self.start_a_per_m,
            members: self.members,
            filter_per_s: self.filter_per_s,
            dead_zone_m: self.dead_zone_m,
            window_a_per_m: None,
            adaptation_rate_per_s: self.adaptation_rate_per_s,
            sensitivity_m_per_a_per_m: self.sensitivity_m_per_a_per_m,
        }
    }

    /// γ = rate / sensitivity², (A/m)²/(m² s).
    pub fn gain(&self) -> f64 {
        self.with_covers().gain()
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        self.with_covers().validate()
    }
}
