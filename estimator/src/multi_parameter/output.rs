//! From M and ∂M/∂θ to what is measured and its derivatives: y = u(λ(M)), λ(M) or M.
//!
//! ∂λ/∂θ = λ′(M)·∂M/∂θ, and the rod ü + k̂u̇ + ĉu = gλ is linear, so each ∂u/∂θ_i obeys the rod's equation with ∂λ/∂θ_i
//! for λ and is propagated by the same exact propagator.
//! M magnetization (A/m), λ free strain (no unit), u tip displacement (m), g m/s² per unit of strain, θ = [Ms, a, k, α,
//! c].
//! Assumptions: rod and λ(M) are known; λ keeps the Ms that it was measured with, so Ms acts through M alone.

use crate::law::is_credible;
use anhyst_model::{
    HysteresisParameter, Magnetostriction, Material, ModelError, RodMotion, SensitiveState, TwoPole, TwoPolePropagator,
};
use serde::{Deserialize, Serialize};

pub(super) const COUNT: usize = HysteresisParameter::COUNT;

/// λ(M), as it was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrainLaw {
    /// Its form.
    pub magnetostriction: Magnetostriction,
    /// The Ms that it is stated with, A/m; not estimated.
    pub saturation_magnetization_a_per_m: f64,
}

impl StrainLaw {
    /// That of a material.
    pub fn of(material: &Material) -> Self {
        Self {
            magnetostriction: material.magnetostriction,
            saturation_magnetization_a_per_m: material.hysteresis.saturation_magnetization_a_per_m,
        }
    }

    /// λ and dλ/dM.
    fn at(&self, magnetization_a_per_m: f64) -> (f64, f64) {
        let saturation = self.saturation_magnetization_a_per_m;
        (
            self.magnetostriction.strain(magnetization_a_per_m, saturation),
            self.magnetostriction.slope(magnetization_a_per_m, saturation),
        )
    }

    fn validate(&self) -> Result<(), ModelError> {
        let saturation = self.saturation_magnetization_a_per_m;
        if saturation.is_finite() && saturation > 0.0 {
            return self.magnetostriction.validate();
        }
        Err(ModelError::OutOfRange {
            quantity: "saturation magnetization of the strain law",
            value: saturation,
            unit: "A/m",
            requirement: "finite and above 0",
        })
    }
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum MeasuredOutput {
    /// Displacement of the rod's tip, m. The rod's gain is per unit of free strain
    /// ([`anhyst_model::RodElements::two_pole`] with a strain per magnetization of 1); it starts at rest.
    Displacement {
        /// The known rod.
        rod_per_strain: TwoPole,
        /// What drives it.
        strain: StrainLaw,
    },
    /// Free strain, no unit: sweeps far below the rod's resonance.
    Strain(StrainLaw),
    /// Magnetization, A/m.
    Magnetization,
}

/// A strain or a magnetization beyond these is no measurement of a material; for displacements the loop's laws have a
/// limit.
const CREDIBLE_STRAIN: f64 = 1.0;
const CREDIBLE_MAGNETIZATION_A_PER_M: f64 = 1e9;

impl MeasuredOutput {
    /// Second derivative of λ or M by M.
    fn curvature(&self, magnetization_a_per_m: f64) -> f64 {
        match self {
            MeasuredOutput::Magnetization => 0.0,
            MeasuredOutput::Displacement { strain, .. } | MeasuredOutput::Strain(strain) => {
                let step = STEP * strain.saturation_magnetization_a_per_m;
                let [above, below] = [step, -step].map(|step| strain.at(magnetization_a_per_m + step).1);
                (above - below) / (2.0 * step)
            }
        }
    }

    /// Whether a law may use the measurement at all; NaN may not.
    fn is_credible(&self, output: f64) -> bool {
        match self {
            MeasuredOutput::Displacement { .. } => is_credible(output),
            MeasuredOutput::Strain(_) => output.abs() <= CREDIBLE_STRAIN,
            MeasuredOutput::Magnetization => output.abs() <= CREDIBLE_MAGNETIZATION_A_PER_M,
        }
    }

