//! ŷ′ = κ(Y(θ̂) − ŷ) − κ a* sat(ỹ/ε),  ẏ_f = κ(y − y_f),  θ̂′ = −Γ φ* ỹ_ε,  ỹ = ŷ − y_f,  ỹ_ε = ỹ − ε sat(ỹ/ε)
//!
//! The folded law (`folded.rs`) for θ in a box Θ of up to five dimensions. y measured output, Y(θ) output that a model
//! with θ predicts, known at the members θ_j of a bank (`members.rs`); ŷ and y_f both filtered; κ filter (1/s), ε
//! half-width of the dead zone (unit of the output), Γ = diag(γ_i) gains; φ* slope at θ̂ of the envelope of the
//! members' points (`envelope.rs`), of the lower one L where ỹ > 0, of the upper one U where ỹ < 0;
//! a* = Y(θ̂) − L(θ̂) + δ or U(θ̂) + δ − Y(θ̂), not below 0; δ bound on what Y can stick out of its envelope between the
//! members. Discrete in time as the scalar form, with h = κ dt and d = max(0, dt φ*ᵀΓφ*/2 − 1):
//!   (1 + h) z + h a* sat(z/ε) + h d z_ε = ŷ + h Y(θ̂) − (1 + h) y_f⁺,   θ̂⁺ = proj_Θ(θ̂ − dt z_ε Γφ*).
//!
//! **V = ỹ_ε² + κ θ̃ᵀΓ⁻¹θ̃, θ̃ = θ̂ − θ, never grows, for any dt, κ, ε, Γ, input and history**, where y = Y(θ), θ ∈ Θ
//! and L(θ) − δ ≤ Y(θ) ≤ U(θ) + δ. Proof: (1 + h) z + h a* sat(z/ε) + h d z_ε = ỹ + h (Y(θ̂) − Y(θ)) as in `folded.rs`.
//! 1. |z| ≤ ε: ỹ_ε becomes 0 and θ̂ stays.
//! 2. z > ε: Y(θ̂) − a* ≤ L(θ̂) − δ, and Y(θ) ≥ L(θ) − δ ≥ L(θ̂) + φ*ᵀ(θ − θ̂) − δ, so
//!    z − ỹ ≤ h (φ*ᵀθ̃ − z − d z_ε), and with z_ε − ỹ_ε ≤ z − ỹ:  Δ(ỹ_ε²) ≤ 2h z_ε(φ*ᵀθ̃ − z_ε − d z_ε).
//!    The box and a diagonal Γ make the projection one coordinate at a time, each only nearer to θ:
//!    κΔ(θ̃ᵀΓ⁻¹θ̃) ≤ −2h z_ε φ*ᵀθ̃ + h dt z_ε² φ*ᵀΓφ*.  The sum is at most h z_ε²(dt φ*ᵀΓφ* − 2 − 2d) ≤ 0.
//! 3. z < −ε: the same with signs turned and U.
//!
//! **What is exact and what is bounded.** L and U are exactly the envelopes of the members' points. L(θ) ≤ Y(θ) ≤ U(θ)
//! holds with δ = 0 when θ is a member, and when Y(θ) is a mixture of the members around it. Between the members a
//! convex Y lies below L by its interpolation error at most; δ bounds that by second differences of the members at this
//! instant: measured, not proven (on the paper's actuator with 5×5 members V did not grow).
//! Outside the dead zone only Y(θ̂) − a* counts, that is L(θ̂) − δ: how Y(θ̂) is found
//! does not change the guarantee. It is interpolated linearly between the members: a model of its own at θ̂ would have
//! a history of other parameters.
//!
//! **Where it stalls.** The law rests while the output stays between L(θ̂) − δ − ε and U(θ̂) + δ + ε. Condition (19)
//! for a vector: the truth is approached only if for some time ∫κ(L(θ̂) − δ − Y(θ))dτ or its mirror image exceeds 2ε +
//! ε₀|θ̃|. Members far apart leave a gap U − L of the order of their second differences, and no error that changes the
//! output by less can overcome it. Windows, for each axis its own, make it smaller (the proof then holds in steps whose
//! window contains θ), and so do further passes over recorded data with narrower boxes ([`MinMaxSettings::narrowed`]).
//! What is left is the dead zone, in the direction in which the output is least sensitive. And in each step θ̂ moves
//! along Γφ* alone, so weakly excited directions are approached slowly. Without noise, 5 s of the standard excitation,
//! two parameters 5 % off, ε = 2 nm (`--test several_min_max`), errors left:
//!   a, c:  3×3 members 0.73 %, 0.10 %; 9×9 with windows of 2 % 0.06 %, 0.06 %; 3×3 narrowed twice 0.007 %, 0.020 %;
//!   Ms, a: 0.43 %, 0.16 %; 0.12 %, 0.09 %; 0.12 %, 0.14 % (Ms/a is found, both together hardly change the output).
//! Five parameters over 43 members: 2 to 4 % are left, while the output's error falls from 1560 to 240 nm. Gauss-Newton
//! leaves 1e-12. It is the law with a guarantee, not the accurate one.

