//! q τ² d²H/dt² + τ dH/dt = u − H: the current loop follows with a lag, of first order unless told.
//!
//! u command, H coil field (A/m), τ = 1/(2π bandwidth) (s), q second order (no unit): two poles of damping ratio 1/(2√q), 0.7 at q = 0.5, where
//! slow fields come as after a mere delay of τ. Propagated exactly, see `field_lag.rs` and `second_order.rs`.
//! It stands in series with a nominal bandwidth. Assumption: small signal.
//! Source: current amplifiers of giant magnetostrictive actuators, 1-5 kHz.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::field_lag::FieldLag;
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use super::second_order::SecondOrderLag;
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    summary: "the coil field follows the command with a lag",
    signature: "seen in the measured field: −20 dB a decade and phase −atan ωτ; gap proportional to rate, not to temperature",
    source: "current amplifiers of magnetostrictive actuators, 1-5 kHz",
    confused_with: &["eddy_current", "loop_delay", "sensor_delay"],
    parameters: &[
        ParameterSpec::size("time_constant_s", "s", [0.0, 0.02], 1e-6).by_ratio(),
        ParameterSpec::fixed("second_order", "", [0.0, 1.0], 0.0).believed(0.4),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum AmplifierBandwidth {
    First(FieldLag),
    Second(SecondOrderLag),
}

impl FieldEffect for AmplifierBandwidth {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        let second = SecondOrderLag::new(values[0], values[1], tick_s).map(AmplifierBandwidth::Second);
        Ok(second.unwrap_or_else(|| AmplifierBandwidth::First(FieldLag::new(values[0], tick_s))))
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        match self {
            AmplifierBandwidth::First(lag) => lag.steady_state(input),
            AmplifierBandwidth::Second(lag) => lag.steady_state(input),
        }
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        match self {
            AmplifierBandwidth::First(lag) => lag.follow(piece, output),
            AmplifierBandwidth::Second(lag) => lag.follow(piece, output),
        }
    }
}
