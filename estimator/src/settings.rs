//! What a scenario says about the estimator: where the field comes from, which law corrects, how fast and how carefully.

mod bank;
mod excitation;
mod gauss_newton;
mod min_max;
mod multi_parameter;
mod outlier;
mod tuning;
mod weights;

pub use excitation::ExcitationSettings;
pub use gauss_newton::GaussNewtonSettings;
pub use min_max::MinMaxSettings;
pub use multi_parameter::{MultiParameterSettings, ParameterSettings};
pub use outlier::OutlierSettings;
pub use tuning::Tuning;
pub use weights::WeightSettings;

use anhyst_ipc::Invalid;
use min_max::Said;
use serde::{Deserialize, Serialize};

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
#[serde(from = "SaidLaw")]
pub enum LawSettings {
    /// No adaptation: `a` is what the scenario says.
    FixedShape {
        /// Shape parameter a.
        shape_a_per_m: f64,
    },
    /// The min-max law on outputs folded through the rod.
    Folded(MinMaxSettings),
    /// Recursive Gauss-Newton with a standard deviation.
    GaussNewton(GaussNewtonSettings),
    /// Plain gradient, for comparison.
    Gradient(MinMaxSettings),
    /// The paper's matrix law on the displacement and its rate.
    Matrix(MinMaxSettings),
    /// Recursive Gauss-Newton over several of [Ms, a, k, α, c].
    MultiParameter(MultiParameterSettings),
    /// The paper's scalar form on the displacement.
    Scalar(MinMaxSettings),
    /// Of a material with another law: its weights, by a recursive Gram matrix and coordinate descent.
    Weights(WeightSettings),
    /// Of a material with another law: its weights are what the material says.
    FixedWeights,
}

/// A law as a scenario writes it.
#[derive(Deserialize)]
#[serde(rename = "LawSettings", deny_unknown_fields)]
enum SaidLaw {
    FixedShape { shape_a_per_m: f64 },
    Folded(Said),
    GaussNewton(GaussNewtonSettings),
    Gradient(Said),
    Matrix(Said),
    MultiParameter(MultiParameterSettings),
    Scalar(Said),
    Weights(WeightSettings),
    FixedWeights,
}

impl From<SaidLaw> for LawSettings {
    fn from(law: SaidLaw) -> Self {
        match law {
            SaidLaw::FixedShape { shape_a_per_m } => LawSettings::FixedShape { shape_a_per_m },
            SaidLaw::Folded(said) => LawSettings::Folded(said.or(MinMaxSettings::folded())),
            SaidLaw::GaussNewton(settings) => LawSettings::GaussNewton(settings),
            SaidLaw::Gradient(said) => LawSettings::Gradient(said.or(MinMaxSettings::without_window())),
            SaidLaw::Matrix(said) => LawSettings::Matrix(said.or(MinMaxSettings::matrix())),
            SaidLaw::MultiParameter(settings) => LawSettings::MultiParameter(settings),
            SaidLaw::Scalar(said) => LawSettings::Scalar(said.or(MinMaxSettings::without_window())),
            SaidLaw::Weights(settings) => LawSettings::Weights(settings),
            SaidLaw::FixedWeights => LawSettings::FixedWeights,
        }
    }
}

impl Default for LawSettings {
    fn default() -> Self {
        Self::Folded(MinMaxSettings::folded())
    }
}

