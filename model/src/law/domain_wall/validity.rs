//! Is the slope finite and positive in every state that can be reached?
//!
//! Two things can break it, both by a large positive α (and the first one by a positive b₃, which joins it as 3b₃M²):
//! 1. α·Ms/3a ≥ 1: the anhysteretic curve folds back. That is the fold itself for Langevin; an Ising curve folds at a third
//!    of it, which strong pinning can still carry (a reference curve does), so between the two the second point decides;
//! 2. α·(Man − Mirr) ≥ k: the denominator of (3) vanishes, and just below (from 0.9999 k on), steps of finite length run away.
//!    The largest Man − Mirr that can be reached on a rising field is that of the major loop from negative saturation, because solutions of the first-order equation do not cross.
//!    Along it, in the effective field, dMirr/dHe = z(1 − cα·Man′)/(k − αcz), z = Man − Mirr, from (3) and (5).
//!    Where z is largest dMirr/dHe = Man′, which solved for z gives z = k·Man′: never more than kχ₀, so αχ₀ < 1 decides
//!    without an integration. A valid Langevin material always has that, an Ising one unless it makes use of the pinning.

use super::Hysteresis;
use crate::error::{ModelError, require, require_positive};

/// Share of the pinning that α·(Man − Mirr) stays below: far from where steps run away.
const CARRIED: f64 = 0.99;

impl Hysteresis {
    /// Refuses parameters out of range, and sets whose slope dM/dH would not stay finite and positive.
    pub fn validate(&self) -> Result<(), ModelError> {
        require_positive(self.saturation_magnetization_a_per_m, "saturation magnetization", "A/m")?;
        require_positive(self.shape_a_per_m, "shape a", "A/m")?;
        require_positive(self.pinning_a_per_m, "pinning k", "A/m")?;
        require(true, "coupling alpha", self.coupling, "", "finite")?;
        require(
            true,
            "cubic coupling b3",
            self.cubic_coupling_m2_per_a2,
            "m^2/A^2",
            "finite",
        )?;
        let c = self.reversibility;
        require(
            (0.0..1.0).contains(&c),
            "reversibility c",
            c,
            "",
            "at least 0 and below 1",
        )?;
        let susceptibility = self.initial_susceptibility();
        require_positive(susceptibility, "initial susceptibility", "")?;
        let product = self.coupling * self.saturation_magnetization_a_per_m / (3.0 * self.shape_a_per_m);
        // Wall bending alone must not fold either, or phase δ̂ = 0 has no unique magnetization.
        let product = product.max(self.coupling * c * susceptibility);
        if product >= 1.0 {
            return Err(ModelError::AnhystereticFolds {
                coupling: self.coupling,
                saturation_magnetization_a_per_m: self.saturation_magnetization_a_per_m,
                shape_a_per_m: self.shape_a_per_m,
                product,
            });
        }
        let product = self.largest_product();
        if product >= 1.0 {
            return Err(ModelError::PrestressFolds {
                cubic_coupling_m2_per_a2: self.cubic_coupling_m2_per_a2,
                product,
            });
        }
        self.validate_pinning()
    }

    /// Largest (α + 3b₃M²)·dMan/dHe that b₃ > 0 makes from demagnetised to saturated.
    fn largest_product(&self) -> f64 {
        if self.cubic_coupling_m2_per_a2 <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let mut largest = f64::NEG_INFINITY;
        for index in 0..400 {
            let (value, derivative) = self.anhysteretic.value_and_derivative(0.05 * f64::from(index));
            let susceptibility = self.saturation_magnetization_a_per_m * derivative / self.shape_a_per_m;
            let magnetization = self.saturation_magnetization_a_per_m * value;
            let coupling = self.coupling + 3.0 * self.cubic_coupling_m2_per_a2 * magnetization * magnetization;
            largest = largest.max(coupling * susceptibility);
        }
        largest
    }

    fn validate_pinning(&self) -> Result<(), ModelError> {
        // Man − Mirr can exceed neither 2 Ms nor kχ₀, so most materials need no integration.
        let worst = 2.0 * self.coupling * self.saturation_magnetization_a_per_m;
        if worst < self.pinning_a_per_m || self.coupling * self.initial_susceptibility() < 1.0 {
            return Ok(());
        }
        let distance_a_per_m = self.largest_distance_on_major_loop();
        let product_a_per_m = self.coupling * distance_a_per_m;
        if product_a_per_m < CARRIED * self.pinning_a_per_m {
            return Ok(());
        }
        Err(ModelError::PinningOvercome {
            coupling: self.coupling,
            pinning_a_per_m: self.pinning_a_per_m,
            distance_a_per_m,
            product_a_per_m,
        })
    }

    /// Largest Man − Mirr (A/m) on the rising branch from far negative saturation, or 2 Ms where it runs away.
    fn largest_distance_on_major_loop(&self) -> f64 {
        let saturation = self.saturation_magnetization_a_per_m;
        let (shape, pinning) = (self.shape_a_per_m, self.pinning_a_per_m);
        let slope = |effective: f64, irreversible: f64| {
            let (value, derivative) = self.anhysteretic.value_and_derivative(effective / shape);
            let distance = saturation * value - irreversible;
            let bending = self.reversibility * self.coupling * saturation * derivative / shape;
            distance * (1.0 - bending) / (pinning - self.coupling * self.reversibility * distance)
        };
        let (mut effective, mut irreversible) = (-100.0 * shape, -saturation);
        let mut largest = 0.0_f64;
        while effective < 100.0 * shape {
            // Fine where the curve bends, coarser in saturation, never beyond the relaxation length.
            let bend = 0.02 * (shape + effective.abs());
            let step = if bend < 0.2 * pinning { bend } else { 0.2 * pinning };
            let half = 0.5 * step;
            let first = slope(effective, irreversible);
            let second = slope(effective + half, irreversible + half * first);
            let third = slope(effective + half, irreversible + half * second);
            let fourth = slope(effective + step, irreversible + step * third);
            irreversible += step / 6.0 * (first + 2.0 * (second + third) + fourth);
            effective += step;
            let distance = saturation * self.anhysteretic.value(effective / shape) - irreversible;
            if !distance.is_finite() || distance > 2.0 * saturation {
                return 2.0 * saturation;
            }
            largest = if distance > largest { distance } else { largest };
        }
        largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Anhysteretic;
    use proptest::prelude::*;

    proptest! {
        // Guards the bound that saves the integration: Man − Mirr on the major loop is nowhere above k·χ₀, and gets near it.
        #[test]
        fn the_distance_is_bounded_by_pinning_times_susceptibility(
            ising in any::<bool>(), shape in 1e3..3e4_f64, pinning in 0.05..3.0_f64, coupling in -1.0..0.99_f64, c in 0.0..0.9_f64,
        ) {
            let anhysteretic = if ising { Anhysteretic::Ising } else { Anhysteretic::Langevin };
            let material = Hysteresis {
                anhysteretic,
                saturation_magnetization_a_per_m: 7.65e5,
                shape_a_per_m: shape,
                pinning_a_per_m: pinning * shape,
                coupling: coupling * shape / (7.65e5 * anhysteretic.initial_slope()),
                reversibility: c,
                cubic_coupling_m2_per_a2: 0.0,
            };
            let share = material.largest_distance_on_major_loop()
                / (material.pinning_a_per_m * material.initial_susceptibility());
            prop_assert!(share < 1.0 + 1e-6, "{share} of k chi_0");
            prop_assert!(pinning > 0.1 || coupling < 0.0 || share > 0.9, "{share} of k chi_0");
        }
    }
}