    /// λ or M, and its derivative by M.
    fn driving(&self, magnetization_a_per_m: f64) -> (f64, f64) {
        match self {
            MeasuredOutput::Magnetization => (magnetization_a_per_m, 1.0),
            MeasuredOutput::Displacement { strain, .. } | MeasuredOutput::Strain(strain) => {
                strain.at(magnetization_a_per_m)
            }
        }
    }
}

/// Step of the difference that gives a strain law's second derivative, as a share of Ms; exact for laws up to the fourth power but for its
/// own square.
const STEP: f64 = 1e-4;

/// An output and its derivatives by all five parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SensitiveOutput {
    /// In the unit of the output.
    pub value: f64,
    /// In the unit of the output per that of the parameter, in the order of [`HysteresisParameter::ALL`].
    pub derivatives: [f64; COUNT],
}

/// The output stage with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputStage {
    measured: MeasuredOutput,
    rod: Option<SensitiveRod>,
    output: SensitiveOutput,
}

/// The rod and, beside it, one rod per derivative.
#[derive(Debug, Clone, PartialEq)]
struct SensitiveRod {
    gain: f64,
    propagator: TwoPolePropagator,
    /// Before the first tick there is no interval to move in.
    started: bool,
    value: RodMotion,
    derivatives: [RodMotion; COUNT],
}

impl OutputStage {
    /// A stage at rest.
    ///
    /// # Errors
    /// If the rod, the magnetostriction or the tick cannot be used.
    pub fn new(measured: MeasuredOutput, tick_s: f64) -> Result<Self, ModelError> {
        let rod = match measured {
            MeasuredOutput::Displacement { rod_per_strain, strain } => {
                strain.validate()?;
                Some(SensitiveRod {
                    gain: rod_per_strain.gain,
                    propagator: TwoPolePropagator::new(rod_per_strain, tick_s)?,
                    started: false,
                    value: RodMotion::default(),
                    derivatives: [RodMotion::default(); COUNT],
                })
            }
            MeasuredOutput::Strain(strain) => {
                strain.validate()?;
                None
            }
            MeasuredOutput::Magnetization => None,
        };
        Ok(Self {
            measured,
            rod,
            output: SensitiveOutput::default(),
        })
    }

    /// The output one tick later, where the material has arrived at `state`. The first call is tick 0: the rod is still
    /// at rest.
    pub fn advance(&mut self, state: &SensitiveState) -> SensitiveOutput {
        let (value, slope) = self.measured.driving(state.magnetization_a_per_m);
        let derivatives = state.derivatives.map(|derivative| slope * derivative);
        self.output = match &mut self.rod {
            None => SensitiveOutput { value, derivatives },
            // The mean excess of the strain is that of M by the strain law's slope.
            Some(rod) => {
                let curved = self.measured.curvature(state.magnetization_a_per_m) * state.mean_excess_a_per_m;
                let mut mean_excesses = [0.0; COUNT];
                for (index, mean_excess) in mean_excesses.iter_mut().enumerate() {
                    *mean_excess = slope * state.mean_excess_derivatives[index] + curved * state.derivatives[index];
                }
                rod.advance(
                    (value, slope * state.mean_excess_a_per_m),
                    (&derivatives, &mean_excesses),
                )
            }
        };
        self.output
    }

    /// Whether a law may use a measurement of this output.
    pub(super) fn is_credible(&self, output: f64) -> bool {
        self.measured.is_credible(output)
    }

    /// Moves the state to first order to where other parameters, `change` away, would have brought it.
    pub fn shift(&mut self, change: &[f64; COUNT]) {
        if let Some(rod) = &mut self.rod {
            for (by, times) in rod.derivatives.iter().zip(change) {
                rod.value.state.displacement_m += times * by.state.displacement_m;
                rod.value.state.velocity_m_per_s += times * by.state.velocity_m_per_s;
                rod.value.acceleration += times * by.acceleration;
            }
        }
    }
}

