//! What a model can lack: an effect of the library, or another value of one of its nominal parameters.
//!
//! An effect is the set of its rows in the table of parameters, a nominal parameter is one row about its own value.

use anhyst_model::{ActuatorModel, EffectKind, NominalParameter, ParameterSpec, Screening};
use serde::{Deserialize, Serialize};

/// One difference between the nominal model and another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Term {
    Effect(EffectKind),
    Parameter(NominalParameter),
}

impl Term {
    pub fn name(self) -> &'static str {
        match self {
            Term::Effect(kind) => kind.name(),
            Term::Parameter(parameter) => parameter.term(),
        }
    }

    /// The term of that name.
    pub fn from_name(name: &str) -> Option<Term> {
        let parameters = NominalParameter::ALL.into_iter().map(Term::Parameter);
        let effects = EffectKind::ALL.into_iter().map(Term::Effect);
        parameters.chain(effects).find(|term| term.name() == name)
    }

    /// The rows of an effect that are fitted, with their places among its values.
    pub(crate) fn fitted(kind: EffectKind, model: &ActuatorModel) -> impl Iterator<Item = (usize, ParameterSpec)> {
        kind.parameters_of(&model.material)
            .enumerate()
            .filter(|(_, own)| own.is_fitted())
    }

    /// The rows that are fitted; none where the model has no such parameter.
    pub(crate) fn specs(self, model: &ActuatorModel) -> Option<Vec<ParameterSpec>> {
        match self {
            Term::Effect(kind) => Some(Self::fitted(kind, model).map(|(_, own)| own).collect()),
            Term::Parameter(parameter) => Some(vec![parameter.spec(model)?]),
        }
    }

    /// One of its numbers is looked for in this way.
    pub(crate) fn is_screened(self, by: impl Fn(Screening) -> bool) -> bool {
        match self {
            Term::Effect(kind) => kind.parameters().iter().any(|own| by(own.screening)),
            Term::Parameter(_) => false,
        }
    }

    /// It does nothing until it bites.
    pub(crate) fn is_limit(self) -> bool {
        self.is_screened(|own| matches!(own, Screening::Levels(_)))
    }

    /// Its first number is a time by which slow motion comes late.
    pub(crate) fn is_lag(self) -> bool {
        use EffectKind::{AmplifierBandwidth, EddyCurrent, LoopDelay, SensorDelay};
        matches!(
            self,
            Term::Effect(AmplifierBandwidth | EddyCurrent | LoopDelay | SensorDelay)
        )
    }

    /// It is read off the values, not fitted.
    pub(crate) fn is_lattice(self) -> bool {
        self.is_screened(|own| own == Screening::Lattice)
    }

    /// Its frequency is one of many that the residual's spectrum offers.
    pub(crate) fn is_line(self) -> bool {
        self.is_screened(|own| own == Screening::Lines)
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
