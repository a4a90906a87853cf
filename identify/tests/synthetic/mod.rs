//! Loops made from known parameters, with the faults of real instruments.

use anhyst_measured::{MeasuredLoop, MeasuredLoops};
use anhyst_model::{Hysteresis, MagneticState};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Field and true magnetization of `amplitudes.len()` closed loops of 200 samples each.
pub fn closed_loops(material: &Hysteresis, amplitudes: &[f64], noise_a_per_m: f64, seed: u64) -> MeasuredLoops {
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
    loops(amplitudes.iter().enumerate().map(one).collect())
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
) -> MeasuredLoop {
    MeasuredLoop {
        id: index.to_string(),
        rows: (0..field_a_per_m.len() as u64).collect(),
        time_s: None,
        field_a_per_m,
        magnetization_a_per_m: Some(magnetization),
        strain,
    }
}

pub fn loops(loops: Vec<MeasuredLoop>) -> MeasuredLoops {
    MeasuredLoops {
        source: "synthetic".to_owned(),
        data_hash: String::new(),
        dropped_rows: 0,
        loops,
    }
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
