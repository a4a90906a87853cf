//! A setting that cannot be used: where it stands and why, so that the scenario's line and column can be shown.

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
            format!("{value} {unit} must be finite and greater than 0 {unit}"),
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
        Err(Self::new(
            path,
            format!("{value} {unit} is outside [{low}, {high}] {unit}"),
        ))
    }
}
