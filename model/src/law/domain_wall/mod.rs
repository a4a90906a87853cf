//! dM/dH = [ δ̂ (Man − M)/(kδ − α̂(Man − M)) + c ∂Man/∂He ] / (1 − cα ∂Man/∂He),  α̂ = α/(1 − c)
//!
//! M magnetization, H field, He = H + αM + b₃M³ effective field, Man = Ms·curve(He/a) (all A/m);
//! δ = sign(dH); δ̂ = 0 where (Man − M)·dH < 0 (after a reversal the walls only bend), else 1.
//! Ms saturation, a shape, k pinning (A/m); α coupling and c reversibility without unit. Beyond the paper: b₃ (m²/A²) of a
//! prestressed rod; with it α in the equation stands for the tangent α + 3b₃M².
//! Assumptions: rate-independent, uniform field, constant stress and temperature within a step.
//! Source: the paper's (1)-(7). The denominator's sign is minus: it follows from (5) with He = H + αM;
//! the printed plus is kept in [`Hysteresis::slope_as_printed`] for comparison only.

mod bank;
mod bank_step;
mod coefficients;
mod inverse;
mod motion;
mod parameter;
mod phases;
mod printed;
mod sensitivity;
mod single;
mod validity;

use serde::{Deserialize, Serialize};

use crate::Anhysteretic;
pub use bank::{Bank, Instructions};
pub use inverse::Inversion;
pub use parameter::HysteresisParameter;
pub use sensitivity::SensitiveState;

/// Calls a method for the law's curve, with b₃ or without: decided once a call, not at every slope.
macro_rules! on_kernel {
    ($law:ident.$method:ident($($argument:expr),*)) => {
        match ($law.anhysteretic, $law.cubic_coupling_m2_per_a2 != 0.0) {
            (crate::Anhysteretic::Langevin, false) => $law.$method::<crate::curve::LangevinByRange, false>($($argument),*),
            (crate::Anhysteretic::Langevin, true) => $law.$method::<crate::curve::LangevinByRange, true>($($argument),*),
            (crate::Anhysteretic::Ising, false) => $law.$method::<crate::curve::IsingEverywhere, false>($($argument),*),
            (crate::Anhysteretic::Ising, true) => $law.$method::<crate::curve::IsingEverywhere, true>($($argument),*),
        }
    };
}
use on_kernel;

/// Parameters of the domain wall model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hysteresis {
    /// The curve without hysteresis.
    pub anhysteretic: Anhysteretic,
    /// Ms, A/m.
    pub saturation_magnetization_a_per_m: f64,
    /// a, A/m; belongs to its curve (Langevin and Ising differ by a factor 3 in slope).
    pub shape_a_per_m: f64,
    /// k, A/m: mean energy to move a wall past a pinning site, as a field.
    pub pinning_a_per_m: f64,
    /// α, no unit: coupling between domains; negative under compressive prestress.
    pub coupling: f64,
    /// c, no unit, in [0, 1): share of reversible wall bending.
    pub reversibility: f64,
    /// b₃, m²/A²: the part of the effective field in M³, of a prestressed rod.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub cubic_coupling_m2_per_a2: f64,
}

/// A file of a material without b₃ does not name it.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Where the material is: everything the rate-independent model remembers. The default is demagnetised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MagneticState {
    /// H, A/m.
    pub field_a_per_m: f64,
    /// M, A/m.
    pub magnetization_a_per_m: f64,
}

impl Hysteresis {
    /// The paper's Terfenol-D: Langevin, Ms 7.65e5 A/m, a 7012 A/m, k 4000 A/m, α −0.01, c 0.18.
    pub fn terfenol_d() -> Self {
        Hysteresis {
            anhysteretic: Anhysteretic::Langevin,
            saturation_magnetization_a_per_m: 7.65e5,
            shape_a_per_m: 7012.0,
            pinning_a_per_m: 4000.0,
            coupling: -0.01,
            reversibility: 0.18,
            cubic_coupling_m2_per_a2: 0.0,
        }
    }

    /// The same material with another shape parameter `a` (A/m).
    pub fn with_shape(self, shape_a_per_m: f64) -> Self {
        Hysteresis { shape_a_per_m, ..self }
    }

    /// The same where the pinning is so many times as strong.
    pub fn pinned(self, factor: f64) -> Self {
        Hysteresis {
            pinning_a_per_m: self.pinning_a_per_m * factor,
            ..self
        }
    }

