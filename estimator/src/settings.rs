//! What a scenario says about the estimator: where the field comes from, which law corrects, how fast and how carefully.

mod excitation;
mod gauss_newton;
mod gradient;
mod matrix;
mod outlier;
mod scalar;
mod tuning;

pub use excitation::ExcitationSettings;
pub use gauss_newton::GaussNewtonSettings;
pub use gradient::GradientSettings;
pub use matrix::MatrixSettings;
pub use outlier::OutlierSettings;
pub use scalar::ScalarLawSettings;
pub use tuning::Tuning;

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Largest bank: a member costs about 20 ns a tick, and beyond some hundred members interpolation is not the error any more.
const MOST_MEMBERS: usize = 512;

/// Settings of the estimator.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EstimatorSettings {
    /// What drives the models.
    pub field: FieldSource,
    /// Corner of a high-pass on measured and predicted displacement alike; none: both are used as they are. Where the rod
    /// expands or a cut pushes it, a corner well below the profile's frequency keeps that out of the estimate.
    pub washout_hz: Option<f64>,
    /// When a motion informs about `a`; the estimate is held while it does not.
    pub excitation: ExcitationSettings,
    /// Which measurements are left out.
    pub outlier: OutlierSettings,
    /// How `a` is corrected.
    pub law: LawSettings,
}

/// Best knowledge of the coil field. A noisy field must not drive a rate-independent model directly: where the field moves
/// more slowly than its noise (at rest, in slow sweeps) every sign change of the noise is a reversal to the model.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum FieldSource {
    /// The commanded field through the model of the amplifier.
    #[default]
    Commanded,
    /// The measured field through a play (dead band).
    Measured {
        /// Half-width of the play; about three standard deviations of the field sensor.
        play_a_per_m: f64,
    },
}

/// Which law, with its settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum LawSettings {
    /// No adaptation: `a` is what the scenario says.
    FixedShape {
        /// Shape parameter a.
        shape_a_per_m: f64,
    },
    /// The min-max law on outputs folded through the rod.
    Folded(FoldedSettings),
    /// Recursive Gauss-Newton with a standard deviation.
    GaussNewton(GaussNewtonSettings),
    /// Plain gradient, for comparison.
    Gradient(GradientSettings),
    /// The paper's matrix law on the displacement and its rate.
    Matrix(MatrixSettings),
    /// The paper's scalar form on the displacement.
    Scalar(ScalarLawSettings),
}

impl Default for LawSettings {
    fn default() -> Self {
        Self::Folded(FoldedSettings::default())
    }
}

/// Settings of the folded law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FoldedSettings {
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
    /// Covers are built over the members this near to the estimate; none: over the whole range. The law's guarantee needs
    /// the true shape inside the window, its accuracy on a periodic motion needs a small one.
    pub window_a_per_m: Option<f64>,
    /// How fast the estimate follows where the output is as sensitive as said below.
    pub adaptation_rate_per_s: f64,
    /// Typical change of the displacement with the shape parameter, m per A/m.
    pub sensitivity_m_per_a_per_m: f64,
}

impl Default for FoldedSettings {
    /// Tuned in the loop on 40 µm at 50 Hz and 12 µm at 150 Hz, 20 kHz ticks, 10 nm rms sensor noise, `a` drifting by
    /// 200 A/m per second. The dead zone is 1.25 times the noise that the filter lets through (σ √(κ dt/2) = 1.6 nm) and
    /// leaves ε/φ*, below 1 A/m, undetermined. The sensitivity is about the largest dY/da of that motion. Faster adaptation lags
    /// less and lets more noise into the estimate. A window over all of Θ leaves about 20 A/m when `a` falls.
    fn default() -> Self {
        Self {
            range_a_per_m: (6300.0, 7300.0),
            start_a_per_m: 6800.0,
            members: 33,
            filter_per_s: 1000.0,
            dead_zone_m: 2e-9,
            window_a_per_m: Some(30.0),
            adaptation_rate_per_s: 500.0,
            sensitivity_m_per_a_per_m: 4e-9,
        }
    }
}