impl SensitiveRod {
    /// Strain and its mean excess over the interval, and the derivatives of both.
    fn advance(
        &mut self,
        (strain, mean_excess): (f64, f64),
        (derivatives, mean_excesses): (&[f64; COUNT], &[f64; COUNT]),
    ) -> SensitiveOutput {
        let (gain, propagator, started) = (self.gain, &self.propagator, self.started);
        let moved = |motion: &mut RodMotion, strain: f64, mean_excess: f64| {
            if started {
                return motion.advance_curved(propagator, gain * strain, gain * mean_excess);
            }
            motion.acceleration = gain * strain;
            motion.state.displacement_m
        };
        let mut displacements = [0.0; COUNT];
        for (index, displacement) in displacements.iter_mut().enumerate() {
            *displacement = moved(&mut self.derivatives[index], derivatives[index], mean_excesses[index]);
        }
        let value = moved(&mut self.value, strain, mean_excess);
        self.started = true;
        SensitiveOutput {
            value,
            derivatives: displacements,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::{DriveSignal, Hysteresis};

    const TICK_S: f64 = 1e-4;

    fn run(hysteresis: &Hysteresis, measured: MeasuredOutput) -> Vec<SensitiveOutput> {
        let mut stage = OutputStage::new(measured, TICK_S).unwrap();
        let mut state = SensitiveState::default();
        (0..2000)
            .map(|tick| {
                let field = DriveSignal::standard(0.2).field_a_per_m(f64::from(tick) * TICK_S);
                state = hysteresis.advance_with_sensitivities(state, field);
                stage.advance(&state)
            })
            .collect()
    }

    fn outputs() -> [MeasuredOutput; 3] {
        let strain = StrainLaw {
            magnetostriction: Magnetostriction::Biased {
                saturation_magnetostriction: 1.005e-3,
                bias_fraction: 0.5,
            },
            saturation_magnetization_a_per_m: 7.65e5,
        };
        let rod_per_strain = TwoPole {
            gain: 7e6,
            damping_per_s: 7.9e3,
            stiffness_per_s2: 6.4e7,
            force_gain_per_kg: 0.0,
        };
        let displacement = MeasuredOutput::Displacement { rod_per_strain, strain };
        [
            displacement,
            MeasuredOutput::Strain(strain),
            MeasuredOutput::Magnetization,
        ]
    }

    // Guards every output's derivatives, rod and curved strain law included, against differences of whole runs.
    #[test]
    fn derivatives_are_those_of_neighbouring_runs() {
        let material = Hysteresis::terfenol_d();
        for measured in outputs() {
            let exact = run(&material, measured);
            for parameter in HysteresisParameter::ALL {
                let reach = 1e-5 * parameter.of(&material);
                let [above, below] = [reach, -reach]
                    .map(|reach| run(&parameter.with(material, parameter.of(&material) + reach), measured));
                let difference = |tick: usize| (above[tick].value - below[tick].value) / (2.0 * reach);
                let largest = (0..exact.len()).fold(0.0, |most: f64, tick| most.max(difference(tick).abs()));
                for (tick, exact) in exact.iter().enumerate() {
                    let error = (exact.derivatives[parameter.index()] - difference(tick)).abs();
                    assert!(
                        error < 1e-5 * largest,
                        "{measured:?} {parameter:?} at {tick}: {error:e} of {largest:e}"
                    );
                }
            }
        }
    }

    // Guards the first-order move: a stage shifted by its derivatives goes on like one that always had the other
    // material.
    #[test]
    fn a_shifted_stage_is_that_of_the_other_material() {
        let [measured, ..] = outputs();
        let material = Hysteresis::terfenol_d();
        let change = [70.0, 0.7, 0.4, -1e-6, 2e-5];
        let parameters = material.parameters();
        let other = material.with_parameters(std::array::from_fn(|index| parameters[index] + change[index]));
        let follow = |material: &Hysteresis| {
            let mut stage = OutputStage::new(measured, TICK_S).unwrap();
            let mut state = SensitiveState::default();
            for tick in 0..700 {
                let field = DriveSignal::standard(0.2).field_a_per_m(f64::from(tick) * TICK_S);
                state = material.advance_with_sensitivities(state, field);
                stage.advance(&state);
            }
            (state, stage)
        };
        let ((state, mut stage), (_, mut expected)) = (follow(&material), follow(&other));
        let unshifted = stage.clone().advance(&state).value;
        stage.shift(&change);
        // The same strain for both: only the rod's state is compared.
        let (found, expected) = (stage.advance(&state).value, expected.advance(&state).value);
        assert!(
            (found - expected).abs() < 1e-3 * (unshifted - expected).abs(),
            "{unshifted:e} {found:e} {expected:e}"
        );
    }

    #[test]
    fn a_strain_law_without_saturation_is_refused() {
        let [_, strain, _] = outputs();
        let MeasuredOutput::Strain(mut law) = strain else {
            unreachable!()
        };
        law.saturation_magnetization_a_per_m = 0.0;
        let refusal = OutputStage::new(MeasuredOutput::Strain(law), TICK_S)
            .unwrap_err()
            .to_string();
        assert!(
            refusal.starts_with("saturation magnetization of the strain law is 0 A/m"),
            "{refusal}"
        );
    }
}
