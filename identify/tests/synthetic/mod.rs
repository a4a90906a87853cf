//! Loops made from known parameters, with the faults of real instruments.

use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{Hysteresis, MagneticState};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Field and true magnetization of `amplitudes.len()` closed loops of 200 samples each.
pub fn closed_loops(material: &Hysteresis, amplitudes: &[f64], noise_a_per_m: f64, seed: u64) -> Vec<MeasuredRun> {
    let mut noise = Noise::new(seed);
    let one = |(index, amplitude): (usize, &f64)| {
        let samples = 200;
        let field = (0..=samples).map(|i| amplitude * (std::f64::consts::TAU * i as f64 / samples as f64).cos());
        let field: Vec<f64> = field.collect();
        let mut state = MagneticState::default();
        field.iter().for_each(|&to| state = material.advance(state, to));
        let magnetization = run(material, state, &field);
        let magnetization = magnetization
            .iter()
            .map(|m| m + noise_a_per_m * noise.gaussian())
            .collect();
        measured(index, field, magnetization, None)
    };
    amplitudes.iter().enumerate().map(one).collect()
}

/// Magnetization along a field from a state.
pub fn run(material: &Hysteresis, mut state: MagneticState, field: &[f64]) -> Vec<f64> {
    let advance = |&to: &f64| {
        state = material.advance(state, to);
        state.magnetization_a_per_m
    };
    field.iter().map(advance).collect()
}

pub fn measured(
    index: usize,
    field_a_per_m: Vec<f64>,
    magnetization: Vec<f64>,
    strain: Option<Vec<f64>>,
) -> MeasuredRun {
    let mut series = vec![
        (Quantity::Field, field_a_per_m),
        (Quantity::Magnetization, magnetization),
    ];
    series.extend(strain.map(|strain| (Quantity::Strain, strain)));
    let mut run = MeasuredRun::in_memory("synthetic", None, series).unwrap();
    run.loop_id = index.to_string();
    run
}

/// Gaussian noise from a seed.
pub struct Noise(ChaCha8Rng);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Noise(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Mean 0, standard deviation 1: twelve uniforms.
    pub fn gaussian(&mut self) -> f64 {
        (0..12)
            .map(|_| (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
            .sum::<f64>()
            - 6.0
    }
}
