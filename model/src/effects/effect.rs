//! An effect with its values: what a model file holds, and what a fitter gets and sets as a slice.

use super::EffectKind;
use crate::Material;
use crate::ModelError;
use crate::parameter::{ParameterRole, ParameterSpec};

/// No effect has more parameters.
pub(crate) const MAX_PARAMETERS: usize = 5;

/// A kind and its values. In a model file: `EddyCurrent(time_constant_s: 1.8e-4)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    kind: EffectKind,
    /// In the order of `kind.parameters()`; zero beyond.
    values: [f64; MAX_PARAMETERS],
}

impl Effect {
    /// From values in the order of [`EffectKind::parameters`]; fixed ones may be left out at the end.
    ///
    /// # Errors
    /// Another number of values, or one outside its bounds.
    pub fn new(kind: EffectKind, values: &[f64]) -> Result<Self, ModelError> {
        let left_out = kind.parameters().get(values.len()..);
        if left_out.is_none_or(|own| own.iter().any(|own| own.role != ParameterRole::Fixed)) {
            return Err(ModelError::EffectValues {
                effect: kind.name(),
                needed: kind.parameters().len(),
                given: values.len(),
            });
        }
        let mut effect = Effect::identity(kind);
        effect.values_mut()[..values.len()].copy_from_slice(values);
        effect.validate()?;
        Ok(effect)
    }

    fn from_each(kind: EffectKind, value: impl Fn(&ParameterSpec) -> f64) -> Self {
        let mut values = [0.0; MAX_PARAMETERS];
        for (place, parameter) in values.iter_mut().zip(kind.parameters()) {
            *place = value(parameter);
        }
        Effect { kind, values }
    }

    /// Every parameter at its typical value.
    pub fn typical(kind: EffectKind) -> Self {
        Effect::from_each(kind, |parameter| parameter.typical)
    }

    /// The same in an actuator of that material.
    pub fn typical_of(kind: EffectKind, material: &Material) -> Self {
        let mut effect = Effect::typical(kind);
        let rows = kind.parameters_of(material);
        effect
            .values_mut()
            .iter_mut()
            .zip(rows)
            .for_each(|(value, row)| *value = row.typical);
        effect
    }

    /// Absent: each size at its identity, the other parameters at their typical value.
    pub fn identity(kind: EffectKind) -> Self {
        Effect::from_each(kind, ParameterSpec::neutral)
    }

    /// Which effect.
    pub fn kind(&self) -> EffectKind {
        self.kind
    }

    /// In the order of [`EffectKind::parameters`].
    pub fn values(&self) -> &[f64] {
        &self.values[..self.kind.parameters().len()]
    }

    /// To be set in the order of [`EffectKind::parameters`]; [`Effect::validate`] checks them.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values[..self.kind.parameters().len()]
    }

    /// The value of a parameter by its name.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        let index = self.kind.parameters().iter().position(|own| own.name == parameter)?;
        Some(self.values[index])
    }

    /// The same with another value of one parameter.
    ///
    /// # Errors
    /// No parameter of that name, or a value outside its bounds.
    pub fn with(mut self, parameter: &str, value: f64) -> Result<Self, ModelError> {
        let parameters = self.kind.parameters();
        let Some(index) = parameters.iter().position(|own| own.name == parameter) else {
            return Err(ModelError::EffectParameterUnknown {
                effect: self.kind.name(),
                parameter: parameter.to_owned(),
            });
        };
        self.values[index] = value;
        self.validate()?;
        Ok(self)
    }

    /// Every size is at its identity.
    pub fn is_absent(&self) -> bool {
        let parameters = self.kind.parameters().iter();
        parameters
            .zip(self.values)
            .all(|(parameter, value)| parameter.identity().is_none_or(|identity| value == identity))
    }

    /// Checks every value against the bounds that it has in an actuator of that material.
    ///
    /// # Errors
    /// The first value outside its bounds, or not a number.
    pub fn validate_in(&self, material: &Material) -> Result<(), ModelError> {
        self.validate_within(material.decades())
    }

    /// Against the bounds that it has in a rod of Terfenol-D.
    ///
    /// # Errors
    /// As [`Effect::validate_in`].
    pub fn validate(&self) -> Result<(), ModelError> {
        self.validate_within([1.0; 2])
    }

    fn validate_within(&self, sizes: [f64; 2]) -> Result<(), ModelError> {
        let rows = self.kind.parameters().iter().map(|own| own.sized(sizes));
        for (parameter, &value) in rows.zip(self.values()) {
            // Written so that not-a-number is refused.
            if !(value >= parameter.lower && value <= parameter.upper) {
                return Err(ModelError::EffectOutOfBounds {
                    effect: self.kind.name(),
                    parameter: parameter.name,
                    value,
                    unit: parameter.unit,
                    lower: parameter.lower,
                    upper: parameter.upper,
                });
            }
        }
        Ok(())
    }
}
