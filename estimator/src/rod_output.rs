//! z = H·y and f = F·x with H/F = G/R: an output of relative degree one from the displacement alone, and the input that
//! belongs to it.
//!
//! y measured displacement (m), x = g λ/ĉ displacement at rest for the free strain λ (m), R = ĉ/(s² + k̂s + ĉ) the rod,
//! G = R·(1 + s/μ) what the matrix law needs. In continuous time H = κ/(s + κ)·(1 + s/μ) and F = κ/(s + κ): the filter
//! that makes the derivative of y bearable stands before f too, for every member alike, and z = H R x = G F x exactly.
//! It does not depend on `a`, so the law's proof speaks of F x as of any f.
//!
//! **In discrete time** R and G, sampled exactly (`sampled_modes.rs`), share their poles: R_d = N_R/D, G_d = N_G/D.
//! Then with any stable Q
//!   H = N_G/Q,  F = N_R/Q  give  H R_d = G_d F
//! again exactly, at every tick. (κ/(s + κ) sampled on its own on either side would leave an error of the order of a
//! tick; N_G/N_R itself is unstable, since the sampled rod has a zero near −3.7.) Q = c z (z − e^{−κT}) is the corner κ
//! and a delay of one tick on both sides; c makes the gains at rest 1. Above the corner H lifts noise by κ/μ.
//! Source: the paper's (13) and (20); zeros of sampled systems: Åström, Hagander and Sternby (1984).

use crate::EstimatorError;
use crate::modes::Modes;
use crate::sampled_modes::SampledModes;
use anhyst_model::TwoPole;
use serde::{Deserialize, Serialize};

/// b₀ + b₁ z⁻¹ + b₂ z⁻² over 1 − p z⁻¹.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Filter {
    weights: [f64; 3],
    pole: f64,
}

/// What filters of one kind remember, one entry per filter: apart, so that the members' filters run side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Memory {
    next: Vec<f64>,
    last_input: Vec<f64>,
}

impl Memory {
    fn at_rest(filters: usize) -> Self {
        Self {
            next: vec![0.0; filters],
            last_input: vec![0.0; filters],
        }
    }
}

impl Filter {
    fn advance(&self, memory: &mut Memory, inputs: &[f64], outputs: &mut [f64]) {
        self.side_by_side(&mut memory.next, &mut memory.last_input, inputs, outputs);
    }

    /// As slices of their own, so that the compiler knows that they do not overlap.
    fn side_by_side(&self, next: &mut [f64], last_inputs: &mut [f64], inputs: &[f64], outputs: &mut [f64]) {
        let ([now, last, before_last], pole) = (self.weights, self.pole);
        let memories = next.iter_mut().zip(last_inputs);
        for (((next, last_input), output), &input) in memories.zip(outputs).zip(inputs) {
            *output = now * input + *next;
            *next = last * input + pole * *output + before_last * *last_input;
            *last_input = input;
        }
    }

    /// `factor` times the numerator of a sampled two-pole system.
    fn new(system: &SampledModes, factor: f64, pole: f64) -> Self {
        let (sum, product) = system.pole_sum_and_product();
        let first = system.feedthrough();
        let (second, third) = (system.response_after(0), system.response_after(1));
        let numerator = [first, second - sum * first, third - sum * second + product * first];
        Self {
            weights: numerator.map(|weight| factor * weight),
            pole,
        }
    }
}

/// H for the measurement and F for every member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RodOutput {
    /// H.
    output: Filter,
    output_memory: Memory,
    /// F g/ĉ.
    input: Filter,
    input_memory: Memory,
    inputs_m: Vec<f64>,
}

impl RodOutput {
    /// At rest. The rod's gain is per unit of free strain.
    ///
    /// # Errors
    /// A rod without two distinct decaying modes.
    pub fn new(
        rod_per_strain: &TwoPole,
        zero_per_s: f64,
        filter_per_s: f64,
        members: usize,
        tick_s: f64,
    ) -> Result<Self, EstimatorError> {
        let displacement = SampledModes::new(&Modes::of_rod_displacement(rod_per_strain)?, tick_s);
        let with_rate = SampledModes::new(&Modes::of_rod(rod_per_strain, zero_per_s)?, tick_s);
        let pole = libm::exp(-filter_per_s * tick_s);
        let (sum, product) = displacement.pole_sum_and_product();
        // Both numerators add up to D(1), because both gains at rest are 1.
        let factor = -libm::expm1(-filter_per_s * tick_s) / (1.0 - sum + product);
        Ok(Self {
            output: Filter::new(&with_rate, factor, pole),
            output_memory: Memory::at_rest(1),
            input: Filter::new(&displacement, factor * rod_per_strain.dc_gain(), pole),
            input_memory: Memory::at_rest(members),
            inputs_m: vec![0.0; members],
        })
    }

