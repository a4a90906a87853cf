//! Time of one step: single model, alone and with its sensitivities, bank of 33, inverse, rod; and ratios to 33 single models and to a loop of tanh.
//!
//! `cargo bench -p anhyst-model`. Ratios carry over between machines better than nanoseconds do.
//! Least of several rounds, so that a busy machine disturbs little.

use std::hint::black_box;
use std::time::Instant;

use anhyst_model::{
    Anhysteretic, Bank, Hysteresis, MagneticState, Material, RodConstants, RodElements, RodElementsPropagator,
    SensitiveState,
};

const MEMBERS: usize = 33;
const STEPS: usize = 8000;
const ROUNDS: usize = 15;

/// 20 kHz: 50 Hz with a decaying amplitude, then biased minor loops at 250 Hz. At most 0.06 k a sample.
fn drive() -> Vec<f64> {
    (1..=STEPS)
        .map(|step| {
            let time = step as f64 / 20e3;
            let angle = 2.0 * std::f64::consts::PI * time;
            if step < 3 * STEPS / 4 {
                15e3 * (1.0 - time / 0.4) * (50.0 * angle).sin()
            } else {
                4e3 + 1.5e3 * (250.0 * angle).sin()
            }
        })
        .collect()
}

/// Nanoseconds per call of `step`, least of the rounds.
fn time_per_step(fields: &[f64], mut step: impl FnMut(f64)) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for &field in fields {
            step(black_box(field));
        }
        least = least.min(start.elapsed().as_nanos() as f64 / fields.len() as f64);
    }
    least
}

fn main() {
    let fields = drive();
    let base = Hysteresis::terfenol_d();
    let shapes: Vec<f64> = (0..MEMBERS)
        .map(|member| 6300.0 + 1000.0 * member as f64 / (MEMBERS - 1) as f64)
        .collect();

    let tanh = time_per_step(&fields, |field| {
        let mut sum = 0.0;
        for shape in &shapes {
            sum += black_box(field / shape).tanh();
        }
        black_box(sum);
    }) / MEMBERS as f64;
    println!("tanh                        {tanh:8.1} ns");

    for anhysteretic in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        let base = Hysteresis { anhysteretic, ..base };
        let mut state = MagneticState::default();
        let single = time_per_step(&fields, |field| state = black_box(base).advance(state, field));
        let mut sensitive = SensitiveState::default();
        let sensitivities = time_per_step(&fields, |field| {
            sensitive = black_box(base).advance_with_sensitivities(sensitive, field);
        });
        let mut states = vec![MagneticState::default(); MEMBERS];
        let singles = time_per_step(&fields, |field| {
            for (state, &shape) in states.iter_mut().zip(&shapes) {
                *state = black_box(base).with_shape(shape).advance(*state, field);
            }
        });
        let mut bank = Bank::new(base, &shapes).expect("valid bank");
        let together = time_per_step(&fields, |field| bank.advance(field));
        black_box((&state, &sensitive, &states, &bank));
        let mut state = MagneticState::default();
        let magnetizations: Vec<f64> = fields
            .iter()
            .map(|&field| {
                state = base.advance(state, field);
                state.magnetization_a_per_m
            })
            .collect();
        let mut state = MagneticState::default();
        let inverse = time_per_step(&magnetizations, |demand| {
            state = black_box(base).advance_to_magnetization(state, demand, 3e4).state;
        });
        println!("{anhysteretic:?}");
        println!(
            "  single model, one step    {single:8.1} ns  {:6.1} x tanh",
            single / tanh
        );
        println!(
            "  with 5 sensitivities      {sensitivities:8.1} ns  {:6.1} x tanh",
            sensitivities / tanh
        );
        println!(
            "  inverse, one step         {inverse:8.1} ns  {:6.1} x tanh",
            inverse / tanh
        );
        println!("  {MEMBERS} single models          {singles:8.1} ns");
        println!(
            "  bank of {MEMBERS}                {together:8.1} ns  {:6.1} ns a member, {:.2} x tanh, {:.1} times faster than single models",
            together / MEMBERS as f64,
            together / MEMBERS as f64 / tanh,
            singles / together
        );
    }

    let elements = RodElements::assemble(&RodConstants::paper(), 8).expect("valid rod");
    let mut rod = RodElementsPropagator::new(&elements, 5e-5).expect("valid tick");
    let force_n = elements.constants().force_per_strain_n() * Material::terfenol_d().strain_per_magnetization();
    let step = time_per_step(&fields, |field| {
        rod.advance(force_n * field, 0.0);
    });
    println!("rod of 8 elements, one step {step:8.1} ns");
}
