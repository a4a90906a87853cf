//! Settings of the law for several parameters.

use anhyst_ipc::Invalid;
use anhyst_model::HysteresisParameter;
use serde::{Deserialize, Serialize};

/// How well a parameter is known at the start, and how fast it wanders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ParameterSettings {
    /// Standard deviation of the start, as a share of the value; 0: the parameter is held. The estimate stays within a factor
    /// e^(±6 share), α within ±6 share of itself.
    pub share: f64,
    /// The parameter is expected to wander by this share of its value in a second, and by √t of it in t seconds.
    pub drift: f64,
}

impl Default for ParameterSettings {
    fn default() -> Self {
        Self {
            share: 0.05,
            drift: 5e-4,
        }
    }
}

impl ParameterSettings {
    const HELD: Self = Self { share: 0.0, drift: 0.0 };
}

/// Settings of the law for several parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MultiParameterSettings {
    /// Where `a` starts; the others start at what the material says.
    pub start_a_per_m: f64,
    /// Ms.
    pub saturation_magnetization: ParameterSettings,
    /// a.
    pub shape: ParameterSettings,
    /// k.
    pub pinning: ParameterSettings,
    /// α.
    pub coupling: ParameterSettings,
    /// c.
    pub reversibility: ParameterSettings,
    /// σ: rms noise of the displacement sensor.
    pub noise_m: f64,
    /// β: what is no noise (the error of the tangent, what no parameter explains) is the same for so many samples.
    pub annealing_samples: f64,
    /// A direction of the parameters is held while the recent motion tells it to no better than this share of what was known at
    /// the start.
    pub worst_deviation: f64,
}

impl Default for MultiParameterSettings {
    /// α is held: on one cut it cannot be told from `a`.
    fn default() -> Self {
        let usual = ParameterSettings::default();
        Self {
            start_a_per_m: 7012.0,
            saturation_magnetization: ParameterSettings { share: 0.02, ..usual },
            shape: ParameterSettings { drift: 3e-3, ..usual },
            pinning: usual,
            coupling: ParameterSettings::HELD,
            reversibility: ParameterSettings { share: 0.1, ..usual },
            noise_m: 10e-9,
            annealing_samples: 100.0,
            worst_deviation: 0.25,
        }
    }
}

/// Beyond this a logarithm is no small change any more.
const MAX_SHARE: f64 = 0.3;
/// Ends of a range, in start deviations.
const REACH: f64 = 6.0;

impl MultiParameterSettings {
    /// In the order of [`HysteresisParameter::ALL`].
    pub(crate) fn parameters(&self) -> [ParameterSettings; HysteresisParameter::COUNT] {
        [
            self.saturation_magnetization,
            self.shape,
            self.pinning,
            self.coupling,
            self.reversibility,
        ]
    }

    /// Ends of the range of a parameter that starts at `value`; `logarithmic` ones keep their sign.
    pub(crate) fn range(own: ParameterSettings, value: f64, logarithmic: bool) -> (f64, f64) {
        let reach = REACH * own.share;
        if logarithmic {
            return (value * libm::exp(-reach), value * libm::exp(reach));
        }
        (value - reach * value.abs(), value + reach * value.abs())
    }

    /// The shapes that the estimate may take, A/m.
    pub(crate) fn range_a_per_m(&self) -> (f64, f64) {
        Self::range(self.shape, self.start_a_per_m, true)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_positive("start_a_per_m", self.start_a_per_m, "A/m")?;
        let names = [
            "saturation_magnetization",
            "shape",
            "pinning",
            "coupling",
            "reversibility",
        ];
        for (name, own) in names.into_iter().zip(self.parameters()) {
            Invalid::unless_between(&format!("{name}.share"), own.share, 0.0, MAX_SHARE, "")?;
            Invalid::unless_between(&format!("{name}.drift"), own.drift, 0.0, 1.0, "")?;
        }
        if self.parameters().iter().all(|own| own.share == 0.0) {
            let sentence = "no parameter is estimated: give one of them a share above 0, or take FixedShape";
            return Err(Invalid::new("shape.share", sentence));
        }
        Invalid::unless_positive("noise_m", self.noise_m, "m")?;
        if self.noise_m * self.noise_m < f64::MIN_POSITIVE {
            let sentence = format!("{} m is too small: its square is 0", self.noise_m);
            return Err(Invalid::new("noise_m", sentence));
        }
        Invalid::unless_between("annealing_samples", self.annealing_samples, 0.0, 1e9, "")?;
        Invalid::unless_between("worst_deviation", self.worst_deviation, 1e-6, 1.0, "")
    }
}
