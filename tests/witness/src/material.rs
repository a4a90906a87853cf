//! Domain wall hysteresis in its algebraic form, the paper's (3) and (5):
//!
//! M = (1 − c) M_irr + c M_an(H + αM + b₃M³),   dM_irr/dH = δ̂ (M_an − M_irr) / (δk − α' (M_an − M_irr)),   α' = α + 3b₃M²,
//!
//! H field, M magnetization, M_irr its irreversible part, M_an the anhysteretic curve (all A/m), a its shape and k the pinning
//! (A/m), α coupling, c reversible share (no unit), b₃ of a prestressed rod (m²/A²), δ the sign of dH, δ̂ = 0 where (M_an − M_irr) dH < 0 and else 1; with
//! walls that move against the field (accommodation) dM_irr/dH = ρδ (M_an − M_irr)/k there.
//! M is solved for by Newton's method; nothing here knows the derivative dM/dH, which `model/` integrates.

/// M_an(H_e) / M_s over x = H_e/a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// coth x − 1/x.
    Langevin,
    /// tanh x.
    Ising,
}

impl Curve {
    /// The curve and its derivative at x.
    fn at(self, x: f64) -> (f64, f64) {
        match self {
            Curve::Ising => (x.tanh(), 1.0 - x.tanh().powi(2)),
            // Near zero the difference of two large numbers: the series, its next terms below 1e-15.
            Curve::Langevin if x.abs() < 0.05 => {
                let s = x * x;
                let value = x * (1.0 / 3.0 - s * (1.0 / 45.0 - s * (2.0 / 945.0 - s / 4725.0)));
                let slope = 1.0 / 3.0 - s * (1.0 / 15.0 - s * (2.0 / 189.0 - s / 675.0));
                (value, slope)
            }
            Curve::Langevin => {
                let coth = 1.0 / x.tanh();
                (coth - 1.0 / x, 1.0 - coth * coth + 1.0 / (x * x))
            }
        }
    }
}

/// The constants of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    pub curve: Curve,
    /// M_s, A/m.
    pub saturation_a_per_m: f64,
    /// a, A/m.
    pub shape_a_per_m: f64,
    /// k, A/m.
    pub pinning_a_per_m: f64,
    /// α.
    pub coupling: f64,
    /// c.
    pub reversible_share: f64,
    /// b₃, m²/A².
    pub cubic_coupling: f64,
}

impl Material {
    /// Nealis and Smith, section 5.
    pub const TERFENOL_D: Material = Material {
        curve: Curve::Langevin,
        saturation_a_per_m: 7.65e5,
        shape_a_per_m: 7012.0,
        pinning_a_per_m: 4000.0,
        coupling: -0.01,
        reversible_share: 0.18,
        cubic_coupling: 0.0,
    };

    /// M and M_an where the field and M_irr are these.
    pub fn magnetization(&self, field: f64, irreversible: f64) -> (f64, f64) {
        let (c, cubic) = (self.reversible_share, self.cubic_coupling);
        let mut m = irreversible;
        loop {
            let effective = field + (self.coupling + cubic * m * m) * m;
            let (value, slope) = self.curve.at(effective / self.shape_a_per_m);
            let anhysteretic = self.saturation_a_per_m * value;
            let miss = m - (1.0 - c) * irreversible - c * anhysteretic;
            let step = miss / (1.0 - c * self.tangent(m) * self.saturation_a_per_m * slope / self.shape_a_per_m);
            m -= step;
            // Not so for a number that is none, which would never arrive.
            if step.abs() > 1e-9 * self.saturation_a_per_m {
                continue;
            }
            return (m, anhysteretic);
        }
    }

    /// The same under a prestress that adds so much to b₃, m²/A².
    pub fn stressed(self, cubic_coupling: f64) -> Self {
        Material {
            cubic_coupling: self.cubic_coupling + cubic_coupling,
            ..self
        }
    }

    /// Whether the anhysteretic curve has a piece that no field holds: there M jumps, α' dM_an/dH_e ≥ 1.
    pub fn folds(&self) -> bool {
        (0..2000).any(|place| {
            let (value, slope) = self.curve.at(0.01 * f64::from(place));
            let [m, susceptibility] = [value, slope / self.shape_a_per_m].map(|own| own * self.saturation_a_per_m);
            self.tangent(m) * susceptibility >= 1.0
        })
    }

    /// α'.
    fn tangent(&self, m: f64) -> f64 {
        self.coupling + 3.0 * self.cubic_coupling * m * m
    }

    /// dM_irr/dt where the field changes at this rate; ρ of the walls that move against it.
    pub fn irreversible_rate(
        &self,
        (m, anhysteretic): (f64, f64),
        irreversible: f64,
        field_rate: f64,
        relaxing_share: f64,
    ) -> f64 {
        let distance = anhysteretic - irreversible;
        if distance * field_rate <= 0.0 {
            return relaxing_share * field_rate.abs() * distance / self.pinning_a_per_m;
        }
        let pinning = self.pinning_a_per_m * field_rate.signum();
        field_rate * distance / (pinning - self.tangent(m) * distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what may be drawn: a rod that jumps is no rod to be identified. 3b₃M²dM_an/dH_e is at most 3 · 0.1525 b₃M_s³/3a.
    #[test]
    fn a_curve_folds_from_its_closed_form_on() {
        let free = Material {
            coupling: 0.0,
            ..Material::TERFENOL_D
        };
        let edge = free.shape_a_per_m / (0.1525 * free.saturation_a_per_m.powi(3));
        for (share, folds) in [(0.98, false), (1.02, true)] {
            let cubic_coupling = share * edge;
            assert_eq!(free.stressed(cubic_coupling).folds(), folds, "{share}");
        }
    }
}
