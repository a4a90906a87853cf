//! p = G·λ(M): quasi-static displacement from magnetization, and back.
//!
//! p in m, G = gain/ĉ the rod's static displacement per free strain (m), λ the free strain, M in A/m.
//! Inverse: M = λ⁻¹(p/G) on the rising branch, with p clipped to what M on the branch gives; it begins at −Ms for the linearised
//! law, at −b·Ms for the biased, at 0 for the even laws, and for a parabola where it turns round. Slope: dM/dp = 1/(G·λ'(M)), 0 where λ' is 0. No state.

use anhyst_model::{Magnetostriction, Material, TwoPole};
use serde::{Deserialize, Serialize};

/// A strain law in front of a rod at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StrainLaw {
    magnetostriction: Magnetostriction,
    saturation_a_per_m: f64,
    metres_per_strain: f64,
    branch_a_per_m: (f64, f64),
    /// Displacements that can be had, rising.
    range_m: (f64, f64),
}

impl StrainLaw {
    /// Of a material in a rod whose gain is per free strain.
    pub fn new(rod: &TwoPole, material: &Material) -> Self {
        let magnetostriction = material.magnetostriction;
        let saturation_a_per_m = material.hysteresis.saturation_magnetization_a_per_m;
        let metres_per_strain = rod.dc_gain();
        let branch_a_per_m = magnetostriction.branch_a_per_m(saturation_a_per_m);
        let ends = [branch_a_per_m.0, branch_a_per_m.1]
            .map(|m| metres_per_strain * magnetostriction.strain(m, saturation_a_per_m));
        let range_m = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        Self {
            magnetostriction,
            saturation_a_per_m,
            metres_per_strain,
            branch_a_per_m,
            range_m,
        }
    }

    /// The displacements between the lowest magnetization of the branch and saturation.
    pub fn range_m(&self) -> (f64, f64) {
        self.range_m
    }

    /// G.
    pub fn metres_per_strain(&self) -> f64 {
        self.metres_per_strain
    }

    /// Ms.
    pub fn saturation_a_per_m(&self) -> f64 {
        self.saturation_a_per_m
    }

    /// p, brought into the range.
    pub fn clipped_m(&self, displacement_m: f64) -> f64 {
        displacement_m.clamp(self.range_m.0, self.range_m.1)
    }

    /// G·λ(M); M beyond the branch's ends gives the range's end.
    pub fn displacement_m(&self, magnetization_a_per_m: f64) -> f64 {
        let on_the_branch = magnetization_a_per_m.clamp(self.branch_a_per_m.0, self.branch_a_per_m.1);
        self.metres_per_strain * self.magnetostriction.strain(on_the_branch, self.saturation_a_per_m)
    }

    /// M for p; p beyond the range gives the range's end.
    pub fn magnetization_a_per_m(&self, displacement_m: f64) -> f64 {
        let strain = self.clipped_m(displacement_m) / self.metres_per_strain;
        let (lowest, highest) = self.branch_a_per_m;
        // Where the branch turns round rounding may put the strain an ulp beyond what the law can give.
        let turns_above = highest < self.saturation_a_per_m;
        self.magnetostriction
            .inverse(strain, self.saturation_a_per_m)
            .unwrap_or(if turns_above { highest } else { lowest })
            .clamp(lowest, highest)
    }

    /// dM/dp at M.
    pub fn slope_a_per_m2(&self, magnetization_a_per_m: f64) -> f64 {
        let slope = self.metres_per_strain
            * self
                .magnetostriction
                .slope(magnetization_a_per_m, self.saturation_a_per_m);
        let inverse = 1.0 / slope;
        if inverse.is_finite() { inverse } else { 0.0 }
    }
}
