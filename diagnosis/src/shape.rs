//! Time courses of what a measurement adds.

/// The time course of a linear nuisance, by the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    Ramp(f64),
    Cosine(f64),
    Sine(f64),
    Decay(f64),
}

impl Shape {
    pub fn at(self, row: f64) -> f64 {
        match self {
            Shape::Ramp(per_row) => per_row * row,
            Shape::Cosine(per_row) => (per_row * row).cos(),
            Shape::Sine(per_row) => (per_row * row).sin(),
            Shape::Decay(per_row) => (-per_row * row).exp(),
        }
    }
}
