//! Which parameters are estimated, how well they are known beforehand, and how carefully the law goes.

use anhyst_ipc::Invalid;
use anhyst_model::{Hysteresis, HysteresisParameter};
use serde::{Deserialize, Serialize};

/// A parameter that is estimated; it starts at its value in the nominal material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatedParameter {
    /// Which one.
    pub parameter: HysteresisParameter,
    /// Standard deviation of its start, in its unit.
    pub start_deviation: f64,
    /// The estimate stays within; above 0 for all but the coupling.
    pub range: (f64, f64),
}

impl EstimatedParameter {
    /// A parameter known to `share` of its nominal value (0.05: 5 %), kept within six times that: within a factor e^(±6
    /// share), c below 0.99, α within ±6 share of itself. Not for a coupling of 0, whose deviation has to be said.
    pub fn around(parameter: HysteresisParameter, nominal: &Hysteresis, share: f64) -> Self {
        let value = parameter.of(nominal);
        let start_deviation = share * value.abs();
        let factor = libm::exp(6.0 * share);
        let range = match parameter {
            HysteresisParameter::Coupling => (value - 6.0 * start_deviation, value + 6.0 * start_deviation),
            HysteresisParameter::Reversibility => (value / factor, (value * factor).min(0.99)),
            _ => (value / factor, value * factor),
        };
        Self {
            parameter,
            start_deviation,
            range,
        }
    }

    fn validate(&self, nominal: &Hysteresis) -> Result<(), Invalid> {
        let (symbol, unit) = (self.parameter.symbol(), self.parameter.unit());
        Invalid::unless_positive(&format!("{symbol}.start_deviation"), self.start_deviation, unit)?;
        let path = format!("{symbol}.range");
        let (low, high) = self.range;
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(Invalid::new(
                path,
                format!("the lower edge {low} {unit} must be below the upper edge {high} {unit}, both finite"),
            ));
        }
        if self.parameter != HysteresisParameter::Coupling {
            Invalid::unless_positive(&path, low, unit)?;
        }
        if self.parameter == HysteresisParameter::Reversibility && high >= 1.0 {
            return Err(Invalid::new(path, format!("the upper edge {high} must be below 1")));
        }
        Invalid::unless_between(&path, self.parameter.of(nominal), low, high, unit)
    }
}

/// Settings of [`super::MultiParameterGaussNewton`] and [`super::estimate_parameters`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiParameterSettings {
    /// One to five, each once.
    pub parameters: Vec<EstimatedParameter>,
    /// σ: rms noise of what is measured, in its unit.
    pub noise: f64,
    /// β: an e-fold of what is known about an output takes at least this many samples. Far from the truth a larger β is
    /// safer; it costs a share β·m/N of the information of N samples about m parameters.
    #[serde(default = "default_annealing")]
    pub annealing_samples: f64,
    /// How often [`super::estimate_parameters`] goes over the data.
    #[serde(default = "default_passes")]
    pub passes: u32,
    /// Pairs correlated beyond this are reported as not told apart.
    #[serde(default = "default_correlation")]
    pub correlation_limit: f64,
}

fn default_annealing() -> f64 {
    100.0
}

fn default_passes() -> u32 {
    2
}

fn default_correlation() -> f64 {
    0.98
}

impl MultiParameterSettings {
    /// The usual settings for parameters known to `share` of their values, measured with noise of `noise` rms.
    pub fn around(parameters: &[HysteresisParameter], nominal: &Hysteresis, share: f64, noise: f64) -> Self {
        let around = |&parameter| EstimatedParameter::around(parameter, nominal, share);
        Self {
            parameters: parameters.iter().map(around).collect(),
            noise,
            annealing_samples: default_annealing(),
            passes: default_passes(),
            correlation_limit: default_correlation(),
        }
    }

    /// Checks every field against the material that the estimate starts from.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self, nominal: &Hysteresis) -> Result<(), Invalid> {
        if self.parameters.is_empty() {
            return Err(Invalid::new("parameters", "at least one parameter must be estimated"));
        }
        for (index, estimated) in self.parameters.iter().enumerate() {
            let before = &self.parameters[..index];
            if before.iter().any(|other| other.parameter == estimated.parameter) {
                let symbol = estimated.parameter.symbol();
                return Err(Invalid::new("parameters", format!("{symbol} is listed twice")));
            }
            estimated
                .validate(nominal)
                .map_err(|invalid| invalid.within("parameters"))?;
        }
        Invalid::unless_positive("noise", self.noise, "(unit of the output)")?;
        if self.noise * self.noise < f64::MIN_POSITIVE {
            let noise = self.noise;
            return Err(Invalid::new("noise", format!("{noise} is too small: its square is 0")));
        }
        Invalid::unless_between("annealing_samples", self.annealing_samples, 0.0, 1e9, "")?;
        Invalid::unless_between("passes", f64::from(self.passes), 1.0, 100.0, "")?;
        Invalid::unless_between("correlation_limit", self.correlation_limit, 0.0, 1.0, "")
    }
}