impl FoldedSettings {
    /// γ = rate / sensitivity², (A/m)²/(m² s).
    pub fn gain(&self) -> f64 {
        self.adaptation_rate_per_s / (self.sensitivity_m_per_a_per_m * self.sensitivity_m_per_a_per_m)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        validate_bank(self.range_a_per_m, self.start_a_per_m, self.members, 2)?;
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
}

/// A range that can be spanned, a start inside it, and a bank of at least `least` and not too many members.
fn validate_bank((lower, upper): (f64, f64), start: f64, members: usize, least: usize) -> Result<(), Invalid> {
    Invalid::unless_positive("range_a_per_m", lower, "A/m")?;
    Invalid::unless_positive("range_a_per_m", upper, "A/m")?;
    if lower >= upper {
        return Err(Invalid::new(
            "range_a_per_m",
            format!("the lower edge {lower} A/m must be below the upper edge {upper} A/m"),
        ));
    }
    if !(lower..=upper).contains(&start) {
        return Err(Invalid::new(
            "start_a_per_m",
            format!("{start} A/m is outside the range [{lower}, {upper}] A/m, which the estimate may not leave"),
        ));
    }
    if !(least..=MOST_MEMBERS).contains(&members) {
        return Err(Invalid::new(
            "members",
            format!("{members} models cannot span a range; {least} to {MOST_MEMBERS} are possible"),
        ));
    }
    Ok(())
}

impl LawSettings {
    /// Names of the laws that adapt, as [`LawSettings::named`] takes them.
    pub const ADAPTIVE: [&'static str; 5] = ["folded", "gauss-newton", "matrix", "scalar", "gradient"];

    /// A law with its default settings.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "folded" => LawSettings::Folded(FoldedSettings::default()),
            "gauss-newton" => LawSettings::GaussNewton(GaussNewtonSettings::default()),
            "matrix" => LawSettings::Matrix(MatrixSettings::default()),
            "scalar" => LawSettings::Scalar(ScalarLawSettings::default()),
            "gradient" => LawSettings::Gradient(GradientSettings::default()),
            _ => return None,
        })
    }

    /// The shapes that the estimate may take, A/m; twice the same where it is fixed.
    pub fn range_a_per_m(&self) -> (f64, f64) {
        match self {
            LawSettings::FixedShape { shape_a_per_m } => (*shape_a_per_m, *shape_a_per_m),
            LawSettings::Folded(folded) => folded.range_a_per_m,
            LawSettings::GaussNewton(gauss_newton) => gauss_newton.range_a_per_m,
            LawSettings::Gradient(gradient) => gradient.range_a_per_m,
            LawSettings::Matrix(matrix) => matrix.range_a_per_m,
            LawSettings::Scalar(scalar) => scalar.range_a_per_m,
        }
    }

    /// Members of the law's bank.
    pub fn members(&self) -> usize {
        match self {
            LawSettings::FixedShape { .. } => 1,
            LawSettings::Folded(folded) => folded.members,
            LawSettings::GaussNewton(gauss_newton) => gauss_newton.members,
            LawSettings::Gradient(gradient) => gradient.members,
            LawSettings::Matrix(matrix) => matrix.members,
            LawSettings::Scalar(scalar) => scalar.members,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        match self {
            LawSettings::FixedShape { shape_a_per_m } => {
                Invalid::unless_positive("shape_a_per_m", *shape_a_per_m, "A/m")
            }
            LawSettings::Folded(folded) => folded.validate(),
            LawSettings::GaussNewton(gauss_newton) => gauss_newton.validate(),
            LawSettings::Gradient(gradient) => gradient.validate(),
            LawSettings::Matrix(matrix) => matrix.validate(),
            LawSettings::Scalar(scalar) => scalar.validate(),
        }
    }
}

