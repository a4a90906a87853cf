//! A step of each hysteresis law and of its inverse, on a sine whose amplitude changes slowly, so that turning points come and go.

use super::measure::Timed;
use anhyst_model::{
    BoucWen, Density, Hysteresis, HysteresisLaw, Law, PlayGroup, PlaySum, Preisach, ScaledDomainWall, Warp,
};
use std::f64::consts::TAU;
use std::hint::black_box;

fn inputs(steps: usize) -> Vec<f64> {
    (0..steps)
        .map(|step| {
            let angle = TAU * step as f64 / 1000.0;
            (0.7 + 0.3 * (0.071 * angle).cos()) * angle.sin()
        })
        .collect()
}

fn laws() -> [(&'static str, Law); 8] {
    let plays = |count: usize| {
        let radii = (0..count).map(|play| 0.9 * play as f64 / count as f64).collect();
        Law::Plays(PlaySum::prandtl_ishlinskii(radii, vec![1.0 / count as f64; count]))
    };
    let groups = [0.1, 0.3, 0.9, 2.7].map(|scale| PlayGroup {
        warp: Warp::Tanh { scale },
        radii: (0..8).map(|play| scale * f64::from(play * play) / 64.0).collect(),
        weights: vec![1.0; 8],
    });
    let preisach = |rows| {
        Law::Preisach(Preisach::from(Density::Cells {
            levels: Density::even_levels([-1.0, 1.0], rows),
            weights: vec![1.0; rows * (rows + 1) / 2],
        }))
    };
    let bouc_wen = BoucWen {
        amplitude: 1.0,
        yield_input: 0.5,
        exponent: 2.0,
        loading_share: 0.8,
        stiffens: false,
    };
    let domain_wall = ScaledDomainWall {
        gain: 1.0,
        hysteresis: Hysteresis {
            shape_a_per_m: 0.3,
            pinning_a_per_m: 0.2,
            saturation_magnetization_a_per_m: 1.0,
            coupling: 0.01,
            ..Hysteresis::terfenol_d()
        },
    };
    [
        ("Prandtl-Ishlinskii, 12 plays", plays(12)),
        ("Prandtl-Ishlinskii, 32 plays", plays(32)),
        (
            "tanh plays, 4 x 8",
            Law::Plays(PlaySum {
                groups: groups.to_vec(),
            }),
        ),
        ("Preisach, 12 rows", preisach(12)),
        ("Preisach, 24 rows", preisach(24)),
        ("Preisach, 36 rows", preisach(36)),
        ("Bouc-Wen", Law::BoucWen(bouc_wen)),
        ("domain wall as a law", Law::DomainWall(domain_wall)),
    ]
}

/// Each law, then its inverse.
pub fn timed(steps: usize) -> Vec<Timed<'static>> {
    laws()
        .into_iter()
        .flat_map(|(name, law)| both(name, law, steps))
        .collect()
}

fn both(name: &str, law: Law, steps: usize) -> [Timed<'static>; 2] {
    let inputs = inputs(steps);
    let (mut state, inverse) = (law.rest(), law.clone());
    let demands: Vec<f64> = inputs
        .iter()
        .map(|input| {
            law.advance(&mut state, *input);
            law.output(&state)
        })
        .collect();
    let (mut forward, mut back) = (law.rest(), law.rest());
    [
        Timed::new(name, "step", steps, move || {
            for input in &inputs {
                law.advance(&mut forward, *input);
                black_box(law.output(&forward));
            }
        }),
        Timed::new(format!("{name}, inverse"), "step", steps, move || {
            for demand in &demands {
                black_box(inverse.advance_to_output(&mut back, *demand, 3.0));
            }
        })
        .at_least("its step", [(1.0, name)]),
    ]
}
