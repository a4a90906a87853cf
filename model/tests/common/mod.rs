//! The 32 reference curves (`tests/reference/README.md`) and their materials.
#![allow(dead_code)] // Each test file uses its own part of this.

use anhyst_model::{Anhysteretic, Hysteresis, HysteresisLaw};
use proptest::prelude::*;

pub const MATERIALS: [&str; 4] = ["terfenol", "positive_coupling", "soft", "hard"];
pub const PATHS: [&str; 4] = ["major", "minor", "offset", "small"];

pub fn material(anhysteretic: Anhysteretic, name: &str) -> Hysteresis {
    let (saturation, shape, pinning, coupling, reversibility) = match name {
        "terfenol" => (7.65e5, 7012.0, 4000.0, -0.01, 0.18),
        "positive_coupling" => (7.65e5, 7012.0, 4000.0, 0.01, 0.18),
        "soft" => (4.0e5, 2500.0, 300.0, -0.002, 0.4),
        "hard" => (7.65e5, 7012.0, 9000.0, -0.01, 0.05),
        other => panic!("no reference material {other}"),
    };
    Hysteresis {
        anhysteretic,
        saturation_magnetization_a_per_m: saturation,
        shape_a_per_m: shape,
        pinning_a_per_m: pinning,
        coupling,
        reversibility,
        cubic_coupling_m2_per_a2: 0.0,
    }
}

/// A material from its curve, Ms, a, k as a share of a, α as a share of the fold, and c.
pub fn drawn(
    (anhysteretic, saturation, shape, pinning, coupling, reversibility): (Anhysteretic, f64, f64, f64, f64, f64),
) -> Hysteresis {
    Hysteresis {
        anhysteretic,
        saturation_magnetization_a_per_m: saturation,
        shape_a_per_m: shape,
        pinning_a_per_m: pinning * shape,
        coupling: coupling * shape / (saturation * anhysteretic.initial_slope()),
        reversibility,
        cubic_coupling_m2_per_a2: 0.0,
    }
}

/// Either curve.
pub fn curves() -> impl Strategy<Value = Anhysteretic> {
    prop_oneof![Just(Anhysteretic::Langevin), Just(Anhysteretic::Ising)]
}

/// What b₃ adds to αχ₀ at saturation: nothing in half of the draws.
pub fn cubic_shares() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), -1.0..0.5]
}

/// The same material with such a b₃.
pub fn with_cubic(material: Hysteresis, share: f64) -> Hysteresis {
    let saturation = material.saturation_magnetization_a_per_m;
    Hysteresis {
        cubic_coupling_m2_per_a2: share / (3.0 * saturation * saturation * material.initial_susceptibility()),
        ..material
    }
}

pub struct ReferenceCurve {
    pub name: String,
    pub hysteresis: Hysteresis,
    /// Field and magnetization, A/m; the first row is the demagnetised start.
    pub points: Vec<(f64, f64)>,
}

impl ReferenceCurve {
    pub fn largest_magnetization(&self) -> f64 {
        self.points
            .iter()
            .fold(0.0, |largest: f64, point| largest.max(point.1.abs()))
    }

    /// Largest |M − reference| over the largest |M|, of a march that is handed each row's field.
    pub fn worst_error(&self, mut advance: impl FnMut(f64) -> f64) -> f64 {
        let scale = self.largest_magnetization();
        self.points[1..]
            .iter()
            .map(|&(field, expected)| (advance(field) - expected).abs() / scale)
            .fold(0.0, f64::max)
    }
}

pub fn reference_curves() -> Vec<ReferenceCurve> {
    let mut curves = Vec::new();
    for (anhysteretic, label) in [(Anhysteretic::Langevin, "langevin"), (Anhysteretic::Ising, "ising")] {
        for name in MATERIALS {
            for path in PATHS {
                let name_of_file = format!("{label}_{name}_{path}");
                let file = format!("{}/tests/reference/{name_of_file}.csv", env!("CARGO_MANIFEST_DIR"));
                let text = std::fs::read_to_string(&file).expect("reference curve");
                let points = text.lines().skip(1).map(row).collect();
                curves.push(ReferenceCurve {
                    name: name_of_file,
                    hysteresis: material(anhysteretic, name),
                    points,
                });
            }
        }
    }
    curves
}

fn row(line: &str) -> (f64, f64) {
    let (field, magnetization) = line.split_once(',').expect("two columns");
    (
        field.parse().expect("field"),
        magnetization.parse().expect("magnetization"),
    )
}

/// By how much the output misses that of an input when a law is asked for it. What any law must do besides: meet the demand
/// within the limit, end where its forward step ends from the same state, to the last bit, and have a slope there.
pub fn identity_error<L: HysteresisLaw>(law: &L, state: &L::State, input: f64, limit: f64) -> f64 {
    let mut forward = state.clone();
    law.advance(&mut forward, input);
    let demanded = law.output(&forward);
    let mut answer = state.clone();
    assert!(
        law.advance_to_output(&mut answer, demanded, limit),
        "reported as limited"
    );
    let mut again = state.clone();
    law.advance(&mut again, L::input(&answer));
    assert!(again == answer, "inverse and forward step end apart");
    assert!(law.slope(&answer, true).is_finite() && law.slope(&answer, false).is_finite());
    (law.output(&answer) - demanded).abs()
}
