//! λ(M): free strain from magnetization.  With γ = 3λs/(2Ms²):
//!
//! `Quadratic` λ = γM² (the paper's (8)); `Biased` λ = γ[(M + bMs)² − (bMs)²] = γ(M² + 2b·Ms·M) about a bias b·Ms;
//! `Linearised` λ = 2γ·b·Ms·M, its tangent at the bias; `Polynomial` λ = γ₁M² + γ₂M⁴ for fits of measured curves;
//! `Parabolic` λ = λ′M + κM², a linear law with a quadratic part of any size.
//! λs saturation magnetostriction (no unit), M and Ms in A/m, b bias as a fraction of Ms (0.5 unless told).
//! Assumptions: uniform, constant stress, no hysteresis between M and λ.
//! (9) prints M² + 2Ms·M for b = 1/2; expanding the square gives M² + Ms·M, and only that agrees with the paper's own gain w.

use serde::{Deserialize, Serialize};

use crate::error::{ModelError, require, require_positive};

/// Law of the free strain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Magnetostriction {
    /// λ = 3λs·b·M/Ms; with b = 1/2, (3λs/2Ms)·M.
    Linearised {
        saturation_magnetostriction: f64,
        #[serde(default = "half")]
        bias_fraction: f64,
    },
    /// λ = (3λs/2Ms²)·M².
    Quadratic { saturation_magnetostriction: f64 },
    /// λ = (3λs/2Ms²)(M² + 2b·Ms·M).
    Biased {
        saturation_magnetostriction: f64,
        #[serde(default = "half")]
        bias_fraction: f64,
    },
    /// λ = γ₁M² + γ₂M⁴.
    Polynomial {
        gamma1_m2_per_a2: f64,
        #[serde(default)]
        gamma2_m4_per_a4: f64,
    },
    /// λ = λ′M + κM².
    Parabolic { slope_m_per_a: f64, square_m2_per_a2: f64 },
    /// Nothing is known of λ, and 0 stands for it: a material of which the magnetization alone was measured. It drives no rod.
    Unmeasured,
}

fn half() -> f64 {
    0.5
}

impl Magnetostriction {
    /// Coefficients of λ = linear·M + square·M² + fourth·M⁴.
    #[inline]
    pub(crate) fn coefficients(&self, saturation: f64) -> (f64, f64, f64) {
        let gamma = |saturation_magnetostriction: f64| 1.5 * saturation_magnetostriction / (saturation * saturation);
        match *self {
            Magnetostriction::Linearised {
                saturation_magnetostriction,
                bias_fraction,
            } => (
                2.0 * gamma(saturation_magnetostriction) * bias_fraction * saturation,
                0.0,
                0.0,
            ),
            Magnetostriction::Quadratic {
                saturation_magnetostriction,
            } => (0.0, gamma(saturation_magnetostriction), 0.0),
            Magnetostriction::Biased {
                saturation_magnetostriction,
                bias_fraction,
            } => {
                let gamma = gamma(saturation_magnetostriction);
                (2.0 * gamma * bias_fraction * saturation, gamma, 0.0)
            }
            Magnetostriction::Polynomial {
                gamma1_m2_per_a2,
                gamma2_m4_per_a4,
            } => (0.0, gamma1_m2_per_a2, gamma2_m4_per_a4),
            Magnetostriction::Parabolic {
                slope_m_per_a,
                square_m2_per_a2,
            } => (slope_m_per_a, square_m2_per_a2, 0.0),
            Magnetostriction::Unmeasured => (0.0, 0.0, 0.0),
        }
    }

    /// The same law with this much more of M² (m²/A²).
    pub(crate) fn with_more_square(self, more_m2_per_a2: f64, saturation: f64) -> Self {
        let (linear, square, fourth) = self.coefficients(saturation);
        if linear != 0.0 {
            return Magnetostriction::Parabolic {
                slope_m_per_a: linear,
                square_m2_per_a2: square + more_m2_per_a2,
            };
        }
        Magnetostriction::Polynomial {
            gamma1_m2_per_a2: square + more_m2_per_a2,
            gamma2_m4_per_a4: fourth,
        }
    }

    /// Ends of the rising branch within ±Ms (A/m): where the law turns round, or saturation.
    pub fn branch_a_per_m(&self, saturation_magnetization_a_per_m: f64) -> (f64, f64) {
        let saturation = saturation_magnetization_a_per_m;
        match *self {
            Magnetostriction::Linearised { .. } | Magnetostriction::Unmeasured => (-saturation, saturation),
            Magnetostriction::Biased { bias_fraction, .. } => (-bias_fraction * saturation, saturation),
            Magnetostriction::Quadratic { .. } => (0.0, saturation),
            Magnetostriction::Polynomial {
                gamma1_m2_per_a2,
                gamma2_m4_per_a4,
            } => {
                // λ′ = 2M(γ₁ + 2γ₂M²); no number where it has no other zero.
                let turn = libm::sqrt(-0.5 * gamma1_m2_per_a2 / gamma2_m4_per_a4);
                (0.0, saturation.min(turn))
            }
            Magnetostriction::Parabolic {
                slope_m_per_a,
                square_m2_per_a2,
            } => {
                let turn = -0.5 * slope_m_per_a / square_m2_per_a2;
                if turn < 0.0 {
                    (turn.max(-saturation), saturation)
                } else {
                    (-saturation, turn.min(saturation))
                }
            }
        }
    }