impl LawSettings {
    /// Names of the laws that adapt `a` alone, as [`LawSettings::named`] takes them.
    pub const ADAPTIVE: [&'static str; 5] = ["folded", "gauss-newton", "matrix", "scalar", "gradient"];

    /// The same law, adapting no faster than so (1/s); those without a rate stay.
    #[must_use]
    pub fn slowed(mut self, most_per_s: f64) -> Self {
        if let Self::Folded(own) | Self::Gradient(own) | Self::Matrix(own) | Self::Scalar(own) = &mut self {
            own.adaptation_rate_per_s = own.adaptation_rate_per_s.min(most_per_s);
        }
        self
    }

    /// A law with its default settings.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "folded" => LawSettings::Folded(MinMaxSettings::folded()),
            "gauss-newton" => LawSettings::GaussNewton(GaussNewtonSettings::default()),
            "matrix" => LawSettings::Matrix(MinMaxSettings::matrix()),
            "scalar" => LawSettings::Scalar(MinMaxSettings::without_window()),
            "gradient" => LawSettings::Gradient(MinMaxSettings::without_window()),
            _ => return None,
        })
    }

    /// It is for a material with another law than the domain wall's.
    pub fn is_of_weights(&self) -> bool {
        matches!(self, Self::Weights(_) | Self::FixedWeights)
    }

    /// Those of a law that steps along a slope.
    pub(crate) fn min_max(&self) -> Option<&MinMaxSettings> {
        match self {
            Self::Folded(own) | Self::Gradient(own) | Self::Matrix(own) | Self::Scalar(own) => Some(own),
            Self::FixedShape { .. }
            | Self::GaussNewton(_)
            | Self::MultiParameter(_)
            | Self::Weights(_)
            | Self::FixedWeights => None,
        }
    }

    /// The shapes that the estimate may take, A/m; twice the same where it is fixed, 0 where there is none.
    pub fn range_a_per_m(&self) -> (f64, f64) {
        match self {
            Self::FixedShape { shape_a_per_m } => (*shape_a_per_m, *shape_a_per_m),
            Self::GaussNewton(own) => own.range_a_per_m,
            Self::MultiParameter(own) => own.range_a_per_m(),
            Self::Weights(_) | Self::FixedWeights => (0.0, 0.0),
            Self::Folded(own) | Self::Gradient(own) | Self::Matrix(own) | Self::Scalar(own) => own.range_a_per_m,
        }
    }

    /// The same law with the estimate's start there; fixed there, where it is fixed.
    #[must_use]
    pub fn starting_at(mut self, start_a_per_m: f64) -> Self {
        match &mut self {
            Self::FixedShape { shape_a_per_m } => *shape_a_per_m = start_a_per_m,
            Self::GaussNewton(own) => own.start_a_per_m = start_a_per_m,
            Self::MultiParameter(own) => own.start_a_per_m = start_a_per_m,
            Self::Weights(_) | Self::FixedWeights => {}
            Self::Folded(own) | Self::Gradient(own) | Self::Matrix(own) | Self::Scalar(own) => {
                own.start_a_per_m = start_a_per_m;
            }
        }
        self
    }

    /// Members of the law's bank; 1 where it has none.
    pub fn members(&self) -> usize {
        match self {
            Self::FixedShape { .. } | Self::MultiParameter(_) | Self::Weights(_) | Self::FixedWeights => 1,
            Self::GaussNewton(own) => own.members,
            Self::Folded(own) | Self::Gradient(own) | Self::Matrix(own) | Self::Scalar(own) => own.members,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        match self {
            Self::FixedShape { shape_a_per_m } => Invalid::unless_positive("shape_a_per_m", *shape_a_per_m, "A/m"),
            Self::GaussNewton(own) => own.validate(),
            Self::MultiParameter(own) => own.validate(),
            Self::Folded(own) => own.validate(),
            Self::Gradient(own) | Self::Scalar(own) => own.validate_without_window(),
            Self::Matrix(own) => own.validate_matrix(),
            Self::Weights(own) => own.validate(),
            Self::FixedWeights => Ok(()),
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

    // Guards the sentences outside the min-max laws, and that the path names the part of the settings.
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
        let play = EstimatorSettings {
            field: FieldSource::Measured { play_a_per_m: -1.0 },
            ..EstimatorSettings::default()
        };
        let play = play.validate().unwrap_err().to_string();
        assert!(play.contains("field.play_a_per_m: -1 A/m"), "{play}");
    }

    // Guards against misspelt settings that would silently keep their defaults.
    #[test]
    fn unknown_fields_are_refused() {
        assert!(serde_json::from_str::<EstimatorSettings>(r#"{"laws":1}"#).is_err());
    }
}
