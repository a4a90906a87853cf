//! Settings of the laws that step along a slope: folded, scalar, gradient and matrix share them.

use super::bank::validate_bank;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Deserializer, Serialize};

/// Settings of the folded, scalar, gradient and matrix law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MinMaxSettings {
    /// Θ: the estimate stays within these shape parameters.
    pub range_a_per_m: (f64, f64),
    /// Where the estimate starts.
    pub start_a_per_m: f64,
    /// Models in the bank, evenly spread over the range.
    pub members: usize,
    /// μ, of the matrix law only: the output is y + ẏ/μ; it must be below the rod's damping k̂, 1/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_per_s: Option<f64>,
    /// κ: corner of the filters before output and prediction, 1/s; the paper's decay k in the scalar law. The matrix law
    /// multiplies noise above it by κ/μ.
    pub filter_per_s: f64,
    /// ε: output errors up to this change nothing; 0 in the matrix law: none is too small.
    pub dead_zone_m: f64,
    /// Covers are built over the members this near to the estimate; none: over the whole range. The laws' guarantee needs
    /// the true shape inside the window, their accuracy on a periodic motion needs a small one. Of the folded and the
    /// matrix law only.
    pub window_a_per_m: Option<f64>,
    /// How fast the estimate follows where the output is as sensitive as said below.
    pub adaptation_rate_per_s: f64,
    /// Typical change of the displacement with the shape parameter, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
}

impl MinMaxSettings {
    /// Tuned in the loop on 40 µm at 50 Hz and 12 µm at 150 Hz, 20 kHz ticks, 10 nm rms sensor noise, `a` drifting by
    /// 200 A/m per second. The dead zone is 1.25 times the noise that the filter lets through (σ √(κ dt/2) = 1.6 nm) and
    /// leaves ε/φ*, below 1 A/m, undetermined. The sensitivity is about the largest dY/da of that motion. Faster
    /// adaptation lags less and lets more noise into the estimate. A window over all of Θ leaves about 20 A/m when `a`
    /// falls.
    pub fn folded() -> Self {
        Self {
            range_a_per_m: (6300.0, 7300.0),
            start_a_per_m: 6800.0,
            members: 32,
            zero_per_s: None,
            filter_per_s: 1000.0,
            dead_zone_m: 2e-9,
            window_a_per_m: Some(30.0),
            adaptation_rate_per_s: 500.0,
            sensitivity_m_per_a_per_m: 4e-9,
        }
    }

    /// Of the scalar and the gradient law: those of the folded law, so that they differ by nothing but the law. On a cut
    /// the scalar law follows a rising `a` as well; twice as fast it overshoots on the way up and stays some 13 A/m above
    /// the truth. No setting brings it down from there: see `folded.rs`.
    pub fn without_window() -> Self {
        Self {
            window_a_per_m: None,
            ..Self::folded()
        }
    }

    /// Of the matrix law, tuned on the same cut. With the zero at half the rod's damping and the filter at the zero the
    /// sensor's noise is not lifted. No dead zone: then the law's V cannot grow at all, and the gap a* of the covers
    /// swallows small errors already; 2 nm would cost 0.1 A/m of lag. The rest is the folded law's, but twice as fast:
    /// this law has no filter of its own that would lag. Faster still lets more noise into the estimate than it saves in
    /// lag.
    pub fn matrix() -> Self {
        Self {
            zero_per_s: Some(4000.0),
            filter_per_s: 4000.0,
            dead_zone_m: 0.0,
            adaptation_rate_per_s: 1000.0,
            ..Self::folded()
        }
    }

    /// γ = rate / sensitivity², (A/m)²/(m² s).
    pub fn gain(&self) -> f64 {
        self.adaptation_rate_per_s / (self.sensitivity_m_per_a_per_m * self.sensitivity_m_per_a_per_m)
    }

