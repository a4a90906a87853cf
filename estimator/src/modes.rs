//! y′ = Λ y + B f,  z = Re Σ y_i,  Λ = diag(λ_1 … λ_N): a linear system seen through its modes.
//!
//! y_i state of mode i, λ_i its eigenvalue (1/s), B_i how strongly the input f drives it, z output. Any stable system
//! with distinct eigenvalues has this form: with S the matrix of its eigenvectors, a row c as output and a column β as
//! input, B_i = (c S)_i (S⁻¹β)_i. Complex modes come in conjugate pairs with conjugate inputs; one of each pair is
//! kept, with twice its input, since z is a real part. The units of f, B and z are the user's: B has that of z per f
//! and second.
//!
//! b = Σ B_i is the rate that f gives to z at once. Where it is 0 (the rod w/(s² + k̂s + ĉ) seen by its displacement)
//! the law of (20)-(21) cannot adapt. An output z = (1 + s/μ) y of that rod has b = w/μ: [`Modes::of_rod`].
//! Source: the paper's section 4.

use crate::EstimatorError;
use anhyst_model::TwoPole;
use num_complex::Complex64;

/// Numbers closer than this, as a share of their size, are the same.
const SAME: f64 = 1e-9;

/// One mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// λ, 1/s.
    pub eigenvalue_per_s: Complex64,
    /// B.
    pub input: Complex64,
}

/// A stable modal system whose input acts on the output's rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    modes: Vec<Mode>,
}

impl Modes {
    /// Takes all N modes, in any order.
    ///
    /// # Errors
    /// A mode that is not finite or not stable, two modes with one eigenvalue, a complex mode without its conjugate, Σ
    /// B = 0.
    pub fn new(modes: &[Mode]) -> Result<Self, EstimatorError> {
        let modes = Self::with_any_inputs(modes)?;
        let sum: f64 = modes.modes.iter().map(|mode| mode.input.re).sum();
        let magnitudes: f64 = modes.modes.iter().map(|mode| magnitude(mode.input)).sum();
        if sum.abs() <= SAME * magnitudes {
            return Err(EstimatorError::InputsCancel { sum, magnitudes });
        }
        Ok(modes)
    }

    /// The same, with inputs that may cancel: for outputs that are only propagated.
    pub(crate) fn with_any_inputs(modes: &[Mode]) -> Result<Self, EstimatorError> {
        if modes.is_empty() {
            return Err(EstimatorError::NoModes);
        }
        for (index, mode) in modes.iter().enumerate() {
            check_decay(index, mode.eigenvalue_per_s)?;
            check_distinct(modes, index)?;
        }
        let all_inputs: f64 = modes.iter().map(|mode| magnitude(mode.input)).sum();
        let mut kept = Vec::with_capacity(modes.len());
        for (index, mode) in modes.iter().enumerate() {
            if !(mode.input.re.is_finite() && mode.input.im.is_finite()) {
                return Err(EstimatorError::ModeNotFinite { index });
            }
            let partner = modes
                .iter()
                .find(|other| same(other.eigenvalue_per_s, mode.eigenvalue_per_s.conj()));
            let paired =
                partner.is_some_and(|partner| magnitude(partner.input - mode.input.conj()) <= SAME * all_inputs);
            let Complex64 { re, im } = mode.eigenvalue_per_s;
            if !paired {
                return Err(EstimatorError::UnpairedMode {
                    index,
                    real_per_s: re,
                    imaginary_per_s: im,
                });
            }
            if same(mode.eigenvalue_per_s, mode.eigenvalue_per_s.conj()) {
                kept.push(Mode {
                    eigenvalue_per_s: re.into(),
                    input: mode.input.re.into(),
                });
            } else if im > 0.0 {
                kept.push(Mode {
                    input: mode.input * 2.0,
                    ..*mode
                });
            }
        }
        Ok(Self { modes: kept })
    }

    /// ĉ (1 + s/μ)/(s² + k̂s + ĉ): the rod's displacement and rate, y + ẏ/μ, for an input in displacements at rest (f/ĉ
    /// for an acceleration f). With 0 < μ < k̂ it is strictly positive real.
    ///
    /// # Errors
    /// A rod that does not decay, or one whose two eigenvalues coincide.
    pub fn of_rod(rod: &TwoPole, zero_per_s: f64) -> Result<Self, EstimatorError> {
        Self::new(&rod_modes(rod, |eigenvalue| eigenvalue / zero_per_s + 1.0))
    }

    /// ĉ/(s² + k̂s + ĉ): the rod's displacement alone.
    pub(crate) fn of_rod_displacement(rod: &TwoPole) -> Result<Self, EstimatorError> {
        Self::with_any_inputs(&rod_modes(rod, |_| Complex64::new(1.0, 0.0)))
    }

    /// One of each conjugate pair, with twice its input; real modes as they are.
    pub(crate) fn kept(&self) -> &[Mode] {
        &self.modes
    }
}

/// Partial fractions of ĉ·numerator(s)/((s − λ₁)(s − λ₂)).
fn rod_modes(rod: &TwoPole, numerator: impl Fn(Complex64) -> Complex64) -> [Mode; 2] {
    let half = 0.5 * rod.damping_per_s;
    let square = half * half - rod.stiffness_per_s2;
    let root = if square < 0.0 {
        Complex64::new(0.0, libm::sqrt(-square))
    } else {
        Complex64::new(libm::sqrt(square), 0.0)
    };
    [root, -root].map(|root| Mode {
        eigenvalue_per_s: root - half,
        input: numerator(root - half) * rod.stiffness_per_s2 / (root * 2.0),
    })
}

pub(crate) fn magnitude(number: Complex64) -> f64 {
    libm::hypot(number.re, number.im)
}

fn same(one: Complex64, other: Complex64) -> bool {
    magnitude(one - other) <= SAME * magnitude(one).max(magnitude(other))
}

fn check_decay(index: usize, eigenvalue_per_s: Complex64) -> Result<(), EstimatorError> {
    let Complex64 { re, im } = eigenvalue_per_s;
    if !(re.is_finite() && im.is_finite()) {
        return Err(EstimatorError::ModeNotFinite { index });
    }
    if re >= 0.0 {
        return Err(EstimatorError::UnstableMode {
            index,
            real_per_s: re,
            imaginary_per_s: im,
        });
    }
    Ok(())
}

fn check_distinct(modes: &[Mode], index: usize) -> Result<(), EstimatorError> {
    let eigenvalue = modes[index].eigenvalue_per_s;
    let earlier = modes[..index]
        .iter()
        .position(|other| same(other.eigenvalue_per_s, eigenvalue));
    match earlier {
        None => Ok(()),
        Some(first) => Err(EstimatorError::EqualModes {
            first,
            second: index,
            real_per_s: eigenvalue.re,
            imaginary_per_s: eigenvalue.im,
        }),
    }
}

#[cfg(test)]
#[path = "modes_tests.rs"]
mod tests;
