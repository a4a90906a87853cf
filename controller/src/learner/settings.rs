//! What the learner is told.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const MAX_HARMONICS: u32 = 200;

/// Settings of the learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LearningSettings {
    /// N; those above a tenth of the sampling rate are left out.
    pub harmonics: u32,
    /// g: the part of the error that a step takes away where T is known.
    pub gain: f64,
    /// Largest |Cₙ| in m; none: half of what the reference moves either way.
    pub limit_m: Option<f64>,
    /// What an earlier run has learned: `learned.json` in its folder; none: nothing is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<PathBuf>,
}

impl Default for LearningSettings {
    fn default() -> Self {
        Self {
            harmonics: 40,
            gain: 0.8,
            limit_m: None,
            from: None,
        }
    }
}

impl LearningSettings {
    /// Refuses what cannot be learned with.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self) -> Result<(), Invalid> {
        if !(1..=MAX_HARMONICS).contains(&self.harmonics) {
            let sentence = format!("{} is outside [1, {MAX_HARMONICS}]", self.harmonics);
            return Err(Invalid::new("harmonics", sentence));
        }
        Invalid::unless_positive("gain", self.gain, "")?;
        Invalid::unless_between("gain", self.gain, 0.0, 1.0, "")?;
        self.limit_m
            .map_or(Ok(()), |limit_m| Invalid::unless_positive("limit_m", limit_m, "m"))
    }
}
