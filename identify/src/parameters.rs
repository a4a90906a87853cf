//! The five parameters and the coordinates in which they are searched.
//!
//! On one loop a and α can hardly be told apart: a_eff = a − α·Ms·s is what the data fix (s = 1/3 Langevin, 1 Ising:
//! the initial slope of the curve). So the search runs over Ms, a_eff, k, c and w = ln(a/a_eff), from which
//!   a = a_eff·e^w,  α = (a − a_eff)/(s·Ms).
//! Then α·χ₀ = 1 − e^(−w) stays below 1 by itself. Each coordinate v lies between bounds through a logistic function of a
//! free number u: v = low·(high/low)^σ(u) or v = low + (high − low)·σ(u), σ(u) = 1/(1 + e^(−u)).
//! Ms, a, k, a_eff in A/m; α, c, w without unit. Source: the linearised anhysteretic curve, χ₀/(1 − αχ₀).

use std::str::FromStr;

use anhyst_model::{Anhysteretic, Hysteresis};
use serde::{Deserialize, Serialize};

use crate::error::IdentifyError;

/// One of the five parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Parameter {
    SaturationMagnetization,
    Shape,
    Pinning,
    Coupling,
    Reversibility,
}

impl Parameter {
    pub const ALL: [Parameter; 5] = [
        Parameter::SaturationMagnetization,
        Parameter::Shape,
        Parameter::Pinning,
        Parameter::Coupling,
        Parameter::Reversibility,
    ];

    /// The paper's letter.
    pub fn symbol(self) -> &'static str {
        match self {
            Parameter::SaturationMagnetization => "Ms",
            Parameter::Shape => "a",
            Parameter::Pinning => "k",
            Parameter::Coupling => "alpha",
            Parameter::Reversibility => "c",
        }
    }

    pub fn unit(self) -> &'static str {
        match self {
            Parameter::Coupling | Parameter::Reversibility => "",
            _ => "A/m",
        }
    }

    pub fn of(self, hysteresis: &Hysteresis) -> f64 {
        match self {
            Parameter::SaturationMagnetization => hysteresis.saturation_magnetization_a_per_m,
            Parameter::Shape => hysteresis.shape_a_per_m,
            Parameter::Pinning => hysteresis.pinning_a_per_m,
            Parameter::Coupling => hysteresis.coupling,
            Parameter::Reversibility => hysteresis.reversibility,
        }
    }

    pub(crate) fn set(self, hysteresis: &mut Hysteresis, value: f64) {
        *match self {
            Parameter::SaturationMagnetization => &mut hysteresis.saturation_magnetization_a_per_m,
            Parameter::Shape => &mut hysteresis.shape_a_per_m,
            Parameter::Pinning => &mut hysteresis.pinning_a_per_m,
            Parameter::Coupling => &mut hysteresis.coupling,
            Parameter::Reversibility => &mut hysteresis.reversibility,
        } = value;
    }
}

/// A parameter that the user holds, written `alpha=-0.01`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fixed {
    pub parameter: Parameter,
    pub value: f64,
}

impl FromStr for Fixed {
    type Err = IdentifyError;

    fn from_str(text: &str) -> Result<Self, IdentifyError> {
        let refusal = || IdentifyError::BadFix { text: text.to_owned() };
        let (symbol, value) = text.split_once('=').ok_or_else(refusal)?;
        let parameter = Parameter::ALL
            .into_iter()
            .find(|parameter| parameter.symbol() == symbol.trim())
            .ok_or_else(refusal)?;
        let value = value
            .trim()
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite())
            .ok_or_else(refusal)?;
        Ok(Fixed { parameter, value })
    }
}

/// Where the search looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    pub saturation_magnetization_a_per_m: (f64, f64),
    /// a_eff = a − α·Ms·s.
    pub effective_shape_a_per_m: (f64, f64),
    pub pinning_a_per_m: (f64, f64),
    /// w = ln(a/a_eff); 0 is α = 0.
    pub log_shape_ratio: (f64, f64),
    pub reversibility: (f64, f64),
}

impl Bounds {
    /// Wide bounds from the largest field and magnetization and from the coercive field (all A/m).
    pub fn around(field_a_per_m: f64, magnetization_a_per_m: f64, coercive_field_a_per_m: f64) -> Self {
        Bounds {
            saturation_magnetization_a_per_m: (0.7 * magnetization_a_per_m, 10.0 * magnetization_a_per_m),
            effective_shape_a_per_m: (5e-3 * field_a_per_m, 3.0 * field_a_per_m),
            // k is near the coercive field for a soft material and above it where c is large.
            pinning_a_per_m: (0.2 * coercive_field_a_per_m, 20.0 * coercive_field_a_per_m),
            log_shape_ratio: (-1.5, 3.0),
            reversibility: (0.0, 0.98),
        }
    }
}

/// The map from free numbers u to parameters, with some of them held.
#[derive(Clone, Debug)]
pub(crate) struct Coordinates {
    anhysteretic: Anhysteretic,
    bounds: Bounds,
    fixed: Vec<Fixed>,
    axes: Vec<Axis>,
}

/// One searched direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axis {
    SaturationMagnetization,
    EffectiveShape,
    LogShapeRatio,
    Pinning,
    Reversibility,
}