    /// z at the end of a tick, m, from the displacement there.
    pub fn output_m(&mut self, displacement_m: f64) -> f64 {
        let mut output = [0.0];
        self.output
            .advance(&mut self.output_memory, &[displacement_m], &mut output);
        output[0]
    }

    /// f of every member at the end of a tick, m, from the free strains there.
    pub fn inputs_m(&mut self, strains: &[f64]) -> &[f64] {
        self.input.advance(&mut self.input_memory, strains, &mut self.inputs_m);
        &self.inputs_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::{RodState, TwoPolePropagator};

    const ROD: TwoPole = TwoPole {
        gain: 7.0e6,
        damping_per_s: 7.8899e3,
        stiffness_per_s2: 6.4251e7,
        force_gain_per_kg: 0.0,
    };

    // Guards H R = G F: a simulated rod's displacement through H is the modes driven by the strain through F, to
    // rounding, for short and long ticks, a corner above and below the zero, and an overdamped rod.
    #[test]
    fn both_ways_from_strain_to_output_agree() {
        let overdamped = TwoPole {
            damping_per_s: 3e4,
            ..ROD
        };
        for (rod, zero_per_s) in [(ROD, 1000.0), (ROD, 5000.0), (overdamped, 2000.0)] {
            for (tick_s, filter_per_s) in [(5e-6, 1000.0), (5e-5, 1000.0), (5e-5, 1e5), (1e-3, 200.0)] {
                let mut filters = RodOutput::new(&rod, zero_per_s, filter_per_s, 1, tick_s).unwrap();
                let mut modes = SampledModes::new(&Modes::of_rod(&rod, zero_per_s).unwrap(), tick_s);
                let propagator = TwoPolePropagator::new(rod, tick_s).unwrap();
                let (mut state, mut acceleration, mut applied) = (RodState::default(), 0.0, 0.0);
                let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
                for tick in 0..3000 {
                    let strain = 1e-4 * (libm::sin(0.02 * f64::from(tick)) + 0.3 * f64::from(tick % 5));
                    let reached = rod.gain * strain;
                    state = propagator.advance(state, acceleration, reached);
                    acceleration = reached;
                    let measured = filters.output_m(state.displacement_m);
                    let input = filters.inputs_m(&[strain])[0];
                    let predicted = modes.advance(applied) + modes.feedthrough() * input;
                    applied = input;
                    worst = worst.max((predicted - measured).abs());
                    largest = largest.max(measured.abs());
                }
                assert!(
                    largest > 1e-6 && worst < 1e-10 * largest,
                    "tick {tick_s} s, κ {filter_per_s}, μ {zero_per_s} 1/s: {worst:e} of {largest:e} m"
                );
            }
        }
    }

    // Guards both gains at rest, and what H makes of noise above the corner: κ/μ.
    #[test]
    fn a_constant_passes_and_noise_is_lifted_as_said() {
        let mut filters = RodOutput::new(&ROD, 4000.0, 1000.0, 2, 5e-6).unwrap();
        let strain = 1e-4;
        let at_rest = strain * ROD.dc_gain();
        let mut last = (0.0, [0.0, 0.0]);
        for _ in 0..40_000 {
            let output = filters.output_m(at_rest);
            let inputs = filters.inputs_m(&[strain, 2.0 * strain]);
            last = (output, [inputs[0], inputs[1]]);
        }
        assert!((last.0 / at_rest - 1.0).abs() < 1e-9, "{last:?}");
        assert!((last.1[0] / at_rest - 1.0).abs() < 1e-9 && (last.1[1] / at_rest - 2.0).abs() < 1e-9);
        // 10 kHz is far above both corners and far below the tick.
        let mut largest = 0.0_f64;
        for tick in 0..40_000 {
            let output = filters.output_m(libm::sin(2.0 * std::f64::consts::PI * 1e4 * 5e-6 * f64::from(tick)));
            largest = if tick > 20_000 {
                largest.max(output.abs())
            } else {
                largest
            };
        }
        assert!((largest / 0.25 - 1.0).abs() < 0.1, "{largest}");
    }
}
