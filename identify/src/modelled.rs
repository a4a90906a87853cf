//! Measured loops beside the model's, at the fitted parameters.

use anhyst_measured::MeasuredRun;
use anhyst_model::Hysteresis;

use crate::observed::{Nuisance, ObservedLoop};
use crate::residuals::Observation;
use crate::strain::StrainLaw;

/// One loop, measured and modelled, in the instrument's own zeros.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedLoop {
    pub id: String,
    pub field_a_per_m: Vec<f64>,
    pub measured_magnetization_a_per_m: Vec<f64>,
    pub model_magnetization_a_per_m: Vec<f64>,
    pub strain: Option<FittedStrain>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FittedStrain {
    pub measured: Vec<f64>,
    pub model: Vec<f64>,
}

/// Model curves at the fitted parameters, free of the instrument's zeros.
pub(crate) struct Modelled {
    pub magnetizations: Vec<Vec<f64>>,
    pub law: Option<StrainLaw>,
}

impl Modelled {
    pub fn of(observation: &Observation, hysteresis: &Hysteresis, nuisance: &Nuisance) -> Self {
        let magnetizations = observation.magnetizations(hysteresis, &nuisance.start);
        let law = StrainLaw::solve(&observation.loops, &magnetizations);
        Modelled { magnetizations, law }
    }

    /// The curves as the instrument would show them.
    pub fn loops(&self, measured: &[MeasuredRun], observation: &Observation, nuisance: &Nuisance) -> Vec<FittedLoop> {
        let fitted = |(index, of): (usize, &ObservedLoop)| {
            let offset = nuisance.offset[index] * of.magnetization_range_a_per_m;
            let model = &self.magnetizations[index];
            let strain = of.strain.clone().zip(self.law.as_ref());
            FittedLoop {
                id: measured[index].loop_id.clone(),
                field_a_per_m: of.field_a_per_m.clone(),
                measured_magnetization_a_per_m: of.magnetization_a_per_m.clone(),
                model_magnetization_a_per_m: model.iter().map(|m| m + offset).collect(),
                strain: strain.map(|(measured, law)| FittedStrain {
                    measured,
                    model: law.along(index, model),
                }),
            }
        };
        observation.loops.iter().enumerate().map(fitted).collect()
    }
}
