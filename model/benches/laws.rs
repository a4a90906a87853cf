//! Time of a step of each hysteresis law, and of its inverse, in units of one `tanh` measured in the same run.
//!
//! `cargo bench -p anhyst-model --bench laws`. Least of several rounds; the input is a sine of 1000 samples with a slow change of its
//! amplitude, so that turning points come and go.

use std::hint::black_box;
use std::time::Instant;

use anhyst_model::{
    BoucWen, Density, Hysteresis, HysteresisLaw, Law, PlayGroup, PlaySum, Preisach, ScaledDomainWall, Warp,
};

const SAMPLES: usize = 20_000;
const ROUNDS: usize = 25;

/// Nanoseconds a sample, least of the rounds.
fn least_ns(mut work: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        work();
        least = least.min(start.elapsed().as_secs_f64() * 1e9 / SAMPLES as f64);
    }
    least
}

fn inputs() -> Vec<f64> {
    let angle = |sample: usize| 2.0 * std::f64::consts::PI * sample as f64 / 1000.0;
    (0..SAMPLES)
        .map(|sample| (0.7 + 0.3 * (0.071 * angle(sample)).cos()) * angle(sample).sin())
        .collect()
}

fn plays(count: usize) -> PlaySum {
    let radii = (0..count).map(|play| 0.9 * play as f64 / count as f64).collect();
    PlaySum::prandtl_ishlinskii(radii, vec![1.0 / count as f64; count])
}

fn main() {
    let inputs = inputs();
    let tanh = least_ns(|| {
        let sum: f64 = inputs.iter().map(|input| libm::tanh(black_box(*input))).sum();
        black_box(sum);
    });
    println!("{:28} {tanh:7.1} ns", "tanh");
    let tanh_groups = PlaySum {
        groups: [0.1, 0.3, 0.9, 2.7]
            .map(|scale| PlayGroup {
                warp: Warp::Tanh { scale },
                radii: (0..8).map(|play| scale * f64::from(play * play) / 64.0).collect(),
                weights: vec![1.0; 8],
            })
            .to_vec(),
    };
    let cells = |rows| {
        Preisach::from(Density::Cells {
            levels: Density::even_levels([-1.0, 1.0], rows),
            weights: vec![1.0; rows * (rows + 1) / 2],
        })
    };
    let wall = ScaledDomainWall {
        gain: 1.0,
        hysteresis: Hysteresis {
            shape_a_per_m: 0.3,
            pinning_a_per_m: 0.2,
            saturation_magnetization_a_per_m: 1.0,
            coupling: 0.01,
            ..Hysteresis::terfenol_d()
        },
    };
    let bouc_wen = BoucWen {
        amplitude: 1.0,
        yield_input: 0.5,
        exponent: 2.0,
        loading_share: 0.8,
        stiffens: false,
    };
    for (name, law) in [
        ("Prandtl-Ishlinskii, 12", Law::Plays(plays(12))),
        ("Prandtl-Ishlinskii, 32", Law::Plays(plays(32))),
        ("tanh plays, 4 x 8", Law::Plays(tanh_groups)),
        ("Preisach, 12 rows", Law::Preisach(cells(12))),
        ("Preisach, 24 rows", Law::Preisach(cells(24))),
        ("Preisach, 36 rows", Law::Preisach(cells(36))),
        ("Bouc-Wen", Law::BoucWen(bouc_wen)),
        ("domain wall", Law::DomainWall(wall)),
    ] {
        let mut state = law.rest();
        let step = least_ns(|| {
            for input in &inputs {
                law.advance(&mut state, *input);
                black_box(law.output(&state));
            }
        });
        let demands: Vec<f64> = inputs
            .iter()
            .map(|input| {
                law.advance(&mut state, *input);
                law.output(&state)
            })
            .collect();
        let inverse = least_ns(|| {
            for demand in &demands {
                black_box(law.advance_to_output(&mut state, *demand, 3.0));
            }
        });
        println!(
            "{name:28} {step:7.1} ns {:6.2} tanh   inverse {inverse:7.1} ns {:6.2} tanh",
            step / tanh,
            inverse / tanh
        );
    }
}
