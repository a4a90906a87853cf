//! The constants of the nominal chain, each with its row about the value that a model has.

use serde::{Deserialize, Serialize};

use super::rows::{Counted, Row, nominal_rows};
use super::spec::{ParameterRole, ParameterSpec, Screening};
use crate::{ActuatorModel, HysteresisParameter, Magnetostriction};

/// A constant of the nominal chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum NominalParameter {
    Hysteresis(HysteresisParameter),
    /// w of the rod; without a rod the constant that scales the strain law.
    Gain,
    Damping,
    Stiffness,
}

impl NominalParameter {
    pub const ALL: [NominalParameter; 8] = [
        NominalParameter::Hysteresis(HysteresisParameter::SaturationMagnetization),
        NominalParameter::Hysteresis(HysteresisParameter::Shape),
        NominalParameter::Hysteresis(HysteresisParameter::Pinning),
        NominalParameter::Hysteresis(HysteresisParameter::Coupling),
        NominalParameter::Hysteresis(HysteresisParameter::Reversibility),
        NominalParameter::Gain,
        NominalParameter::Damping,
        NominalParameter::Stiffness,
    ];

    fn row(self, with_rod: bool) -> &'static Row {
        nominal_rows(with_rod)[match self {
            NominalParameter::Hysteresis(parameter) => parameter.index(),
            NominalParameter::Gain => 5,
            NominalParameter::Damping => 6,
            NominalParameter::Stiffness => 7,
        }]
    }

    /// The letter, or a word, by which it is asked for.
    pub fn symbol(self) -> &'static str {
        self.row(true).symbol
    }

    /// Name of its term in a diagnosis, `parameter_a`.
    pub fn term(self) -> &'static str {
        self.row(true).term
    }

    /// Its name in a model file, `pinning_a_per_m`.
    pub fn name(self, model: &ActuatorModel) -> &'static str {
        self.row(model.rod.is_some()).name
    }

    /// The parameter of that symbol.
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.symbol() == symbol)
    }

    /// Its value in a model; none where the model has no such part.
    pub fn of(self, model: &ActuatorModel) -> Option<f64> {
        Some(match self {
            NominalParameter::Hysteresis(parameter) => parameter.of(&model.material.hysteresis),
            NominalParameter::Gain => match &model.rod {
                Some(rod) => rod.gain,
                None => *strain_constant(&mut model.material.magnetostriction.clone())?,
            },
            NominalParameter::Damping => model.rod?.damping_per_s,
            NominalParameter::Stiffness => model.rod?.stiffness_per_s2,
        })
    }

    /// Puts a value into a model; nothing where the model has no such part.
    pub fn set(self, model: &mut ActuatorModel, value: f64) {
        let hysteresis = &mut model.material.hysteresis;
        match (self, &mut model.rod) {
            (NominalParameter::Hysteresis(parameter), _) => *hysteresis = parameter.with(*hysteresis, value),
            (NominalParameter::Gain, Some(rod)) => rod.gain = value,
            (NominalParameter::Gain, None) => {
                if let Some(constant) = strain_constant(&mut model.material.magnetostriction) {
                    *constant = value;
                }
            }
            (NominalParameter::Damping, Some(rod)) => rod.damping_per_s = value,
            (NominalParameter::Stiffness, Some(rod)) => rod.stiffness_per_s2 = value,
            (NominalParameter::Damping | NominalParameter::Stiffness, None) => {}
        }
    }

    /// Its row about the value that a model has; none where the model has no such part.
    pub fn spec(self, model: &ActuatorModel) -> Option<ParameterSpec> {
        let nominal = self.of(model)?;
        let row = self.row(model.rod.is_some());
        let size = match (self, &model.rod) {
            // An undamped rod says nothing of how large a damping is: a hundredth of the critical one does.
            (NominalParameter::Damping, Some(rod)) => nominal.max(0.02 * rod.stiffness_per_s2.sqrt()),
            _ => nominal.abs(),
        };
        let [low, high] = row.bounds;
        let (from, to, scale) = match row.counted {
            Counted::Shares => (low * nominal, high * size.copysign(nominal), size),
            Counted::Offsets => (nominal + low, nominal + high, 1.0),
            Counted::Values => (low, high, 1.0),
        };
        Some(ParameterSpec {
            name: row.name,
            unit: row.unit,
            lower: from.min(to),
            upper: from.max(to),
            typical: nominal + row.change * scale,
            logarithmic: false,
            role: ParameterRole::Size { identity: nominal },
            prior_deviation: Some(row.prior_deviation * scale),
            tolerance: Some(
                model.tolerances.get(row.name).copied().unwrap_or(row.tolerance)
                    * match row.counted {
                        Counted::Shares => size,
                        Counted::Offsets => 1.0,
                        Counted::Values => size.max(0.05),
                    },
            ),
            screening: Screening::Once,
        })
    }
}

/// The constant that scales a strain law, where there is one.
fn strain_constant(law: &mut Magnetostriction) -> Option<&mut f64> {
    Some(match law {
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
        Magnetostriction::Unmeasured => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards a model that says itself how far off it may be, and its refusal of a name that means nothing.
    #[test]
    fn a_model_states_its_own_tolerances() {
        let mut model = ActuatorModel::terfenol_d();
        model.tolerances.insert("pinning_a_per_m".to_owned(), 0.1);
        model.validate().unwrap();
        let deviation = |parameter| NominalParameter::Hysteresis(parameter).spec(&model).unwrap().tolerance;
        assert_eq!(deviation(HysteresisParameter::Pinning), Some(400.0));
        assert_eq!(deviation(HysteresisParameter::Shape), Some(0.015 * 7012.0));
        model.tolerances.insert("pining".to_owned(), 0.1);
        let refusal = model.validate().unwrap_err().to_string();
        assert!(
            refusal.contains("\"pining\"") && refusal.contains("pinning_a_per_m"),
            "{refusal}"
        );
        model.tolerances.remove("pining");
        model.tolerances.insert("pinning_a_per_m".to_owned(), -0.1);
        assert!(model.validate().is_err());
    }

    /// Guards the calibration of an undamped rod: a scale of 0 makes every number of a fit none, and no fit is left.
    #[test]
    fn a_rod_without_damping_can_be_calibrated() {
        let mut model = ActuatorModel::terfenol_d();
        model.rod.as_mut().unwrap().damping_per_s = 0.0;
        let own = NominalParameter::Damping.spec(&model).unwrap();
        assert!(own.lower == 0.0 && own.upper > 0.0, "{own:?}");
        assert!(own.typical > 0.0 && own.prior_deviation.unwrap() > 0.0, "{own:?}");
    }
}