    pub(super) fn validate(&self) -> Result<(), Invalid> {
        validate_bank(self.range_a_per_m, self.start_a_per_m, self.members, 2)?;
        if self.zero_per_s.is_some() {
            let sentence = "only the law Matrix has a zero: leave it out";
            return Err(Invalid::new("zero_per_s", sentence));
        }
        Invalid::unless_positive("filter_per_s", self.filter_per_s, "1/s")?;
        Invalid::unless_positive("dead_zone_m", self.dead_zone_m, "m")?;
        if let Some(window) = self.window_a_per_m {
            Invalid::unless_positive("window_a_per_m", window, "A/m")?;
        }
        Invalid::unless_positive("adaptation_rate_per_s", self.adaptation_rate_per_s, "1/s")?;
        Invalid::unless_positive("sensitivity_m_per_a_per_m", self.sensitivity_m_per_a_per_m, "m per A/m")?;
        if !self.gain().is_finite() {
            let sensitivity = self.sensitivity_m_per_a_per_m;
            return Err(Invalid::new(
                "sensitivity_m_per_a_per_m",
                format!("{sensitivity} m per A/m is too small: rate/sensitivity^2 is not a finite number"),
            ));
        }
        Ok(())
    }

    pub(super) fn validate_without_window(&self) -> Result<(), Invalid> {
        if self.window_a_per_m.is_some() {
            let sentence = "Scalar has its covers over the whole range and Gradient has none: leave it out";
            return Err(Invalid::new("window_a_per_m", sentence));
        }
        self.validate()
    }

    /// That the zero is below the rod's damping is checked where the rod is known.
    pub(super) fn validate_matrix(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("zero_per_s", self.zero_per_s.unwrap_or(0.0), "1/s")?;
        let dead_zone = self.dead_zone_m;
        if !(dead_zone.is_finite() && dead_zone >= 0.0) {
            return Err(Invalid::new(
                "dead_zone_m",
                format!("{dead_zone} m must be finite and not below 0 m"),
            ));
        }
        let as_folded = Self {
            zero_per_s: None,
            dead_zone_m: 1.0,
            ..*self
        };
        as_folded.validate()
    }
}

/// What a scenario says of them; what it leaves out is its law's default.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Said {
    #[serde(deserialize_with = "said")]
    range_a_per_m: Option<(f64, f64)>,
    #[serde(deserialize_with = "said")]
    start_a_per_m: Option<f64>,
    #[serde(deserialize_with = "said")]
    members: Option<usize>,
    #[serde(deserialize_with = "said")]
    zero_per_s: Option<f64>,
    #[serde(deserialize_with = "said", alias = "decay_per_s")]
    filter_per_s: Option<f64>,
    #[serde(deserialize_with = "said")]
    dead_zone_m: Option<f64>,
    #[serde(deserialize_with = "said")]
    window_a_per_m: Option<Option<f64>>,
    #[serde(deserialize_with = "said")]
    adaptation_rate_per_s: Option<f64>,
    #[serde(deserialize_with = "said")]
    sensitivity_m_per_a_per_m: Option<f64>,
}

/// A field that is there: `None` is a value of the window alone.
fn said<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

