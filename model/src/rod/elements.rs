//! M·ü + C·u̇ + K·u = e_tip·(EA·λ + F): linear Galerkin elements of equal length on the rod.
//!
//! Element matrices with h = L/n: mass ρAh/6·[2 1; 1 2], stiffness EA/h·[1 −1; −1 1], damping c_D·A/h·[1 −1; −1 1];
//! M_L, c_L and k_L join the tip's diagonal. Unknowns are the nodes 1…n (node 0 is held), so all three are tridiagonal.
//! A uniform λ is EA·λ·∫φ′ = EA·λ at the tip and zero elsewhere. Source: the paper's (10)-(12).

use nalgebra::Complex;

use super::constants::RodConstants;
use super::two_pole::TwoPole;
use crate::ModelError;

/// A symmetric tridiagonal matrix.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tridiagonal {
    pub diagonal: Vec<f64>,
    /// Between node i and i + 1.
    pub beside: f64,
}

impl Tridiagonal {
    /// Sum of the elements' 2×2 matrices [own, beside; beside, own] over a chain, plus a term at the tip.
    fn chain(elements: usize, own: f64, beside: f64, tip: f64) -> Self {
        let mut diagonal = vec![2.0 * own; elements];
        diagonal[elements - 1] = own + tip;
        Tridiagonal { diagonal, beside }
    }

    pub fn column(&self, index: usize) -> Vec<f64> {
        let count = self.diagonal.len();
        let mut column = vec![0.0; count];
        column[index] = self.diagonal[index];
        if index > 0 {
            column[index - 1] = self.beside;
        }
        if index + 1 < count {
            column[index + 1] = self.beside;
        }
        column
    }
}

/// The rod as assembled elements.
#[derive(Clone, Debug, PartialEq)]
pub struct RodElements {
    constants: RodConstants,
    pub(super) mass: Tridiagonal,
    pub(super) damping: Tridiagonal,
    pub(super) stiffness: Tridiagonal,
}

impl RodElements {
    /// Assembles `elements` ≥ 1 linear elements; refuses invalid constants and zero elements.
    pub fn assemble(constants: &RodConstants, elements: usize) -> Result<Self, ModelError> {
        constants.validate()?;
        if elements == 0 {
            return Err(ModelError::TooFew {
                what: "a rod of finite elements",
                least: 1,
                given: 0,
            });
        }
        let length = constants.length_m / elements as f64;
        let area = constants.area_m2();
        let mass = constants.density_kg_per_m3 * area * length / 6.0;
        let damping = constants.internal_damping_n_s_per_m2 * area / length;
        let stiffness = constants.youngs_modulus_pa * area / length;
        Ok(RodElements {
            constants: *constants,
            mass: Tridiagonal::chain(elements, 2.0 * mass, mass, constants.end_mass_kg),
            damping: Tridiagonal::chain(elements, damping, -damping, constants.end_damping_n_s_per_m),
            stiffness: Tridiagonal::chain(elements, stiffness, -stiffness, constants.end_stiffness_n_per_m),
        })
    }

    pub fn constants(&self) -> &RodConstants {
        &self.constants
    }

    /// Number of elements, which is the number of moving nodes.
    pub fn count(&self) -> usize {
        self.mass.diagonal.len()
    }

    /// Element matrices as dense rows (mass kg, damping N·s/m, stiffness N/m), n×n each, for inspection.
    pub fn matrices(&self) -> [Vec<Vec<f64>>; 3] {
        // They are symmetric: columns are rows.
        [&self.mass, &self.damping, &self.stiffness]
            .map(|matrix| (0..self.count()).map(|index| matrix.column(index)).collect())
    }

    /// Dynamic stiffness at the tip, tip force over tip displacement (N/m), and its derivative, at s (1/s).
    ///
    /// The inner nodes are eliminated from the held end: z₁ = d₁, z_i = d_i − b²/z_{i−1}. Its zeros are the rod's poles.
    pub(super) fn tip_stiffness(&self, s: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
        let term = |mass: f64, damping: f64, stiffness: f64| {
            (s * s * mass + s * damping + stiffness, s * (2.0 * mass) + damping)
        };
        let (beside, beside_slope) = term(self.mass.beside, self.damping.beside, self.stiffness.beside);
        let mut value = Complex::new(1.0, 0.0);
        let mut slope = Complex::new(0.0, 0.0);
        for index in 0..self.count() {
            let (own, own_slope) = term(
                self.mass.diagonal[index],
                self.damping.diagonal[index],
                self.stiffness.diagonal[index],
            );
            if index == 0 {
                (value, slope) = (own, own_slope);
            } else {
                let ratio = beside / value;
                slope = own_slope - ratio * beside_slope * 2.0 + ratio * ratio * slope;
                value = own - ratio * beside;
            }
        }
        (value, slope)
    }

    /// Tip displacement per tip force (m/N) at a frequency (Hz): real and imaginary part.
    pub fn tip_compliance(&self, frequency_hz: f64) -> (f64, f64) {
        let s = Complex::new(0.0, 2.0 * std::f64::consts::PI * frequency_hz);
        let compliance = Complex::new(1.0, 0.0) / self.tip_stiffness(s).0;
        (compliance.re, compliance.im)
    }

    /// The two-pole rod G(s) = w/(s² + k̂s + ĉ) with the elements' fundamental pole pair and static gain.
    ///
    /// `strain_per_magnetization` is dλ/dM in m/A: [`crate::Material::strain_per_magnetization`].
    pub fn two_pole(&self, strain_per_magnetization: f64) -> TwoPole {
        let (damping_per_s, stiffness_per_s2) = self.fundamental_pair();
        let force_gain_per_kg = stiffness_per_s2 * self.constants.static_compliance_m_per_n();
        TwoPole {
            gain: force_gain_per_kg * self.constants.force_per_strain_n() * strain_per_magnetization,
            damping_per_s,
            stiffness_per_s2,
            force_gain_per_kg,
        }
    }

    /// k̂ = −(s₁ + s₂) and ĉ = s₁·s₂ of the fundamental poles, by Newton on the tip's dynamic stiffness from the poles of
    /// one single element.
    fn fundamental_pair(&self) -> (f64, f64) {
        let constants = &self.constants;
        let area_per_length = constants.area_m2() / constants.length_m;
        let rod_mass = constants.density_kg_per_m3 * constants.area_m2() * constants.length_m;
        let mass = rod_mass / 3.0 + constants.end_mass_kg;
        let damping =
            (constants.internal_damping_n_s_per_m2 * area_per_length + constants.end_damping_n_s_per_m) / mass;
        let stiffness = 1.0 / (constants.static_compliance_m_per_n() * mass);
        let half = 0.5 * damping;
        let discriminant = half * half - stiffness;
        if discriminant < 0.0 {
            let pole = self.pole_near(Complex::new(-half, libm::sqrt(-discriminant)));
            return (-2.0 * pole.re, pole.re * pole.re + pole.im * pole.im);
        }
        let fast = -half - libm::sqrt(discriminant);
        let slow = self.pole_near(Complex::new(stiffness / fast, 0.0)).re;
        let fast = self.pole_near(Complex::new(fast, 0.0)).re;
        (-(slow + fast), slow * fast)
    }

    fn pole_near(&self, start: Complex<f64>) -> Complex<f64> {
        let mut pole = start;
        for _ in 0..50 {
            let (value, slope) = self.tip_stiffness(pole);
            let correction = value / slope;
            pole -= correction;
            if correction.norm_sqr() <= 1e-30 * pole.norm_sqr() {
                break;
            }
        }
        pole
    }
}
