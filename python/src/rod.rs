//! The rod of two poles over arrays.

use crate::arrays::{Array, Given, array, finite, row, same_length};
use crate::refusal::refused;
use anhyst_model::{RodConstants, RodElements, RodMotion, TwoPole, TwoPolePropagator};
use pyo3::prelude::*;

/// ü + k̂ u̇ + ĉ u = w M + f F, exact over a tick in which M and F go linearly; begins at rest.
///
/// u displacement (m), M magnetization (A/m), F force on the tip (N).
#[pyclass(module = "anhyst")]
pub struct Rod {
    two_pole: TwoPole,
    tick_s: f64,
    propagator: TwoPolePropagator,
    motion: RodMotion,
}

impl Rod {
    fn of(two_pole: TwoPole, tick_s: f64) -> PyResult<Self> {
        Ok(Self {
            two_pole,
            tick_s,
            propagator: TwoPolePropagator::new(two_pole, tick_s).map_err(refused)?,
            motion: RodMotion::default(),
        })
    }

    fn moved(&mut self, magnetization_a_per_m: f64, force_n: f64) -> f64 {
        let acceleration = self.two_pole.acceleration(magnetization_a_per_m, force_n);
        self.motion.advance(&self.propagator, acceleration)
    }
}

#[pymethods]
impl Rod {
    /// w in m/s² per A/m, k̂ in 1/s, ĉ in 1/s², the tick in s, f in 1/kg.
    #[new]
    #[pyo3(signature = (gain, damping_per_s, stiffness_per_s2, tick_s, force_gain_per_kg = 0.0))]
    fn new(
        gain: f64,
        damping_per_s: f64,
        stiffness_per_s2: f64,
        tick_s: f64,
        force_gain_per_kg: f64,
    ) -> PyResult<Self> {
        let two_pole = TwoPole {
            gain,
            damping_per_s,
            stiffness_per_s2,
            force_gain_per_kg,
        };
        Self::of(two_pole, tick_s)
    }

    /// From a rod's constants as a JSON object with the fields of a scenario's `rod.constants`, by finite elements;
    /// `strain_per_magnetization` in m/A.
    #[staticmethod]
    fn from_constants(
        constants_json: &str,
        strain_per_magnetization: f64,
        tick_s: f64,
        elements: usize,
    ) -> PyResult<Self> {
        let constants: RodConstants = serde_json::from_str(constants_json).map_err(refused)?;
        let rod = RodElements::assemble(&constants, elements).map_err(refused)?;
        Self::of(rod.two_pole(strain_per_magnetization), tick_s)
    }

    /// A tick on: the displacement (m) where the magnetization (A/m) and the force (N) have come to these.
    #[pyo3(signature = (magnetization_a_per_m, force_n = 0.0))]
    fn step(&mut self, magnetization_a_per_m: f64, force_n: f64) -> PyResult<f64> {
        finite("magnetization_a_per_m", &[magnetization_a_per_m])?;
        finite("force_n", &[force_n])?;
        Ok(self.moved(magnetization_a_per_m, force_n))
    }

    /// The same for each sample, shape (n,).
    #[pyo3(signature = (magnetization_a_per_m, force_n = None))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        magnetization_a_per_m: Given<'py>,
        force_n: Option<Given<'py>>,
    ) -> PyResult<Array<'py>> {
        let magnetizations = row(&magnetization_a_per_m);
        let forces = force_n.as_ref().map(row);
        finite("magnetization_a_per_m", &magnetizations)?;
        if let Some(forces) = &forces {
            finite("force_n", forces)?;
            same_length(("magnetization", magnetizations.len()), ("force", forces.len()))?;
        }
        let at = |sample: usize| forces.as_ref().map_or(0.0, |forces| forces[sample]);
        let moved = magnetizations.iter().enumerate();
        Ok(array(
            py,
            moved.map(|(sample, own)| self.moved(*own, at(sample))).collect(),
        ))
    }

    /// Displacement (m) and velocity (m/s); what acts on it now is kept when they are set.
    #[getter]
    fn state(&self) -> (f64, f64) {
        let state = self.motion.state;
        (state.displacement_m, state.velocity_m_per_s)
    }

    #[setter]
    fn set_state(&mut self, state: (f64, f64)) {
        (self.motion.state.displacement_m, self.motion.state.velocity_m_per_s) = state;
    }

    /// Back to rest.
    fn reset(&mut self) {
        self.motion = RodMotion::default();
    }

    /// w, m/s² per A/m.
    #[getter]
    fn gain(&self) -> f64 {
        self.two_pole.gain
    }

    /// k̂, 1/s.
    #[getter]
    fn damping_per_s(&self) -> f64 {
        self.two_pole.damping_per_s
    }

    /// ĉ, 1/s².
    #[getter]
    fn stiffness_per_s2(&self) -> f64 {
        self.two_pole.stiffness_per_s2
    }

    /// f, 1/kg.
    #[getter]
    fn force_gain_per_kg(&self) -> f64 {
        self.two_pole.force_gain_per_kg
    }

    /// The tick, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// Undamped, Hz.
    #[getter]
    fn natural_frequency_hz(&self) -> f64 {
        self.two_pole.natural_frequency_hz()
    }

    /// Of critical damping.
    #[getter]
    fn damping_ratio(&self) -> f64 {
        self.two_pole.damping_ratio()
    }

    /// Static displacement per magnetization, m per A/m.
    #[getter]
    fn dc_gain(&self) -> f64 {
        self.two_pole.dc_gain()
    }
}
