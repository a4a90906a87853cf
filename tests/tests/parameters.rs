//! Guards what estimating several parameters on line is worth, on the witness, which shares no code with the model that the loop
//! believes in.

mod around;

use anhyst_scenario::{Scenario, load};
use anhyst_tests::{repository, rough};
use around::{Cut, cut};

fn scenario(base: &str, law: &str, settings: &[&str]) -> Scenario {
    let believed = "rod.two_pole=(gain: 1.3724e-2, damping_per_s: 7889.9, stiffness_per_s2: 6.4251e7)";
    let settings: Vec<_> = [believed, "placement=Embedded", "expect.settling_s=1.0", law]
        .iter()
        .chain(settings)
        .map(|setting| setting.parse().unwrap())
        .collect();
    load(&repository().join("scenarios").join(base), &settings).unwrap()
}

const SEVERAL: &str = "estimator.law=MultiParameter(start_a_per_m: 6800.0)";
const ALONE: &str = "estimator.law=Folded(range_a_per_m: (6300.0, 7300.0), start_a_per_m: 6800.0, members: 33)";

/// The bar of every rig: of the floor.
const OF_FLOOR: f64 = 1.5;

// k, c and Ms wrong, `a` drifting by 200 A/m per second: as if all were known, where `a` alone leaves ten times that.
#[test]
fn a_material_that_is_otherwise_is_learned_while_it_cuts() {
    let run = |law: &str, material: [f64; 3]| -> Cut {
        let own = cut(
            &scenario("milling.ron", law, &["duration_s=3.0"]),
            Some(rough::other_material(material)),
        );
        println!("{material:?}, {}: {own:?}", &law[14..24]);
        own
    };
    let floor = run(ALONE, [1.0; 3]);
    for material in [
        [1.0; 3],
        [0.9, 1.0, 1.0],
        [1.1, 1.0, 1.0],
        [1.05, 1.06, 0.99],
        [0.93, 0.9, 1.01],
    ] {
        let own = run(SEVERAL, material);
        assert!(
            own.max_m <= OF_FLOOR * floor.max_m,
            "{material:?}: {own:?}, floor {floor:?}"
        );
    }
    let alone = run(ALONE, [1.1, 1.0, 1.0]);
    assert!(alone.max_m > 10.0 * floor.max_m, "{alone:?}");
}

// Rigs with all that no parameter explains: several parameters are led astray no further than `a` alone is, and the learner takes
// the rest. `ANHYST_ROUGH=20`: every seed.
#[test]
fn what_no_parameter_explains_leads_none_astray() {
    let floor = cut(
        &scenario("milling_rough.ron", ALONE, &["controller.learning=None"]),
        Some(rough::nominal(0)),
    );
    println!("floor: {floor:?}");
    let seeds = std::env::var("ANHYST_ROUGH").map_or(4, |own| own.parse().unwrap());
    for seed in 0..seeds {
        let own = cut(&scenario("milling_rough.ron", SEVERAL, &[]), Some(rough::rough(seed)));
        println!("{seed}: {own:?}");
        assert!(
            own.max_m <= OF_FLOOR * floor.max_m,
            "seed {seed}: {own:?}, floor {floor:?}"
        );
    }
}
