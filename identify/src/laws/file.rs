//! A fitted law as a file: `law.ron`.

use anhyst_measured::Quantity;
use anhyst_model::{HysteresisLaw, LawModel, ModelError};
use serde::{Deserialize, Serialize};

use super::{EvenCurve, Reaction, Start};

/// A law with what it is of and where its records begin. All numbers in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawFile {
    /// What drives it.
    pub input: Quantity,
    /// What it gives.
    pub output: Quantity,
    /// What is assumed before a record.
    pub start: Start,
    /// Of the input that it was fitted to.
    pub input_extent: [f64; 2],
    /// Before the law.
    #[serde(default)]
    pub reaction: Reaction,
    /// Noise floor under the output that it was fitted to, rms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_rms: Option<f64>,
    pub model: LawModel,
    /// Of a strain: the model gives the magnetization, and this the strain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub even: Option<EvenCurve>,
    /// The output falls as the input rises: it is the model's with the other sign.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub falls: bool,
}

impl LawFile {
    /// # Errors
    /// The first number that the law does not take.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.model.validate()
    }

    /// From what the model gives to what is measured.
    pub(super) fn told(&self, run: &mut [f64]) {
        for made in run {
            if let Some(even) = &self.even {
                *made = even.at(*made, self.model.offset);
            }
            if self.falls {
                *made = -*made;
            }
        }
    }
}