impl Said {
    pub(super) fn or(self, default: MinMaxSettings) -> MinMaxSettings {
        MinMaxSettings {
            range_a_per_m: self.range_a_per_m.unwrap_or(default.range_a_per_m),
            start_a_per_m: self.start_a_per_m.unwrap_or(default.start_a_per_m),
            members: self.members.unwrap_or(default.members),
            zero_per_s: self.zero_per_s.or(default.zero_per_s),
            filter_per_s: self.filter_per_s.unwrap_or(default.filter_per_s),
            dead_zone_m: self.dead_zone_m.unwrap_or(default.dead_zone_m),
            window_a_per_m: self.window_a_per_m.unwrap_or(default.window_a_per_m),
            adaptation_rate_per_s: self.adaptation_rate_per_s.unwrap_or(default.adaptation_rate_per_s),
            sensitivity_m_per_a_per_m: self
                .sensitivity_m_per_a_per_m
                .unwrap_or(default.sensitivity_m_per_a_per_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EstimatorSettings, LawSettings};

    fn refusal(law: LawSettings) -> String {
        let settings = EstimatorSettings {
            law,
            ..EstimatorSettings::default()
        };
        settings.validate().unwrap_err().to_string()
    }

    fn read(law: &str) -> Result<LawSettings, serde_json::Error> {
        serde_json::from_str(law)
    }

    // Guards the sentences: a user must see the value and the limit it broke.
    #[test]
    fn refusals_say_value_and_limit() {
        let base = MinMaxSettings::folded();
        let folded = |settings| refusal(LawSettings::Folded(settings));
        assert_eq!(EstimatorSettings::default().validate(), Ok(()));
        let start = folded(MinMaxSettings {
            start_a_per_m: 6200.0,
            ..base
        });
        assert!(
            start.starts_with("law.start_a_per_m: 6200 A/m is outside the range [6300, 7300]"),
            "{start}"
        );
        let range = folded(MinMaxSettings {
            range_a_per_m: (7300.0, 6300.0),
            ..base
        });
        assert!(
            range.contains("7300 A/m must be below the upper edge 6300 A/m"),
            "{range}"
        );
        assert!(folded(MinMaxSettings { members: 1, ..base }).contains("2 to 512"));
        let dead_zone = folded(MinMaxSettings {
            dead_zone_m: 0.0,
            ..base
        });
        assert!(dead_zone.contains("law.dead_zone_m: 0 m"), "{dead_zone}");
        let filter = folded(MinMaxSettings {
            filter_per_s: f64::NAN,
            ..base
        });
        assert!(filter.contains("NaN"), "{filter}");
        let sensitivity = folded(MinMaxSettings {
            sensitivity_m_per_a_per_m: 1e-200,
            ..base
        });
        assert!(sensitivity.contains("too small"), "{sensitivity}");
    }

    // Guards the matrix law's own sentences, and that a dead zone of 0 is one.
    #[test]
    fn the_matrix_law_has_limits_of_its_own() {
        let base = MinMaxSettings::matrix();
        let matrix = |settings| refusal(LawSettings::Matrix(settings));
        assert_eq!(base.validate_matrix(), Ok(()));
        let zero = matrix(MinMaxSettings {
            zero_per_s: Some(0.0),
            ..base
        });
        assert!(zero.starts_with("law.zero_per_s: 0 1/s"), "{zero}");
        let dead_zone = matrix(MinMaxSettings {
            dead_zone_m: -1e-9,
            ..base
        });
        assert!(dead_zone.starts_with("law.dead_zone_m: -0.000000001 m"), "{dead_zone}");
        assert!(matrix(MinMaxSettings { members: 1, ..base }).contains("2 to 512"));
        let filter = matrix(MinMaxSettings {
            filter_per_s: f64::INFINITY,
            ..base
        });
        assert!(filter.starts_with("law.filter_per_s: inf"), "{filter}");
    }

    // Guards scenarios as they are written: each law by its name alone has its own defaults, is read as it was written,
    // and refuses what it does not have.
    #[test]
    fn every_law_reads_its_own_settings() {
        for name in LawSettings::ADAPTIVE {
            let law = LawSettings::named(name).unwrap();
            assert_eq!(law.validate(), Ok(()), "{name}");
            let text = serde_json::to_string(&law).unwrap();
            assert_eq!(read(&text).unwrap(), law, "{text}");
            let variant = text.split('"').nth(1).unwrap();
            assert_eq!(read(&format!("{{\"{variant}\":{{}}}}")).unwrap(), law, "{variant}");
            assert!(
                read(&format!("{{\"{variant}\":{{\"dead_zone\":1}}}}")).is_err(),
                "{variant}"
            );
        }
        let LawSettings::Folded(folded) = read(r#"{"Folded":{"window_a_per_m":null,"filter_per_s":2000.0}}"#).unwrap()
        else {
            panic!("not folded");
        };
        assert_eq!((folded.window_a_per_m, folded.filter_per_s), (None, 2000.0));
        assert!(read(r#"{"Folded":{"filter_per_s":null}}"#).is_err());
        // The paper's word.
        let LawSettings::Scalar(scalar) = read(r#"{"Scalar":{"decay_per_s":0.0}}"#).unwrap() else {
            panic!("not scalar");
        };
        assert!(refusal(LawSettings::Scalar(scalar)).starts_with("law.filter_per_s: 0 1/s"));
        for (law, named) in [
            (r#"{"Scalar":{"window_a_per_m":30.0}}"#, "law.window_a_per_m: "),
            (r#"{"Gradient":{"window_a_per_m":30.0}}"#, "law.window_a_per_m: "),
            (r#"{"Folded":{"zero_per_s":4000.0}}"#, "law.zero_per_s: "),
        ] {
            let refused = refusal(read(law).unwrap());
            assert!(refused.starts_with(named), "{refused}");
        }
    }
}