use super::envelope::{Envelope, EnvelopePoint, Side};
use super::members::Members;
use super::min_max_settings::MinMaxSettings;
use super::output::{COUNT, MeasuredOutput, OutputStage};
use crate::EstimatorError;
use crate::folded::output_error;
use anhyst_model::{Hysteresis, MagneticState};

/// What one step found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinMaxEstimate {
    /// The material at the estimate, after the correction.
    pub hysteresis: Hysteresis,
    /// Output predicted at the estimate before the correction.
    pub predicted_output: f64,
    /// The envelope that was used, at the estimate before the correction, without δ.
    pub cover: f64,
    /// δ, in the output's unit.
    pub interpolation_error: f64,
    /// ỹ: filtered prediction minus filtered measurement.
    pub output_error: f64,
    /// The output error is outside the dead zone: the estimate is being corrected.
    pub adapting: bool,
    /// No usable measurement: nothing was learnt.
    pub held: bool,
}

/// The law with everything it remembers.
#[derive(Debug, Clone, PartialEq)]
pub struct SeveralMinMax {
    settings: MinMaxSettings,
    members: Members,
    materials: Vec<Hysteresis>,
    states: Vec<MagneticState>,
    stages: Vec<OutputStage>,
    outputs: Vec<f64>,
    law: MinMaxLaw,
    estimate: MinMaxEstimate,
}

/// The law without its bank: values of the members in, a corrected x out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MinMaxLaw {
    /// κ dt.
    h: f64,
    dead_zone: f64,
    allowance: f64,
    /// dt γ_i/half_i², for x.
    gains: [f64; COUNT],
    /// Windows in x.
    reach: [Option<f64>; COUNT],
    lower: Envelope,
    upper: Envelope,
    seen: Vec<usize>,
    x: [f64; COUNT],
    filtered_prediction: f64,
    filtered_measurement: f64,
}

/// What a step of the law alone found.
#[derive(Debug, Clone, Copy)]
pub(super) struct MinMaxStep {
    predicted: f64,
    cover: EnvelopePoint,
    interpolation_error: f64,
    output_error: f64,
    adapting: bool,
}

impl SeveralMinMax {
    /// The law at its start: all members demagnetised, rods at rest, the estimate at `nominal`, for ticks of `tick_s`.
    ///
    /// # Errors
    /// A setting, a member's material or an output that cannot be used.
    pub fn new(
        settings: &MinMaxSettings,
        nominal: Hysteresis,
        measured: MeasuredOutput,
        tick_s: f64,
    ) -> Result<Self, EstimatorError> {
        nominal.validate()?;
        settings.validate(&nominal)?;
        let members = Members::new(settings.parameters.len(), settings.levels);
        let materials = settings.materials(&nominal, &members);
        for material in &materials {
            material.validate()?;
        }
        let count = materials.len();
        Ok(Self {
            law: MinMaxLaw::new(settings, &nominal, tick_s, count),
            settings: settings.clone(),
            members,
            materials,
            states: vec![MagneticState::default(); count],
            stages: vec![OutputStage::new(measured, tick_s)?; count],
            outputs: vec![0.0; count],
            estimate: MinMaxEstimate {
                hysteresis: nominal,
                predicted_output: 0.0,
                cover: 0.0,
                interpolation_error: 0.0,
                output_error: 0.0,
                adapting: false,
                held: true,
            },
        })
    }

    /// How many models are carried.
    pub fn members(&self) -> usize {
        self.materials.len()
    }

