//! What the engine needs of a model: outputs from values.

/// Anything that can be run freely under a set of values, in the order of a problem's coordinates.
pub trait Simulator: Sync {
    /// All rows, over their noise; None where the model refuses the values.
    fn outputs(&self, values: &[f64]) -> Option<Vec<f64>>;
}

impl<F: Fn(&[f64]) -> Option<Vec<f64>> + Sync> Simulator for F {
    fn outputs(&self, values: &[f64]) -> Option<Vec<f64>> {
        self(values)
    }
}
