//! Settings of the outlier test.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the outlier test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutlierSettings {
    /// ν: a measurement further than this from the prediction is left out; none: the stroke of the rod at saturation, which
    /// no error of `a` can make.
    pub innovation_limit_m: Option<f64>,
    /// After so long in a row they are believed; 0: all are.
    pub at_most_s: f64,
}

impl Default for OutlierSettings {
    /// Several times longer than the guard's hold for a spike.
    fn default() -> Self {
        Self {
            innovation_limit_m: None,
            at_most_s: 0.01,
        }
    }
}

impl OutlierSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        if let Some(limit_m) = self.innovation_limit_m {
            Invalid::unless_positive("innovation_limit_m", limit_m, "m")?;
        }
        Invalid::unless_between("at_most_s", self.at_most_s, 0.0, 3600.0, "s")
    }
}
