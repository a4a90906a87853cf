//! One number of a fit: bounds, the scale on which it moves, what is known of it beforehand.
//!
//! v = u·scale, or v = e^u for a number whose size is unknown by decades; u is what the fit moves, v the number itself.

use anhyst_model::ParameterSpec;

/// One number to be fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    pub lower: f64,
    pub upper: f64,
    /// A change worth noticing; step and scale follow from it.
    pub scale: f64,
    /// v = e^u: for numbers whose size is unknown by decades and which are never 0.
    pub logarithmic: bool,
    /// Mean and standard deviation of what is known beforehand.
    pub prior: Option<(f64, f64)>,
}

impl Coordinate {
    /// Of a row in the table of parameters.
    pub fn of(spec: &ParameterSpec) -> Self {
        Coordinate {
            lower: spec.lower,
            upper: spec.upper,
            scale: (spec.typical - spec.identity().unwrap_or(0.0)).abs(),
            logarithmic: spec.is_fitted_by_ratio(),
            prior: spec.identity().zip(spec.prior_deviation),
        }
    }

    pub fn free(&self, value: f64) -> f64 {
        if self.logarithmic {
            value.ln()
        } else {
            value / self.scale
        }
    }

    pub fn value(&self, free: f64) -> f64 {
        let value = if self.logarithmic {
            free.exp()
        } else {
            free * self.scale
        };
        value.clamp(self.lower, self.upper)
    }

    /// The value at a share of the way from bound to bound, by ratio where it is logarithmic.
    pub fn at_share(&self, share: f64) -> f64 {
        if self.logarithmic {
            self.lower * (self.upper / self.lower).powf(share)
        } else {
            self.lower + (self.upper - self.lower) * share
        }
    }

    /// Where between the bounds a value lies, 0 to 1.
    pub fn share(&self, value: f64) -> f64 {
        (self.free(value) - self.free(self.lower)) / (self.free(self.upper) - self.free(self.lower))
    }

    /// dv/du.
    pub fn slope(&self, value: f64) -> f64 {
        if self.logarithmic { value } else { self.scale }
    }

    /// A step of u for the difference, away from a bound that is near.
    pub fn step(&self, value: f64) -> f64 {
        let free = self.free(value);
        let length = if self.logarithmic {
            // A frequency must not slip by a noticeable part of a turn over a run.
            2e-5
        } else {
            (2e-3 * free.abs()).max(0.05)
        };
        if self.value(free + length) < self.upper {
            length
        } else {
            -length
        }
    }
}
