//! What a model can lack: an effect of the library, or another value of one of its nominal parameters.
//!
//! A term's coordinates are the numbers to be fitted, with bounds, a change worth noticing, and the value at which the
//! term is absent. Priors of nominal parameters hold where all of them are calibrated together: 20 % of a, k, Ms, w and
//! of the rod's constants, 0.05 in α, 0.2 in c (ranges of published Terfenol-D, see docs).

use anhyst_model::{ActuatorModel, EffectKind, EffectParameter, Magnetostriction, ParameterRole};
use serde::{Deserialize, Serialize};

use crate::coordinate::Coordinate;

/// A number of the nominal model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum NominalParameter {
    SaturationMagnetization,
    Shape,
    Pinning,
    Coupling,
    Reversibility,
    /// w of the rod; without a rod λs of the strain law.
    Gain,
    Damping,
    Stiffness,
}

impl NominalParameter {
    pub const ALL: [NominalParameter; 8] = [
        NominalParameter::SaturationMagnetization,
        NominalParameter::Shape,
        NominalParameter::Pinning,
        NominalParameter::Coupling,
        NominalParameter::Reversibility,
        NominalParameter::Gain,
        NominalParameter::Damping,
        NominalParameter::Stiffness,
    ];

    pub fn name(self) -> &'static str {
        match self {
            NominalParameter::SaturationMagnetization => "parameter_Ms",
            NominalParameter::Shape => "parameter_a",
            NominalParameter::Pinning => "parameter_k",
            NominalParameter::Coupling => "parameter_alpha",
            NominalParameter::Reversibility => "parameter_c",
            NominalParameter::Gain => "parameter_w",
            NominalParameter::Damping => "parameter_damping",
            NominalParameter::Stiffness => "parameter_stiffness",
        }
    }

    /// Name of the fitted number and its unit.
    fn quantity(self, with_rod: bool) -> (&'static str, &'static str) {
        match self {
            NominalParameter::SaturationMagnetization => ("saturation_magnetization_a_per_m", "A/m"),
            NominalParameter::Shape => ("shape_a_per_m", "A/m"),
            NominalParameter::Pinning => ("pinning_a_per_m", "A/m"),
            NominalParameter::Coupling => ("coupling", ""),
            NominalParameter::Reversibility => ("reversibility", ""),
            NominalParameter::Gain if with_rod => ("gain", "m/s² per A/m"),
            NominalParameter::Gain => ("saturation_magnetostriction", ""),
            NominalParameter::Damping => ("damping_per_s", "1/s"),
            NominalParameter::Stiffness => ("stiffness_per_s2", "1/s²"),
        }
    }

    /// Its value in a model; none where the model has no such part.
    pub fn of(self, model: &ActuatorModel) -> Option<f64> {
        let hysteresis = &model.material.hysteresis;
        Some(match self {
            NominalParameter::SaturationMagnetization => hysteresis.saturation_magnetization_a_per_m,
            NominalParameter::Shape => hysteresis.shape_a_per_m,
            NominalParameter::Pinning => hysteresis.pinning_a_per_m,
            NominalParameter::Coupling => hysteresis.coupling,
            NominalParameter::Reversibility => hysteresis.reversibility,
            NominalParameter::Gain => match &model.rod {
                Some(rod) => rod.gain,
                None => *strain_constant(&mut model.material.magnetostriction.clone()),
            },
            NominalParameter::Damping => model.rod?.damping_per_s,
            NominalParameter::Stiffness => model.rod?.stiffness_per_s2,
        })
    }

    /// Puts a value into a model.
    pub fn set(self, model: &mut ActuatorModel, value: f64) {
        let hysteresis = &mut model.material.hysteresis;
        match self {
            NominalParameter::SaturationMagnetization => hysteresis.saturation_magnetization_a_per_m = value,
            NominalParameter::Shape => hysteresis.shape_a_per_m = value,
            NominalParameter::Pinning => hysteresis.pinning_a_per_m = value,
            NominalParameter::Coupling => hysteresis.coupling = value,
            NominalParameter::Reversibility => hysteresis.reversibility = value,
            NominalParameter::Gain => match &mut model.rod {
                Some(rod) => rod.gain = value,
                None => *strain_constant(&mut model.material.magnetostriction) = value,
            },
            NominalParameter::Damping => {
                if let Some(rod) = &mut model.rod {
                    rod.damping_per_s = value;
                }
            }
            NominalParameter::Stiffness => {
                if let Some(rod) = &mut model.rod {
                    rod.stiffness_per_s2 = value;
                }
            }
        }
    }

    fn coordinate(self, model: &ActuatorModel) -> Option<Coordinate> {
        let nominal = self.of(model)?;
        let size = match (self, &model.rod) {
            // An undamped rod says nothing of how large a damping is: a hundredth of the critical one does.
            (NominalParameter::Damping, Some(rod)) => nominal.max(0.02 * rod.stiffness_per_s2.sqrt()),
            _ => nominal.abs(),
        };
        let (lower, upper, scale, deviation) = match self {
            NominalParameter::Coupling => (nominal - 0.3, nominal + 0.3, 1e-4, 0.05),
            NominalParameter::Reversibility => (0.0, 0.95, 1e-3, 0.2),
            _ => {
                let (one, other) = (0.2 * nominal, 5.0 * size.copysign(nominal));
                (one.min(other), one.max(other), 1e-3 * size, 0.2 * size)
            }
        };
        Some(Coordinate {
            lower,
            upper,
            scale,
            logarithmic: false,
            prior: Some((nominal, deviation)),
        })
    }
}

