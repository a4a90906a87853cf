//! JSON has no infinity and no NaN: such a number is written as the text `inf`, `-inf` or `NaN`, and read back.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Text(String),
}

/// For `#[serde(with = "any_number")]`.
///
/// # Errors
/// The serializer's.
pub fn serialize<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if number.is_finite() {
        Written::Number(*number).serialize(serializer)
    } else {
        Written::Text(number.to_string()).serialize(serializer)
    }
}

/// For `#[serde(with = "any_number")]`.
///
/// # Errors
/// If what stands there is no number.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    match Written::deserialize(deserializer)? {
        Written::Number(number) => Ok(number),
        Written::Text(text) => text.parse().map_err(serde::de::Error::custom),
    }
}

/// A value that is no number exceeds every limit: it must never pass for a good result.
pub(crate) fn exceeds(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan()
}
