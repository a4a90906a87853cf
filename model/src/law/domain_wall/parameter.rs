//! The five parameters θ = [Ms, a, k, α, c] as a list: for sensitivities, estimates and reports.

use serde::{Deserialize, Serialize};

use super::Hysteresis;
use crate::parameter::HYSTERESIS;

/// One parameter of the domain wall model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum HysteresisParameter {
    /// Ms, A/m.
    SaturationMagnetization,
    /// a, A/m.
    Shape,
    /// k, A/m.
    Pinning,
    /// α, no unit.
    Coupling,
    /// c, no unit.
    Reversibility,
}

impl HysteresisParameter {
    pub const COUNT: usize = 5;

    /// In the order of every list of five.
    pub const ALL: [HysteresisParameter; Self::COUNT] = [
        HysteresisParameter::SaturationMagnetization,
        HysteresisParameter::Shape,
        HysteresisParameter::Pinning,
        HysteresisParameter::Coupling,
        HysteresisParameter::Reversibility,
    ];

    /// Its place in [`Self::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The paper's letter.
    pub const fn symbol(self) -> &'static str {
        HYSTERESIS[self.index()].symbol
    }

    /// The unit, empty where there is none.
    pub const fn unit(self) -> &'static str {
        HYSTERESIS[self.index()].unit
    }

    /// Its value.
    pub fn of(self, hysteresis: &Hysteresis) -> f64 {
        hysteresis.parameters()[self.index()]
    }

    /// The same material with another value. The result may be invalid: [`Hysteresis::validate`].
    #[must_use]
    pub fn with(self, hysteresis: Hysteresis, value: f64) -> Hysteresis {
        let mut parameters = hysteresis.parameters();
        parameters[self.index()] = value;
        hysteresis.with_parameters(parameters)
    }
}

impl Hysteresis {
    /// Ms, a, k, α, c, in the order of [`HysteresisParameter::ALL`].
    #[inline]
    pub fn parameters(&self) -> [f64; HysteresisParameter::COUNT] {
        [
            self.saturation_magnetization_a_per_m,
            self.shape_a_per_m,
            self.pinning_a_per_m,
            self.coupling,
            self.reversibility,
        ]
    }

    /// The same curve with other parameters. The result may be invalid: [`Hysteresis::validate`].
    #[inline]
    #[must_use]
    pub fn with_parameters(self, parameters: [f64; HysteresisParameter::COUNT]) -> Self {
        let [saturation, shape, pinning, coupling, reversibility] = parameters;
        Hysteresis {
            saturation_magnetization_a_per_m: saturation,
            shape_a_per_m: shape,
            pinning_a_per_m: pinning,
            coupling,
            reversibility,
            ..self
        }
    }
}