/// The constant that scales a strain law.
fn strain_constant(law: &mut Magnetostriction) -> &mut f64 {
    match law {
        Magnetostriction::Linearised {
            saturation_magnetostriction,
            ..
        }
        | Magnetostriction::Quadratic {
            saturation_magnetostriction,
        }
        | Magnetostriction::Biased {
            saturation_magnetostriction,
            ..
        } => saturation_magnetostriction,
        Magnetostriction::Polynomial { gamma1_m2_per_a2, .. } => gamma1_m2_per_a2,
        Magnetostriction::Parabolic { slope_m_per_a, .. } => slope_m_per_a,
    }
}

/// One difference between the nominal model and another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Term {
    Effect(EffectKind),
    Parameter(NominalParameter),
}

/// A fitted number by its name and unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quantity {
    pub name: &'static str,
    pub unit: &'static str,
}

impl Term {
    pub fn name(self) -> &'static str {
        match self {
            Term::Effect(kind) => kind.name(),
            Term::Parameter(parameter) => parameter.name(),
        }
    }

    /// The term of that name.
    pub fn from_name(name: &str) -> Option<Term> {
        let parameter = NominalParameter::ALL
            .into_iter()
            .find(|parameter| parameter.name() == name);
        parameter
            .map(Term::Parameter)
            .or_else(|| EffectKind::from_name(name).map(Term::Effect))
    }

    /// The parameters of an effect that are fitted.
    pub(crate) fn fitted(kind: EffectKind) -> impl Iterator<Item = (usize, &'static EffectParameter)> {
        kind.parameters()
            .iter()
            .enumerate()
            .filter(|(_, parameter)| parameter.role != ParameterRole::Held)
    }

    pub(crate) fn quantities(self, model: &ActuatorModel) -> Vec<Quantity> {
        match self {
            Term::Effect(kind) => Self::fitted(kind)
                .map(|(_, own)| Quantity {
                    name: own.name,
                    unit: own.unit,
                })
                .collect(),
            Term::Parameter(parameter) => {
                let (name, unit) = parameter.quantity(model.rod.is_some());
                vec![Quantity { name, unit }]
            }
        }
    }

    /// What is fitted, as least squares want it; none where the model has no such parameter.
    pub(crate) fn coordinates(self, model: &ActuatorModel) -> Option<Vec<Coordinate>> {
        match self {
            Term::Effect(kind) => Some(Self::fitted(kind).map(|(_, own)| effect_coordinate(own)).collect()),
            Term::Parameter(parameter) => Some(vec![parameter.coordinate(model)?]),
        }
    }

    /// The values with which the term is absent: sizes at their identity, shapes as usual.
    pub(crate) fn absent(self, model: &ActuatorModel) -> Vec<f64> {
        match self {
            Term::Effect(kind) => Self::fitted(kind)
                .map(|(_, own)| own.identity().unwrap_or(own.typical))
                .collect(),
            Term::Parameter(parameter) => parameter.of(model).into_iter().collect(),
        }
    }

    /// The smallest values worth finding.
    pub(crate) fn small(self, model: &ActuatorModel) -> Vec<f64> {
        match self {
            Term::Effect(kind) => Self::fitted(kind).map(|(_, own)| own.typical).collect(),
            Term::Parameter(parameter) => {
                let nominal = parameter.of(model).unwrap_or_default();
                let scale = parameter.coordinate(model).map_or(0.0, |own| own.scale);
                vec![nominal + scale]
            }
        }
    }
}

fn effect_coordinate(parameter: &EffectParameter) -> Coordinate {
    let at_upper = parameter.identity() == Some(parameter.upper);
    // A size that may be 0 has no logarithm there.
    let logarithmic = at_upper || (parameter.role == ParameterRole::Shape && parameter.logarithmic);
    Coordinate {
        lower: parameter.lower,
        upper: parameter.upper,
        scale: parameter.typical.abs(),
        logarithmic,
        prior: None,
    }
}

impl std::fmt::Display for Term {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name())
    }
}

impl Serialize for Term {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Term {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Term::from_name(&name)
            .ok_or_else(|| serde::de::Error::custom(format!("no effect or parameter is called {name:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the calibration of an undamped rod: a scale of 0 makes every number of a fit none, and no fit is left.
    #[test]
    fn a_rod_without_damping_can_be_calibrated() {
        let mut model = ActuatorModel::terfenol_d();
        model.rod.as_mut().unwrap().damping_per_s = 0.0;
        let term = Term::Parameter(NominalParameter::Damping);
        let [own] = term.coordinates(&model).unwrap()[..] else {
            panic!("one number");
        };
        assert!(own.free(0.0) == 0.0 && own.value(1.0) == own.scale, "{own:?}");
        assert!(
            own.lower == 0.0 && own.upper > 0.0 && own.prior.unwrap().1 > 0.0,
            "{own:?}"
        );
        assert!(term.small(&model)[0] > 0.0);
    }
}