    /// Free strain (no unit) at a magnetization (A/m); `saturation_magnetization_a_per_m` is Ms.
    #[inline]
    pub fn strain(&self, magnetization_a_per_m: f64, saturation_magnetization_a_per_m: f64) -> f64 {
        let mut strain = [0.0];
        self.strains(saturation_magnetization_a_per_m, &[magnetization_a_per_m], &mut strain);
        strain[0]
    }

    /// Those of many, the same bits.
    #[inline]
    pub fn strains(&self, saturation_magnetization_a_per_m: f64, magnetizations_a_per_m: &[f64], strains: &mut [f64]) {
        let (linear, square, fourth) = self.coefficients(saturation_magnetization_a_per_m);
        for (strain, &m) in strains.iter_mut().zip(magnetizations_a_per_m) {
            *strain = m * (linear + m * (square + m * m * fourth));
        }
    }

    /// dλ/dM in m/A.
    #[inline]
    pub fn slope(&self, magnetization_a_per_m: f64, saturation_magnetization_a_per_m: f64) -> f64 {
        let (linear, square, fourth) = self.coefficients(saturation_magnetization_a_per_m);
        let m = magnetization_a_per_m;
        linear + m * (2.0 * square + 4.0 * m * m * fourth)
    }

    /// The magnetization (A/m) that gives `strain`, on the rising branch: M ≥ 0 for the even laws, M ≥ −b·Ms for `Biased`.
    ///
    /// `None` where no magnetization gives it: for a positive λs, strains below 0 (even laws) or below −(3λs/2)b² (`Biased`).
    /// An answer beyond ±Ms is returned as it is: how far the material can go is the hysteresis model's question.
    pub fn inverse(&self, strain: f64, saturation_magnetization_a_per_m: f64) -> Option<f64> {
        let (linear, square, fourth) = self.coefficients(saturation_magnetization_a_per_m);
        let magnetization = if linear != 0.0 {
            // Form without cancellation of the root of square·M² + linear·M = strain on the rising branch.
            let root = libm::sqrt(linear * linear + 4.0 * square * strain);
            2.0 * strain / (linear + linear.signum() * root)
        } else if fourth != 0.0 {
            let root = libm::sqrt(square * square + 4.0 * fourth * strain);
            libm::sqrt(2.0 * strain / (square + square.signum() * root))
        } else {
            libm::sqrt(strain / square)
        };
        magnetization.is_finite().then_some(magnetization)
    }

    /// Refuses numbers that are not finite, a bias outside (0, 1], and a law without strain.
    pub fn validate(&self) -> Result<(), ModelError> {
        match *self {
            Magnetostriction::Linearised {
                saturation_magnetostriction,
                bias_fraction,
            }
            | Magnetostriction::Biased {
                saturation_magnetostriction,
                bias_fraction,
            } => {
                validate_saturation(saturation_magnetostriction)?;
                require_positive(bias_fraction, "magnetic bias as a fraction of saturation", "")?;
                require(
                    bias_fraction <= 1.0,
                    "magnetic bias as a fraction of saturation",
                    bias_fraction,
                    "",
                    "above 0 and at most 1",
                )
            }
            Magnetostriction::Quadratic {
                saturation_magnetostriction,
            } => validate_saturation(saturation_magnetostriction),
            Magnetostriction::Polynomial {
                gamma1_m2_per_a2,
                gamma2_m4_per_a4,
            } => {
                require(
                    gamma1_m2_per_a2 != 0.0,
                    "strain coefficient gamma1",
                    gamma1_m2_per_a2,
                    "m^2/A^2",
                    "finite and not 0",
                )?;
                require(true, "strain coefficient gamma2", gamma2_m4_per_a4, "m^4/A^4", "finite")
            }
            Magnetostriction::Parabolic {
                slope_m_per_a,
                square_m2_per_a2,
            } => {
                require(
                    slope_m_per_a != 0.0,
                    "strain per magnetization",
                    slope_m_per_a,
                    "m/A",
                    "finite and not 0",
                )?;
                require(
                    true,
                    "strain per square of the magnetization",
                    square_m2_per_a2,
                    "m^2/A^2",
                    "finite",
                )
            }
            Magnetostriction::Unmeasured => Err(ModelError::NoStrainLaw),
        }
    }
}

fn validate_saturation(saturation_magnetostriction: f64) -> Result<(), ModelError> {
    require(
        saturation_magnetostriction != 0.0 && saturation_magnetostriction.abs() < 0.1,
        "saturation magnetostriction",
        saturation_magnetostriction,
        "",
        "not 0 and below 0.1 in magnitude (it is a strain, 1e-3 for Terfenol-D)",
    )
}
