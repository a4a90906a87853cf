//! y = Y z,  dz/dv = (1 − κ|z|ⁿ (σ sgn(z dv) + 1 − σ))/w: the Bouc-Wen law in its normal form.
//!
//! v input, z ∈ [−1, 1] (no unit), w > 0 the input's way to yielding, Y ≥ 0 what the loop saturates at, n ≥ 1 how sharply it
//! yields, σ ∈ [1/2, 1] how a loop unloads (1/2: straight; 1: as it loads). In the usual letters: A = 1/w, β = σA, γ = (1 − σ)A. So far κ = 1.
//! With κ = −1 it stiffens instead: z has no bound (10³ here), n = 1, σ ≤ 1/2, and unloads 1 − 2σ times as steeply again as it loads.
//! Beside an elastic part it describes dampers, joints and shape memory wires; minor loops need not close, turning points are not
//! remembered. Rate-independent. Fourth order with steps of 0.025 w, or 0.025 w/(1 − 2σ); the result is continuous in the end of the input.
//! Without history: z = 0. Sources: Bouc (1967), Wen, J. Eng. Mech. Div. 102 (1976) 249; normal form: Ikhouane and Rodellar,
//! *Systems with Hysteresis* (2007), ch. 2.

use serde::{Deserialize, Serialize};

use super::{HysteresisLaw, LawParameter};
use crate::ModelError;
use crate::error::{require, require_not_negative, require_positive};

/// Of w: one step of the integration at most.
const STEP: f64 = 0.025;
/// After so many w it has saturated: z = ±1.
const FAR: f64 = 60.0;
/// No law that stiffens goes further.
const MAX_STIFFENED: f64 = 1e3;

/// The law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoucWen {
    /// Y, unit of the output.
    pub amplitude: f64,
    /// w, unit of the input.
    pub yield_input: f64,
    /// n.
    pub exponent: f64,
    /// σ.
    pub loading_share: f64,
    /// κ is −1.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stiffens: bool,
}

fn is_false(value: &bool) -> bool {
    !value
}

/// Where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoucWenState {
    /// v.
    pub input: f64,
    /// z.
    pub yielded: f64,
}

impl BoucWen {
    /// w dz/dv for a rising or a falling input.
    fn rate(&self, yielded: f64, direction: f64) -> f64 {
        let size = yielded.abs();
        let power = if self.exponent == 1.0 {
            size
        } else if self.exponent == 2.0 {
            size * size
        } else {
            libm::pow(size, self.exponent)
        };
        let sign = if yielded * direction >= 0.0 { 1.0 } else { -1.0 };
        let bend = power * (self.loading_share * sign + 1.0 - self.loading_share);
        if self.stiffens { 1.0 + bend } else { 1.0 - bend }
    }

    fn moved(&self, from: f64, way: f64) -> f64 {
        let direction = if way < 0.0 { -1.0 } else { 1.0 };
        // What stiffens is at its end long before.
        let mut left = way.abs().min(FAR);
        if way.is_nan() {
            return f64::NAN;
        }
        let mut yielded = from;
        // What unloads more steeply takes shorter steps.
        let stride = STEP / (1.0 - 2.0 * self.loading_share).max(1.0);
        while left > 0.0 {
            let step = direction * if left < stride { left } else { stride };
            let first = self.rate(yielded, direction);
            let second = self.rate(yielded + 0.5 * step * first, direction);
            let third = self.rate(yielded + 0.5 * step * second, direction);
            let fourth = self.rate(yielded + step * third, direction);
            yielded += step / 6.0 * (first + 2.0 * (second + third) + fourth);
            left -= stride;
        }
        let most = if self.stiffens { MAX_STIFFENED } else { 1.0 };
        yielded.clamp(-most, most)
    }
}

impl HysteresisLaw for BoucWen {
    type State = BoucWenState;

    fn rest(&self) -> BoucWenState {
        BoucWenState::default()
    }

    fn parameters(&self) -> Vec<LawParameter> {
        vec![
            LawParameter::weight("amplitude", self.amplitude),
            LawParameter::weight("yield_input", self.yield_input),
            LawParameter::new("exponent", self.exponent, [1.0, 20.0]),
            LawParameter::new("loading_share", self.loading_share, [-20.0, 1.0]),
        ]
    }

    fn validate(&self) -> Result<(), ModelError> {
        let Self {
            exponent,
            loading_share,
            ..
        } = *self;
        require_not_negative(self.amplitude, "amplitude of Bouc-Wen", "(unit of the output)")?;
        require_positive(self.yield_input, "yield input of Bouc-Wen", "(unit of the input)")?;
        require(
            (1.0..=20.0).contains(&exponent) && (!self.stiffens || exponent == 1.0),
            "exponent of Bouc-Wen",
            exponent,
            "",
            "from 1 to 20, and 1 where it stiffens",
        )?;
        let accepted = if self.stiffens {
            (-20.0..=0.5).contains(&loading_share)
        } else {
            (0.5..=1.0).contains(&loading_share)
        };
        require(
            accepted,
            "loading share of Bouc-Wen",
            loading_share,
            "",
            "from 0.5 to 1, or from -20 to 0.5 where it stiffens",
        )
    }

    fn input(state: &BoucWenState) -> f64 {
        state.input
    }

    fn output(&self, state: &BoucWenState) -> f64 {
        self.amplitude * state.yielded
    }

    fn advance(&self, state: &mut BoucWenState, input_to: f64) {
        state.yielded = self.moved(state.yielded, (input_to - state.input) / self.yield_input);
        state.input = input_to;
    }

    fn ahead(&self, state: &BoucWenState, input_to: f64) -> (f64, f64) {
        let mut there = *state;
        self.advance(&mut there, input_to);
        (self.output(&there), self.slope(&there, input_to > state.input))
    }

    fn slope(&self, state: &BoucWenState, rising: bool) -> f64 {
        let direction = if rising { 1.0 } else { -1.0 };
        if self.stiffens && direction * state.yielded >= MAX_STIFFENED {
            return 0.0;
        }
        self.amplitude / self.yield_input * self.rate(state.yielded, direction)
    }
}
