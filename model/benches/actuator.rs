//! Time of a run of 40 000 samples through the actuator's chain: nominal, with each effect, with two.
//!
//! `cargo bench -p anhyst-model --bench actuator`. Least of several rounds, so that a busy machine disturbs little; the bare
//! hysteresis in the first line is what most of every other line consists of.

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

use anhyst_model::{
    ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, Hysteresis, MagneticState, simulate,
};

const SAMPLES: usize = 40_000;
const ROUNDS: usize = 25;
const TICK_S: f64 = 1e-4;

/// Growing loops at 10 Hz, then two tones at 50 and 150 Hz: 100 A/m a sample on average.
fn drive() -> Vec<f64> {
    (0..SAMPLES)
        .map(|index| {
            let time_s = TICK_S * index as f64;
            let angle = 2.0 * PI * time_s;
            if time_s < 2.0 {
                6e3 * time_s * (10.0 * angle).sin()
            } else {
                5e3 * (50.0 * angle).sin() + 1.5e3 * (150.0 * angle).sin()
            }
        })
        .collect()
}

/// Milliseconds, least of the rounds.
fn least_ms(mut work: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        work();
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
    }
    least
}

fn main() {
    let commands = drive();
    let hysteresis = Hysteresis::terfenol_d();
    let bare = least_ms(|| {
        let mut state = MagneticState::default();
        for &field in &commands {
            state = hysteresis.advance(state, field);
        }
        black_box(state);
    });
    println!("{:32} {bare:6.2} ms", "bare hysteresis");
    let mut outputs = ActuatorOutputs::default();
    let mut report = |name: &str, effects: &[Effect]| {
        let mut model = ActuatorModel::terfenol_d();
        model.effects = effects.to_vec();
        let time = least_ms(|| {
            let inputs = ActuatorInputs::commands(black_box(&commands));
            simulate(&model, TICK_S, inputs, &mut outputs).expect("a valid model");
            black_box(&outputs);
        });
        println!("{name:32} {time:6.2} ms");
    };
    report("nominal", &[]);
    // Large enough to be at work all the time.
    let strong = |kind: EffectKind| {
        let mut effect = Effect::typical(kind);
        let value = match kind {
            EffectKind::LoopDelay | EffectKind::SensorDelay => 1.37e-4,
            EffectKind::AmplifierBandwidth | EffectKind::EddyCurrent => 1.8e-4,
            EffectKind::AmplifierSlew => 2e6,
            EffectKind::AmplifierSaturation => 5e3,
            EffectKind::Prestress => 5e-14,
            EffectKind::Friction => 1.5e-6,
            EffectKind::Stiffening => 1e8,
            EffectKind::SensorSaturation => 3e-5,
            _ => effect.values()[0],
        };
        effect.values_mut()[0] = value;
        effect
    };
    for kind in EffectKind::ALL {
        report(kind.name(), &[strong(kind)]);
    }
    for (first, second) in [
        (EffectKind::EddyCurrent, EffectKind::AfterEffect),
        (EffectKind::LoopDelay, EffectKind::EddyCurrent),
        (EffectKind::EddyCurrent, EffectKind::Friction),
    ] {
        let name = format!("{} and {}", first.name(), second.name());
        report(&name, &[strong(first), strong(second)]);
    }
}