impl Coordinates {
    pub fn new(anhysteretic: Anhysteretic, bounds: Bounds, fixed: &[Fixed]) -> Result<Self, IdentifyError> {
        let mut coordinates = Coordinates {
            anhysteretic,
            bounds,
            fixed: fixed.to_vec(),
            axes: Vec::new(),
        };
        let free = |parameter| coordinates.held(parameter).is_none();
        let (shape, coupling) = (free(Parameter::Shape), free(Parameter::Coupling));
        let axes = [
            (Axis::SaturationMagnetization, free(Parameter::SaturationMagnetization)),
            // Of a and α, one held leaves one direction: a_eff moves a at a held α, w moves α at a held a.
            (Axis::EffectiveShape, shape),
            (Axis::LogShapeRatio, coupling),
            (Axis::Pinning, free(Parameter::Pinning)),
            (Axis::Reversibility, free(Parameter::Reversibility)),
        ];
        coordinates.axes = axes
            .into_iter()
            .filter(|(_, free)| *free)
            .map(|(axis, _)| axis)
            .collect();
        if coordinates.axes.is_empty() {
            Err(IdentifyError::NothingFree)
        } else {
            Ok(coordinates)
        }
    }

    pub fn count(&self) -> usize {
        self.axes.len()
    }

    /// The parameters that are searched.
    pub fn free(&self) -> Vec<Parameter> {
        Parameter::ALL
            .into_iter()
            .filter(|parameter| self.held(*parameter).is_none())
            .collect()
    }

    pub fn held(&self, parameter: Parameter) -> Option<f64> {
        self.fixed
            .iter()
            .rev()
            .find(|fixed| fixed.parameter == parameter)
            .map(|fixed| fixed.value)
    }

    /// Parameters at `free_numbers` (as many as [`Coordinates::count`]), or none where the set is not valid.
    pub fn hysteresis(&self, free_numbers: &[f64]) -> Option<Hysteresis> {
        let at = |axis: Axis| {
            let index = self.axes.iter().position(|of| *of == axis)?;
            free_numbers.get(index).map(|u| self.value(axis, *u))
        };
        let held_or = |parameter, axis| self.held(parameter).or_else(|| at(axis));
        let saturation = held_or(Parameter::SaturationMagnetization, Axis::SaturationMagnetization)?;
        let scale = saturation * self.anhysteretic.initial_slope();
        let (shape, coupling) = match (self.held(Parameter::Shape), self.held(Parameter::Coupling)) {
            (Some(shape), Some(coupling)) => (shape, coupling),
            (Some(shape), None) => (shape, shape * (1.0 - (-at(Axis::LogShapeRatio)?).exp()) / scale),
            (None, Some(coupling)) => (at(Axis::EffectiveShape)? + coupling * scale, coupling),
            (None, None) => {
                let (effective, ratio) = (at(Axis::EffectiveShape)?, at(Axis::LogShapeRatio)?.exp());
                (effective * ratio, effective * (ratio - 1.0) / scale)
            }
        };
        let hysteresis = Hysteresis {
            anhysteretic: self.anhysteretic,
            saturation_magnetization_a_per_m: saturation,
            shape_a_per_m: shape,
            pinning_a_per_m: held_or(Parameter::Pinning, Axis::Pinning)?,
            coupling,
            reversibility: held_or(Parameter::Reversibility, Axis::Reversibility)?,
            cubic_coupling_m2_per_a2: 0.0,
        };
        hysteresis.validate().is_ok().then_some(hysteresis)
    }

    /// Names of the searched directions that ended within 0.1 % of a bound.
    pub fn at_bounds(&self, free_numbers: &[f64]) -> Vec<&'static str> {
        let near = |u: f64| !(1e-3..=1.0 - 1e-3).contains(&logistic(u));
        self.axes
            .iter()
            .zip(free_numbers)
            .filter(|(_, u)| near(**u))
            .map(|(axis, _)| axis.name())
            .collect()
    }

    fn value(&self, axis: Axis, u: f64) -> f64 {
        let share = logistic(u);
        let logarithmic = |(low, high): (f64, f64)| low * (high / low).powf(share);
        let linear = |(low, high): (f64, f64)| low + (high - low) * share;
        match axis {
            Axis::SaturationMagnetization => logarithmic(self.bounds.saturation_magnetization_a_per_m),
            Axis::EffectiveShape => logarithmic(self.bounds.effective_shape_a_per_m),
            Axis::Pinning => logarithmic(self.bounds.pinning_a_per_m),
            Axis::LogShapeRatio => linear(self.bounds.log_shape_ratio),
            Axis::Reversibility => linear(self.bounds.reversibility),
        }
    }
}

impl Axis {
    fn name(self) -> &'static str {
        match self {
            Axis::SaturationMagnetization => "Ms",
            Axis::EffectiveShape => "a - alpha*Ms*s",
            Axis::LogShapeRatio => "ln(a / (a - alpha*Ms*s))",
            Axis::Pinning => "k",
            Axis::Reversibility => "c",
        }
    }
}

fn logistic(u: f64) -> f64 {
    1.0 / (1.0 + (-u).exp())
}

/// a_eff = a − α·Ms·s, A/m: what one loop fixes even where a and α trade.
pub fn effective_shape_a_per_m(hysteresis: &Hysteresis) -> f64 {
    hysteresis.shape_a_per_m
        - hysteresis.coupling * hysteresis.saturation_magnetization_a_per_m * hysteresis.anhysteretic.initial_slope()
}
