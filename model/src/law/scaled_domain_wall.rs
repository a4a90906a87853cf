//! y = G M(v): the domain wall law where input and output need not be a field and a magnetization.
//!
//! v input in the unit of the material's field, M its magnetization ([`Hysteresis`]), G output per magnetization. Piezo ceramics
//! have walls, too; for them the numbers of the material are in volts and charges. Source: the paper's (1)-(7).

use serde::{Deserialize, Serialize};

use super::domain_wall::{Hysteresis, MagneticState};
use super::{HysteresisLaw, LawParameter};
use crate::ModelError;
use crate::error::require;

/// The law with its output's scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScaledDomainWall {
    /// G > 0.
    pub gain: f64,
    /// The material.
    pub hysteresis: Hysteresis,
}

impl HysteresisLaw for ScaledDomainWall {
    type State = MagneticState;

    fn rest(&self) -> MagneticState {
        self.hysteresis.rest()
    }

    fn parameters(&self) -> Vec<LawParameter> {
        // Gain and saturation are one number.
        let mut parameters = HysteresisLaw::parameters(&self.hysteresis);
        if let Some(saturation) = parameters.first_mut() {
            saturation.value *= self.gain;
        }
        parameters
    }

    fn validate(&self) -> Result<(), ModelError> {
        require(
            self.gain > 0.0,
            "gain of a domain wall law",
            self.gain,
            "(output per A/m)",
            "finite and above 0",
        )?;
        self.hysteresis.validate()
    }

    fn input(state: &MagneticState) -> f64 {
        state.field_a_per_m
    }

    fn output(&self, state: &MagneticState) -> f64 {
        self.gain * state.magnetization_a_per_m
    }

    fn advance(&self, state: &mut MagneticState, input_to: f64) {
        *state = self.hysteresis.advance(*state, input_to);
    }

    fn ahead(&self, state: &MagneticState, input_to: f64) -> (f64, f64) {
        let (output, slope) = self.hysteresis.ahead(state, input_to);
        (self.gain * output, self.gain * slope)
    }

    fn slope(&self, state: &MagneticState, rising: bool) -> f64 {
        self.gain * self.hysteresis.slope(*state, rising)
    }

    fn input_for(&self, state: &MagneticState, output_to: f64, input_limit: f64) -> (f64, bool) {
        self.hysteresis.input_for(state, output_to / self.gain, input_limit)
    }
}
