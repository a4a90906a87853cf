//! Settings of the paper's scalar form in the loop.

use super::FoldedSettings;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the scalar form in the loop. Its covers are always over the whole range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScalarLawSettings {
    /// Θ: the estimate stays within these shape parameters.
    pub range_a_per_m: (f64, f64),
    /// Where the estimate starts.
    pub start_a_per_m: f64,
    /// Models in the bank, evenly spread over the range.
    pub members: usize,
    /// k: decay of the plant of (23) that the measured displacement drives, 1/s.
    pub decay_per_s: f64,
    /// ε: output errors up to this change nothing.
    pub dead_zone_m: f64,
    /// How fast the estimate follows where the output is as sensitive as said below.
    pub adaptation_rate_per_s: f64,
    /// Typical change of the displacement with the shape parameter, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
}

impl Default for ScalarLawSettings {
    /// Those of the folded law, so that the two differ by nothing but the law. On a cut the estimate follows a rising
    /// `a` as well; twice as fast it overshoots on the way up and stays some 13 A/m above the truth. No setting brings
    /// it down from there: see `scalar_law.rs`.
    fn default() -> Self {
        let folded = FoldedSettings::default();
        Self {
            range_a_per_m: folded.range_a_per_m,
            start_a_per_m: folded.start_a_per_m,
            members: folded.members,
            decay_per_s: folded.filter_per_s,
            dead_zone_m: folded.dead_zone_m,
            adaptation_rate_per_s: folded.adaptation_rate_per_s,
            sensitivity_m_per_a_per_m: folded.sensitivity_m_per_a_per_m,
        }
    }
}

impl ScalarLawSettings {
    /// The folded law's settings of the same names, with covers over all of Θ.
    pub(crate) fn folded(&self) -> FoldedSettings {
        FoldedSettings {
            range_a_per_m: self.range_a_per_m,
            start_a_per_m: self.start_a_per_m,
            members: self.members,
            filter_per_s: self.decay_per_s,
            dead_zone_m: self.dead_zone_m,
            window_a_per_m: None,
            adaptation_rate_per_s: self.adaptation_rate_per_s,
            sensitivity_m_per_a_per_m: self.sensitivity_m_per_a_per_m,
        }
    }

    /// γ = rate / sensitivity², (A/m)²/(m² s).
    pub fn gain(&self) -> f64 {
        self.folded().gain()
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("decay_per_s", self.decay_per_s, "1/s")?;
        self.folded().validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EstimatorSettings, LawSettings};

    // Guards the sentences under their own names, and that a scenario can choose the law by its name alone.
    #[test]
    fn refusals_say_value_and_limit() {
        let base = ScalarLawSettings::default();
        assert_eq!(base.validate(), Ok(()));
        let decay = ScalarLawSettings {
            decay_per_s: 0.0,
            ..base
        };
        let settings = EstimatorSettings {
            law: LawSettings::Scalar(decay),
            ..EstimatorSettings::default()
        };
        let refused = settings.validate().unwrap_err().to_string();
        assert!(refused.starts_with("law.decay_per_s: 0 1/s"), "{refused}");
        let chosen: EstimatorSettings = serde_json::from_str(r#"{"law":{"Scalar":{}}}"#).unwrap();
        assert_eq!(chosen.law, LawSettings::Scalar(base));
        // Its covers are over all of Θ: a window is not one of its settings.
        assert!(serde_json::from_str::<EstimatorSettings>(r#"{"law":{"Scalar":{"window_a_per_m":30.0}}}"#).is_err());
    }
}