    /// αM + b₃M³, A/m.
    #[inline]
    fn coupling_field(&self, magnetization: f64) -> f64 {
        magnetization * (self.coupling + self.cubic_coupling_m2_per_a2 * (magnetization * magnetization))
    }

    /// x = He/a at a state.
    #[inline]
    fn argument(&self, state: MagneticState) -> f64 {
        (state.field_a_per_m + self.coupling_field(state.magnetization_a_per_m)) / self.shape_a_per_m
    }

    /// Man at the state's effective field, A/m.
    pub fn anhysteretic_at(&self, state: MagneticState) -> f64 {
        self.saturation_magnetization_a_per_m * self.anhysteretic.value(self.argument(state))
    }

    /// 1 − cα ∂Man/∂He at a state, α the tangent.
    pub(crate) fn stiffness_of_bending(&self, state: MagneticState) -> f64 {
        self.bending(state, self.steepness(state))
    }

    /// ∂Man/∂He at a state.
    fn steepness(&self, state: MagneticState) -> f64 {
        self.saturation_magnetization_a_per_m / self.shape_a_per_m * self.anhysteretic.derivative(self.argument(state))
    }

    fn bending(&self, state: MagneticState, steepness: f64) -> f64 {
        let magnetization = state.magnetization_a_per_m;
        let tangent = self.coupling + 3.0 * self.cubic_coupling_m2_per_a2 * magnetization * magnetization;
        1.0 - self.reversibility * tangent * steepness
    }

    /// By how much M moves while `a` goes from one value to another (A/m) and walls stay where they are, from M = c Man + (1 − c) Mirr (paper eq. (5)):
    /// dM/da = −c x ∂Man/∂He/(1 − cα ∂Man/∂He), in the middle of the change.
    pub(crate) fn moved_by_shape(&self, state: MagneticState, [from_a_per_m, to_a_per_m]: [f64; 2]) -> f64 {
        let middle = Hysteresis {
            shape_a_per_m: 0.5 * (from_a_per_m + to_a_per_m),
            ..*self
        };
        let steepness = middle.steepness(state);
        let slope = -self.reversibility * middle.argument(state) * steepness / middle.bending(state, steepness);
        slope * (to_a_per_m - from_a_per_m)
    }

    /// Mirr = (M − c·Man)/(1 − c), A/m.
    pub fn irreversible(&self, state: MagneticState) -> f64 {
        (state.magnetization_a_per_m - self.reversibility * self.anhysteretic_at(state)) / (1.0 - self.reversibility)
    }

    /// Initial anhysteretic susceptibility χ₀ = dMan/dHe at zero: Ms/3a or Ms/a, no unit.
    #[inline]
    pub fn initial_susceptibility(&self) -> f64 {
        self.saturation_magnetization_a_per_m * self.anhysteretic.initial_slope() / self.shape_a_per_m
    }

    /// Longest field step (A/m) that one fourth-order step may take: 0.06·k·clamp(1 − αχ₀, 0.15, 1),
    /// shorter still where the curve is narrower than the pinning, or α or b₃ is strongly negative, or (found on the way)
    /// on flanks that positive coupling makes steep.
    #[inline]
    pub fn longest_substep_a_per_m(&self) -> f64 {
        let susceptibility = self.initial_susceptibility();
        let mut stiffness = 1.0 - self.coupling * susceptibility;
        if self.cubic_coupling_m2_per_a2 < 0.0 {
            // What 3b₃M² adds is most where M² dMan/dHe is: at this share of Ms²χ₀.
            let share = match self.anhysteretic {
                Anhysteretic::Langevin => 0.1525,
                Anhysteretic::Ising => 0.25,
            };
            let saturation = self.saturation_magnetization_a_per_m;
            stiffness -= 3.0 * self.cubic_coupling_m2_per_a2 * saturation * saturation * susceptibility * share;
        }
        // Ms/χ₀: 3a or a.
        let width = match self.anhysteretic {
            Anhysteretic::Langevin => 3.0 * self.shape_a_per_m,
            Anhysteretic::Ising => self.shape_a_per_m,
        };
        let scale = if width < self.pinning_a_per_m {
            width
        } else {
            self.pinning_a_per_m
        };
        let margin = if stiffness < 0.15 {
            0.15
        } else if stiffness <= 1.0 {
            stiffness
        } else if stiffness <= 2.0 {
            1.0
        } else {
            // The relaxation length shortens as 1/(1 − αχ₀).
            2.0 / stiffness
        };
        0.06 * scale * margin
    }
}
