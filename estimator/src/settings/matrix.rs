//! Settings of the matrix law in the loop.

use super::FoldedSettings;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the matrix law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MatrixSettings {
    /// Θ: the estimate stays within these shape parameters.
    pub range_a_per_m: (f64, f64),
    /// Where the estimate starts.
    pub start_a_per_m: f64,
    /// Models in the bank, evenly spread over the range.
    pub members: usize,
    /// μ: the output is y + ẏ/μ; it must be below the rod's damping k̂, 1/s.
    pub zero_per_s: f64,
    /// κ: corner of the filter before output and prediction, 1/s; noise above it is multiplied by κ/μ.
    pub filter_per_s: f64,
    /// ε: output errors up to this change nothing; 0: none is too small.
    pub dead_zone_m: f64,
    /// Covers are built over the members this near to the estimate; none: over the whole range.
    pub window_a_per_m: Option<f64>,
    /// How fast the estimate follows where the output is as sensitive as said below.
    pub adaptation_rate_per_s: f64,
    /// Typical change of the displacement with the shape parameter, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
}

impl Default for MatrixSettings {
    /// Tuned on 40 µm at 50 Hz and 12 µm at 150 Hz, 20 kHz ticks, 10 nm rms sensor noise, `a` drifting by 200 A/m per
    /// second. With the zero at half the rod's damping and the filter at the zero the sensor's noise is not lifted. No
    /// dead zone: then the law's V cannot grow at all, and the gap a* of the covers swallows small errors already; 2 nm
    /// would cost 0.1 A/m of lag. The rest is the folded law's, but twice as fast: this law has no filter of its own
    /// that would lag. Faster still lets more noise into the estimate than it saves in lag.
    fn default() -> Self {
        let folded = FoldedSettings::default();
        Self {
            range_a_per_m: folded.range_a_per_m,
            start_a_per_m: folded.start_a_per_m,
            members: folded.members,
            zero_per_s: 4000.0,
            filter_per_s: 4000.0,
            dead_zone_m: 0.0,
            window_a_per_m: folded.window_a_per_m,
            adaptation_rate_per_s: 1000.0,
            sensitivity_m_per_a_per_m: folded.sensitivity_m_per_a_per_m,
        }
    }
}

impl MatrixSettings {
    /// The folded law's settings of the same names.
    pub(crate) fn folded(&self) -> FoldedSettings {
        FoldedSettings {
            range_a_per_m: self.range_a_per_m,
            start_a_per_m: self.start_a_per_m,
            members: self.members,
            filter_per_s: self.filter_per_s,
            dead_zone_m: self.dead_zone_m,
            window_a_per_m: self.window_a_per_m,
            adaptation_rate_per_s: self.adaptation_rate_per_s,
            sensitivity_m_per_a_per_m: self.sensitivity_m_per_a_per_m,
        }
    }

    /// γ = rate / sensitivity², (A/m)²/(m² s).
    pub fn gain(&self) -> f64 {
        self.folded().gain()
    }

    /// Checks every field; that the zero is below the rod's damping is checked where the rod is known.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("zero_per_s", self.zero_per_s, "1/s")?;
        let dead_zone = self.dead_zone_m;
        if !(dead_zone.is_finite() && dead_zone >= 0.0) {
            return Err(Invalid::new(
                "dead_zone_m",
                format!("{dead_zone} m must be finite and not below 0 m"),
            ));
        }
        let with_any_dead_zone = FoldedSettings {
            dead_zone_m: 1.0,
            ..self.folded()
        };
        with_any_dead_zone.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EstimatorSettings, LawSettings};

    fn refusal(matrix: MatrixSettings) -> String {
        let settings = EstimatorSettings {
            law: LawSettings::Matrix(matrix),
            ..EstimatorSettings::default()
        };
        settings.validate().unwrap_err().to_string()
    }

    // Guards the sentences, that a dead zone of 0 is one, and that a scenario can choose the law by its name alone.
    #[test]
    fn refusals_say_value_and_limit() {
        let base = MatrixSettings::default();
        assert_eq!(base.validate(), Ok(()));
        let zero = refusal(MatrixSettings {
            zero_per_s: 0.0,
            ..base
        });
        assert!(zero.starts_with("law.zero_per_s: 0 1/s"), "{zero}");
        let dead_zone = refusal(MatrixSettings {
            dead_zone_m: -1e-9,
            ..base
        });
        assert!(dead_zone.starts_with("law.dead_zone_m: -0.000000001 m"), "{dead_zone}");
        assert!(refusal(MatrixSettings { members: 1, ..base }).contains("2 to 512"));
        assert!(
            refusal(MatrixSettings {
                filter_per_s: f64::INFINITY,
                ..base
            })
            .starts_with("law.filter_per_s: inf")
        );
        let chosen: EstimatorSettings = serde_json::from_str(r#"{"law":{"Matrix":{}}}"#).unwrap();
        assert_eq!(chosen.law, LawSettings::Matrix(base));
        assert!(serde_json::from_str::<EstimatorSettings>(r#"{"law":{"Matrix":{"zero":1}}}"#).is_err());
    }
}
