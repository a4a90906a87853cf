//! What a fit found, in words and numbers, ready to be written as RON or JSON.

use anhyst_model::{Anhysteretic, HysteresisParameter};
use serde::{Deserialize, Serialize};

use crate::simulate::Beginning;

/// The whole result of a fit except the curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    pub source: String,
    pub data_hash: String,
    pub anhysteretic: Anhysteretic,
    pub parameters: Vec<FittedParameter>,
    /// a − α·Ms·s in A/m (s = 1/3 Langevin, 1 Ising): what the data fix even where a and α trade.
    pub effective_shape_a_per_m: Estimate,
    pub strain: Option<StrainReport>,
    pub loops: Vec<LoopReport>,
    /// Root of the mean over loops of the squared NRMSE (rms/range), from field alone.
    pub magnetization_nrmse: f64,
    pub strain_nrmse: Option<f64>,
    /// Correlations of the free parameters, in the order of `parameters` without the fixed ones.
    pub correlation: Vec<Vec<f64>>,
    pub condition_number: f64,
    pub search: SearchReport,
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
}

/// A value with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub value: f64,
    pub standard_deviation: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    pub parameter: HysteresisParameter,
    pub symbol: String,
    pub unit: String,
    pub value: f64,
    /// None where the user held it.
    pub standard_deviation: Option<f64>,
}

/// λ = γM² + zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrainReport {
    /// γ; its standard deviation is the one at the fitted magnetization.
    pub gamma_m2_per_a2: Estimate,
    /// λs = 2γMs²/3 with the fitted Ms.
    pub saturation_magnetostriction: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopReport {
    pub id: String,
    pub samples: usize,
    pub largest_field_a_per_m: f64,
    pub beginning: Beginning,
    /// Samples whose field was pooled with neighbours because it chattered.
    pub pooled_samples: usize,
    /// rms residual over range, from field alone.
    pub magnetization_nrmse: f64,
    pub magnetization_rms_a_per_m: f64,
    /// Zero of the instrument: measured M = true M + offset.
    pub magnetization_offset_a_per_m: f64,
    /// Correlation length of the residual of M, samples.
    pub correlation_length_samples: f64,
    pub strain: Option<LoopStrainReport>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopStrainReport {
    /// rms residual over range, from field alone.
    pub nrmse: f64,
    pub rms: f64,
    pub largest: f64,
    /// The same law fitted to the measured magnetization: what the strain law itself leaves.
    pub nrmse_from_measured_magnetization: f64,
    pub zero: f64,
}

/// How the parameters were found and how far the starts agree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchReport {
    pub seed: u64,
    pub candidates: usize,
    pub starts: usize,
    /// Starts that ended within [`AGREEMENT`] of the best NRMSE.
    pub agreeing_starts: usize,
    /// Smallest and largest value of each parameter among those starts.
    pub spread: Vec<(HysteresisParameter, f64, f64)>,
    /// NRMSE of the best start of every curve that was tried.
    pub curves: Vec<(Anhysteretic, f64)>,
}

/// Starts agree when their NRMSE differ by less than this share.
pub const AGREEMENT: f64 = 0.01;

impl FitReport {
    pub fn value(&self, parameter: HysteresisParameter) -> Option<f64> {
        self.found(parameter).map(|fitted| fitted.value)
    }

    pub fn standard_deviation(&self, parameter: HysteresisParameter) -> Option<f64> {
        self.found(parameter).and_then(|fitted| fitted.standard_deviation)
    }

    fn found(&self, parameter: HysteresisParameter) -> Option<&FittedParameter> {
        self.parameters.iter().find(|fitted| fitted.parameter == parameter)
    }
}
