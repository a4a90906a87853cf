//! An effect in a model file: `EddyCurrent(time_constant_s: 1.8e-4)` in RON, `{"EddyCurrent": {"time_constant_s": 1.8e-4}}` in JSON.
//!
//! Written by hand so that the table of parameters is the only place where their names stand. Unknown fields are
//! refused, held parameters may be left out, and bounds are the business of [`Effect::validate`].

use core::fmt::{self, Formatter};

use serde::de::{DeserializeSeed, EnumAccess, Error, MapAccess, VariantAccess, Visitor};
use serde::ser::SerializeStructVariant;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Effect, EffectKind, VARIANTS};

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (kind, values) = (self.kind(), self.values());
        let mut variant = serializer.serialize_struct_variant("Effect", kind as u32, kind.variant(), values.len())?;
        for (parameter, value) in kind.parameters().iter().zip(values) {
            variant.serialize_field(parameter.name, value)?;
        }
        variant.end()
    }
}

impl<'de> Deserialize<'de> for Effect {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("Effect", VARIANTS, EffectVisitor)
    }
}

struct EffectVisitor;

impl<'de> Visitor<'de> for EffectVisitor {
    type Value = Effect;

    fn expecting(&self, formatter: &mut Formatter) -> fmt::Result {
        formatter.write_str("an effect with its parameters, as in EddyCurrent(time_constant_s: 1e-4)")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, access: A) -> Result<Effect, A::Error> {
        let (kind, fields) = access.variant_seed(VariantSeed)?;
        fields.struct_variant(&[], FieldsVisitor(kind))
    }
}

struct VariantSeed;

impl<'de> DeserializeSeed<'de> for VariantSeed {
    type Value = EffectKind;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<EffectKind, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for VariantSeed {
    type Value = EffectKind;

    fn expecting(&self, formatter: &mut Formatter) -> fmt::Result {
        formatter.write_str("the name of an effect, as EddyCurrent")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<EffectKind, E> {
        let found = EffectKind::ALL.into_iter().find(|kind| kind.variant() == name);
        found.ok_or_else(|| E::unknown_variant(name, VARIANTS))
    }
}

struct FieldsVisitor(EffectKind);

impl<'de> Visitor<'de> for FieldsVisitor {
    type Value = Effect;

    fn expecting(&self, formatter: &mut Formatter) -> fmt::Result {
        write!(formatter, "the parameters of {}", self.0.variant())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Effect, A::Error> {
        let parameters = self.0.parameters();
        let mut effect = Effect::typical(self.0);
        let mut given = [false; super::effect::MAX_PARAMETERS];
        while let Some(index) = fields.next_key_seed(ParameterSeed(self.0))? {
            if given[index] {
                return Err(A::Error::duplicate_field(parameters[index].name));
            }
            given[index] = true;
            effect.values_mut()[index] = fields.next_value()?;
        }
        for (parameter, given) in parameters.iter().zip(given) {
            if !given && parameter.is_fitted() {
                return Err(A::Error::missing_field(parameter.name));
            }
        }
        Ok(effect)
    }
}

struct ParameterSeed(EffectKind);

impl<'de> DeserializeSeed<'de> for ParameterSeed {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<usize, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for ParameterSeed {
    type Value = usize;

    fn expecting(&self, formatter: &mut Formatter) -> fmt::Result {
        write!(formatter, "a parameter of {}", self.0.variant())
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<usize, E> {
        let parameters = self.0.parameters();
        parameters.iter().position(|own| own.name == name).ok_or_else(|| {
            let names: Vec<&str> = parameters.iter().map(|own| own.name).collect();
            let (effect, names) = (self.0.variant(), names.join(", "));
            E::custom(format!("{effect} has no parameter `{name}`; it has {names}"))
        })
    }
}
