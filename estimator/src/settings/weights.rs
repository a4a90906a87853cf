//! Settings of the law for the weights of another hysteresis law.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// How the weights of a material's own law follow the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WeightSettings {
    /// After this time in motion a measurement counts for 1/e.
    pub memory_s: f64,
    /// Samples that the material's own weights are worth, each at full motion.
    pub trust_samples: f64,
    /// Nothing is learnt or forgotten while the input has moved, within the memory, by less than this share of its extent.
    pub least_motion: f64,
}

impl Default for WeightSettings {
    fn default() -> Self {
        Self {
            memory_s: 3.0,
            trust_samples: 0.01,
            least_motion: 0.02,
        }
    }
}

impl WeightSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("memory_s", self.memory_s, "s")?;
        Invalid::unless_between("trust_samples", self.trust_samples, 1e-9, 1e9, "")?;
        Invalid::unless_between("least_motion", self.least_motion, 0.0, 1.0, "")
    }
}
