//! Settings of the excitation monitor.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the excitation monitor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExcitationSettings {
    /// σ: rms noise of the displacement sensor.
    pub noise_m: f64,
    /// T: time after which a motion counts 1/e of what it did.
    pub memory_s: f64,
    /// The estimate is held while the motion within the memory bounds `a` to a worse standard deviation than this.
    pub worst_deviation_a_per_m: f64,
}

impl Default for ExcitationSettings {
    /// Five periods of a 50 Hz cut. Half a micrometre of it bounds `a` to about 6 A/m with 10 nm noise at 20 kHz; where 10 A/m are
    /// in doubt on so small a motion, they make about 1 nm.
    fn default() -> Self {
        Self {
            noise_m: 10e-9,
            memory_s: 0.1,
            worst_deviation_a_per_m: 10.0,
        }
    }
}

impl ExcitationSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("noise_m", self.noise_m, "m")?;
        Invalid::unless_positive("memory_s", self.memory_s, "s")?;
        Invalid::unless_positive("worst_deviation_a_per_m", self.worst_deviation_a_per_m, "A/m")
    }
}