    /// Advances to the next tick, where the field is `field_a_per_m`, and corrects with the output measured there. A
    /// measurement that is not a number, or no measurement of a rod or a material, is not used. The first call is tick
    /// 0.
    pub fn step(&mut self, field_a_per_m: f64, measured_output: f64) -> &MinMaxEstimate {
        let members = self.materials.iter().zip(&mut self.states).zip(&mut self.stages);
        for (((material, state), stage), output) in members.zip(&mut self.outputs) {
            let (reached, bulge) = material.advance_with_bulge(*state, field_a_per_m);
            *state = reached;
            *output = stage.advance_value(reached.magnetization_a_per_m, bulge);
        }
        self.estimate.held = !self.stages[0].is_credible(measured_output);
        self.estimate.adapting = false;
        if !self.estimate.held {
            let step = self.law.correct(&self.members, &self.outputs, measured_output);
            self.estimate.predicted_output = step.predicted;
            self.estimate.cover = step.cover.value;
            self.estimate.interpolation_error = step.interpolation_error;
            self.estimate.output_error = step.output_error;
            self.estimate.adapting = step.adapting;
            if step.adapting {
                for (axis, x) in self.settings.parameters.iter().zip(self.law.x) {
                    self.estimate.hysteresis = axis.parameter.with(self.estimate.hysteresis, axis.value_at(x));
                }
            }
        }
        &self.estimate
    }

    /// Where the law stands.
    pub fn estimate(&self) -> &MinMaxEstimate {
        &self.estimate
    }
}

impl MinMaxLaw {
    pub fn new(settings: &MinMaxSettings, nominal: &Hysteresis, tick_s: f64, members: usize) -> Self {
        let mut law = Self {
            h: settings.filter_per_s * tick_s,
            dead_zone: settings.dead_zone,
            allowance: settings.interpolation_allowance,
            gains: [0.0; COUNT],
            reach: [None; COUNT],
            lower: Envelope::new(Side::Lower),
            upper: Envelope::new(Side::Upper),
            seen: Vec::with_capacity(members),
            x: [0.0; COUNT],
            filtered_prediction: 0.0,
            filtered_measurement: 0.0,
        };
        for (index, axis) in settings.parameters.iter().enumerate() {
            let half = axis.half();
            law.gains[index] = tick_s * axis.gain(settings.adaptation_rate_per_s) / (half * half);
            law.reach[index] = axis.window.map(|window| window / half);
            law.x[index] = axis.coordinate(axis.parameter.of(nominal)).clamp(-1.0, 1.0);
        }
        law
    }

    pub fn correct(&mut self, members: &Members, outputs: &[f64], measured: f64) -> MinMaxStep {
        let window = members.window(&self.x, &self.reach);
        members.seen(&window, &mut self.seen);
        let predicted = members.interpolate(outputs, &self.x);
        let interpolation_error = self.allowance * members.interpolation_error(outputs, &self.seen, &window);
        self.filtered_measurement = (self.filtered_measurement + self.h * measured) / (1.0 + self.h);
        let drive = self.filtered_prediction + self.h * predicted - (1.0 + self.h) * self.filtered_measurement;
        let envelope = if drive > 0.0 { &mut self.lower } else { &mut self.upper };
        let cover = envelope.at(members, &self.seen, &window, outputs, &self.x);
        let side = if drive > 0.0 { 1.0 } else { -1.0 };
        let gap = (side * (predicted - cover.value) + interpolation_error).max(0.0);
        let squares = cover
            .slope
            .iter()
            .zip(&self.gains)
            .map(|(slope, gain)| gain * slope * slope);
        let damping = (0.5 * squares.sum::<f64>() - 1.0).max(0.0);
        let error = side * output_error(drive.abs(), self.h, gap, damping, self.dead_zone);
        self.filtered_prediction = error + self.filtered_measurement;
        let outside = error - error.clamp(-self.dead_zone, self.dead_zone);
        for ((x, slope), gain) in self.x.iter_mut().zip(&cover.slope).zip(&self.gains) {
            *x = (*x - gain * outside * slope).clamp(-1.0, 1.0);
        }
        MinMaxStep {
            predicted,
            cover,
            interpolation_error,
            output_error: error,
            adapting: outside != 0.0,
        }
    }
}

#[cfg(test)]
#[path = "min_max_tests.rs"]
mod tests;
