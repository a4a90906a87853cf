//! A setting that cannot be used: where it stands and why, so that the scenario's line and column can be shown.

use std::ops::RangeInclusive;

/// A refused setting. `path` is relative to the settings struct that was validated: `kp`, `limits.field_a_per_m`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{path}: {sentence}")]
pub struct Invalid {
    /// Field names from the validated struct inwards, joined by dots.
    pub path: String,
    /// Value, limit and reason.
    pub sentence: String,
}

impl Invalid {
    /// A refusal with its reason.
    pub fn new(path: impl Into<String>, sentence: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            sentence: sentence.into(),
        }
    }

    /// The same refusal seen from the struct that holds the validated one in `field`.
    #[must_use]
    pub fn within(mut self, field: &str) -> Self {
        self.path = if self.path.is_empty() {
            field.into()
        } else {
            format!("{field}.{}", self.path)
        };
        self
    }

    /// Refuses what is not finite and greater than zero.
    ///
    /// # Errors
    /// The refusal, with the value.
    pub fn unless_positive(path: &str, value: f64, unit: &str) -> Result<(), Self> {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(Self::new(
            path,
            format!(
                "{} must be finite and greater than {}",
                of(number(value), unit),
                of("0".into(), unit)
            ),
        ))
    }

    /// Refuses what is outside `[low, high]` or not a number.
    ///
    /// # Errors
    /// The refusal, with the value and the limits.
    pub fn unless_between(path: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<(), Self> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let [value, low, high] = [value, low, high].map(number);
        Err(Self::new(
            path,
            format!(
                "{} is outside {}",
                of(value, unit),
                of(format!("[{low}, {high}]"), unit)
            ),
        ))
    }
}

/// Reads a number that must lie within limits, both of them allowed: of an option, or of a variable of the environment.
///
/// # Errors
/// The reader's: what is no number, or lies outside.
pub fn number_between(limits: RangeInclusive<f64>, unit: &'static str) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let value = text.parse().map_err(|_| format!("{text} is no number"))?;
        let within = Invalid::unless_between("", value, *limits.start(), *limits.end(), unit);
        within.map(|()| value).map_err(|refused| refused.sentence)
    }
}

/// With its unit, if it has one.
fn of(text: String, unit: &str) -> String {
    if unit.is_empty() {
        text
    } else {
        format!("{text} {unit}")
    }
}

/// A number as people read it: what would be a row of zeros has an exponent.
fn number(value: f64) -> String {
    let size = value.abs();
    if size.is_finite() && size != 0.0 && !(1e-9..1e10).contains(&size) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the sentences against numbers of 309 digits; small ones stay as they are written.
    #[test]
    fn numbers_are_short() {
        let bound = Invalid::unless_between("kind", f64::INFINITY, f64::MIN, f64::MAX, "m").unwrap_err();
        assert_eq!(
            bound.sentence,
            "inf m is outside [-1.7976931348623157e308, 1.7976931348623157e308] m"
        );
        let small = Invalid::unless_between("tick_s", -5e-5, 1e-6, 1e9, "s").unwrap_err();
        assert_eq!(small.sentence, "-0.00005 s is outside [0.000001, 1000000000] s");
        let bare = Invalid::unless_between("share", 2.0, 0.0, 1.0, "").unwrap_err();
        assert_eq!(bare.sentence, "2 is outside [0, 1]");
        let positive = Invalid::unless_positive("gain", -1e300, "1").unwrap_err();
        assert_eq!(positive.sentence, "-1e300 1 must be finite and greater than 0 1");
    }

    /// Guards options that are read by their limits: both may be had, what is no number may not.
    #[test]
    fn numbers_between_are_read() {
        let seconds = number_between(0.1..=60.0, "s");
        assert_eq!([seconds("0.1"), seconds("6e1")], [Ok(0.1), Ok(60.0)]);
        let refused = |text: &str| seconds(text).unwrap_err();
        assert_eq!(refused("-1"), "-1 s is outside [0.1, 60] s");
        assert_eq!(refused("NaN"), "NaN s is outside [0.1, 60] s");
        assert_eq!(refused("1s"), "1s is no number");
    }
}
