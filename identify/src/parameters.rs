//! The five parameters and the coordinates in which they are searched.
//!
//! On one loop a and α can hardly be told apart: a_eff = a − α·Ms·s is what the data fix (s = 1/3 Langevin, 1 Ising:
//! the initial slope of the curve). So the search runs over Ms, a_eff, k, c and w = ln(a/a_eff), from which
//!   a = a_eff·e^w,  α = (a − a_eff)/(s·Ms).
//! Then α·χ₀ = 1 − e^(−w) stays below 1 by itself. Ms, a_eff and k are searched by ratio, w and c evenly.
//! Ms, a, k, a_eff in A/m; α, c, w without unit. Source: the linearised anhysteretic curve, χ₀/(1 − αχ₀).

use std::str::FromStr;

use anhyst_model::parameter::REVERSIBILITY_BOUNDS;
use anhyst_model::{Anhysteretic, Hysteresis, HysteresisParameter};
use serde::{Deserialize, Serialize};

use crate::engine::Coordinate;
use crate::error::IdentifyError;

/// A parameter that the user holds, written `alpha=-0.01`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fixed {
    pub parameter: HysteresisParameter,
    pub value: f64,
}

impl FromStr for Fixed {
    type Err = IdentifyError;

    fn from_str(text: &str) -> Result<Self, IdentifyError> {
        let refusal = || IdentifyError::BadFix { text: text.to_owned() };
        let (symbol, value) = text.split_once('=').ok_or_else(refusal)?;
        let parameter = HysteresisParameter::ALL
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

/// A change of w or c worth noticing.
const CHANGE: f64 = 1e-3;

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
            reversibility: REVERSIBILITY_BOUNDS,
        }
    }
}

/// The map from the searched numbers to parameters, with some of them held.
#[derive(Clone, Debug)]
pub(crate) struct Coordinates {
    anhysteretic: Anhysteretic,
    fixed: Vec<Fixed>,
    axes: Vec<Axis>,
    coordinates: Vec<Coordinate>,
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
            fixed: fixed.to_vec(),
            axes: Vec::new(),
            coordinates: Vec::new(),
        };
        let free = |parameter| coordinates.held(parameter).is_none();
        let (shape, coupling) = (free(HysteresisParameter::Shape), free(HysteresisParameter::Coupling));
        let axes = [
            (
                Axis::SaturationMagnetization,
                free(HysteresisParameter::SaturationMagnetization),
            ),
            // Of a and α, one held leaves one direction: a_eff moves a at a held α, w moves α at a held a.
            (Axis::EffectiveShape, shape),
            (Axis::LogShapeRatio, coupling),
            (Axis::Pinning, free(HysteresisParameter::Pinning)),
            (Axis::Reversibility, free(HysteresisParameter::Reversibility)),
        ];
        coordinates.axes = axes
            .into_iter()
            .filter(|(_, free)| *free)
            .map(|(axis, _)| axis)
            .collect();
        coordinates.coordinates = coordinates.axes.iter().map(|axis| axis.coordinate(&bounds)).collect();
        if coordinates.axes.is_empty() {
            Err(IdentifyError::NothingFree)
        } else {
            Ok(coordinates)
        }
    }

    pub fn count(&self) -> usize {
        self.axes.len()
    }

    /// Bounds and scale of each searched number.
    pub fn axes(&self) -> &[Coordinate] {
        &self.coordinates
    }

    /// The parameters that are searched.
    pub fn free(&self) -> Vec<HysteresisParameter> {
        HysteresisParameter::ALL
            .into_iter()
            .filter(|parameter| self.held(*parameter).is_none())
            .collect()
    }

    pub fn held(&self, parameter: HysteresisParameter) -> Option<f64> {
        self.fixed
            .iter()
            .rev()
            .find(|fixed| fixed.parameter == parameter)
            .map(|fixed| fixed.value)
    }

    /// Parameters at the searched numbers (as many as [`Coordinates::count`]), or none where the set is not valid.
    pub fn hysteresis(&self, numbers: &[f64]) -> Option<Hysteresis> {
        let at = |axis: Axis| numbers.get(self.axes.iter().position(|of| *of == axis)?).copied();
        let held_or = |parameter, axis| self.held(parameter).or_else(|| at(axis));
        let saturation = held_or(
            HysteresisParameter::SaturationMagnetization,
            Axis::SaturationMagnetization,
        )?;
        let scale = saturation * self.anhysteretic.initial_slope();
        let (shape, coupling) = match (
            self.held(HysteresisParameter::Shape),
            self.held(HysteresisParameter::Coupling),
        ) {
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
            pinning_a_per_m: held_or(HysteresisParameter::Pinning, Axis::Pinning)?,
            coupling,
            reversibility: held_or(HysteresisParameter::Reversibility, Axis::Reversibility)?,
            cubic_coupling_m2_per_a2: 0.0,
        };
        hysteresis.validate().is_ok().then_some(hysteresis)
    }

    /// Names of the searched directions that ended within 0.1 % of a bound.
    pub fn at_bounds(&self, numbers: &[f64]) -> Vec<&'static str> {
        let all = self.axes.iter().zip(&self.coordinates).zip(numbers);
        all.filter(|((_, own), value)| !(1e-3..=1.0 - 1e-3).contains(&own.share(**value)))
            .map(|((axis, _), _)| axis.name())
            .collect()
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

    fn coordinate(self, bounds: &Bounds) -> Coordinate {
        let between = |(lower, upper), logarithmic| Coordinate {
            lower,
            upper,
            scale: CHANGE,
            logarithmic,
            prior: None,
        };
        match self {
            Axis::SaturationMagnetization => between(bounds.saturation_magnetization_a_per_m, true),
            Axis::EffectiveShape => between(bounds.effective_shape_a_per_m, true),
            Axis::Pinning => between(bounds.pinning_a_per_m, true),
            Axis::LogShapeRatio => between(bounds.log_shape_ratio, false),
            Axis::Reversibility => between(bounds.reversibility, false),
        }
    }
}

/// a_eff = a − α·Ms·s, A/m: what one loop fixes even where a and α trade.
pub fn effective_shape_a_per_m(hysteresis: &Hysteresis) -> f64 {
    hysteresis.shape_a_per_m
        - hysteresis.coupling * hysteresis.saturation_magnetization_a_per_m * hysteresis.anhysteretic.initial_slope()
}