impl EstimatorSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        if let FieldSource::Measured { play_a_per_m } = self.field
            && !(play_a_per_m.is_finite() && play_a_per_m >= 0.0)
        {
            return Err(Invalid::new(
                "field.play_a_per_m",
                format!("{play_a_per_m} A/m must be finite and not below 0 A/m"),
            ));
        }
        if let Some(corner_hz) = self.washout_hz {
            Invalid::unless_positive("washout_hz", corner_hz, "Hz")?;
        }
        self.excitation
            .validate()
            .map_err(|invalid| invalid.within("excitation"))?;
        self.outlier.validate().map_err(|invalid| invalid.within("outlier"))?;
        self.law.validate().map_err(|invalid| invalid.within("law"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(folded: FoldedSettings) -> String {
        let settings = EstimatorSettings {
            law: LawSettings::Folded(folded),
            ..EstimatorSettings::default()
        };
        settings.validate().unwrap_err().to_string()
    }

    // Guards the sentences: a user must see the value and the limit it broke.
    #[test]
    fn refusals_say_value_and_limit() {
        let base = FoldedSettings::default();
        assert_eq!(EstimatorSettings::default().validate(), Ok(()));
        let start = refusal(FoldedSettings {
            start_a_per_m: 6200.0,
            ..base
        });
        assert!(
            start.starts_with("law.start_a_per_m: 6200 A/m is outside the range [6300, 7300]"),
            "{start}"
        );
        let range = refusal(FoldedSettings {
            range_a_per_m: (7300.0, 6300.0),
            ..base
        });
        assert!(
            range.contains("7300 A/m must be below the upper edge 6300 A/m"),
            "{range}"
        );
        assert!(refusal(FoldedSettings { members: 1, ..base }).contains("2 to 512"));
        assert!(
            refusal(FoldedSettings {
                dead_zone_m: 0.0,
                ..base
            })
            .contains("law.dead_zone_m: 0 m")
        );
        assert!(
            refusal(FoldedSettings {
                filter_per_s: f64::NAN,
                ..base
            })
            .contains("NaN")
        );
        assert!(
            refusal(FoldedSettings {
                sensitivity_m_per_a_per_m: 1e-200,
                ..base
            })
            .contains("too small")
        );
        let play = EstimatorSettings {
            field: FieldSource::Measured { play_a_per_m: -1.0 },
            ..Default::default()
        };
        assert!(
            play.validate()
                .unwrap_err()
                .to_string()
                .contains("field.play_a_per_m: -1 A/m")
        );
    }

    // Guards the other laws' sentences, and that the path names the part of the settings.
    #[test]
    fn every_part_is_checked() {
        let refused = |gauss_newton| {
            let law = LawSettings::GaussNewton(gauss_newton);
            let settings = EstimatorSettings {
                law,
                ..EstimatorSettings::default()
            };
            settings.validate().unwrap_err().to_string()
        };
        let base = GaussNewtonSettings::default();
        assert!(refused(GaussNewtonSettings { members: 4, ..base }).contains("5 to 512"));
        assert!(
            refused(GaussNewtonSettings {
                noise_m: 1e-200,
                ..base
            })
            .contains("its square is 0")
        );
        let drift = refused(GaussNewtonSettings {
            drift_variance_per_s: -1.0,
            ..base
        });
        assert!(drift.starts_with("law.drift_variance_per_s: -1 (A/m)^2/s"), "{drift}");
        let excitation = ExcitationSettings {
            memory_s: 0.0,
            ..ExcitationSettings::default()
        };
        let monitor = EstimatorSettings {
            excitation,
            ..EstimatorSettings::default()
        };
        let memory = monitor.validate().unwrap_err().to_string();
        assert!(memory.starts_with("excitation.memory_s: 0 s"), "{memory}");
        let outlier = EstimatorSettings {
            outlier: OutlierSettings {
                innovation_limit_m: Some(-1e-6),
                ..OutlierSettings::default()
            },
            ..EstimatorSettings::default()
        };
        let limit = outlier.validate().unwrap_err().to_string();
        assert!(limit.starts_with("outlier.innovation_limit_m: -0.000001 m"), "{limit}");
    }

    // Guards against misspelt settings that would silently keep their defaults.
    #[test]
    fn unknown_fields_are_refused() {
        assert!(serde_json::from_str::<EstimatorSettings>(r#"{"law":{"Folded":{"dead_zone":1}}}"#).is_err());
        assert!(serde_json::from_str::<EstimatorSettings>(r#"{"laws":1}"#).is_err());
    }
}
