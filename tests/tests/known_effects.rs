//! Guards what a diagnosis is for, without the one code that plant and loop share: of a plant of somebody else's making the loop that
//! is told what is hidden in it tracks at least five times better than the loop that is not.

mod around;

use anhyst_scenario::load;
use anhyst_tests::{Witness, repository};
use anhyst_witness::{Hidden, Laws, Material, Noise, Plant, Rod};
use around::Cut;

/// The cut of diagnosed.ron on the witness.
fn cut(hidden: Hidden, believed: &str) -> Cut {
    let rod = Rod::PRINTED;
    let rod_told = format!(
        "rod.two_pole=(gain: {}, damping_per_s: {:?}, stiffness_per_s2: {:?})",
        rod.gain, rod.damping_per_s, rod.stiffness_per_s2
    );
    let believed = format!("effects=[{believed}]");
    let settings = ["placement=Embedded", "duration_s=2", &rod_told, &believed].map(|setting| setting.parse().unwrap());
    let scenario = load(&repository().join("scenarios/diagnosed.ron"), &settings).unwrap();
    let witness = Witness {
        plant: Plant::new(Material::TERFENOL_D, rod, hidden, scenario.tick_s),
        tick_s: scenario.tick_s,
        shape_a_per_m: Box::new(|_| 7012.0),
        mode: None,
        pushed_m: Box::new(|_| 0.0),
        late_ticks: 0,
        before_m: 0.0,
        of_displacement: Noise::new(1),
        of_field: Noise::new(2),
        faults: None,
    };
    around::cut(&scenario, Some(witness))
}

#[test]
fn the_loop_that_is_told_tracks_five_times_better() {
    let nothing = Hidden::NOTHING;
    #[rustfmt::skip]
    let hidden = [
        (Hidden { loop_delay_s: 2.5e-4, ..nothing }, "LoopDelay(delay_s: 2.5e-4)"),
        (Hidden { amplifier_lag_s: 1e-4, ..nothing }, "AmplifierBandwidth(time_constant_s: 1e-4)"),
        (Hidden { eddy_current_s: 1.8e-4, ..nothing }, "EddyCurrent(time_constant_s: 1.8e-4)"),
        (Hidden { amplifier_lag_s: 1e-4, laws: Laws::Other, ..nothing }, "AmplifierBandwidth(time_constant_s: 1e-4, second_order: 0.51)"),
        (Hidden { eddy_current_s: 1.8e-4, laws: Laws::Other, ..nothing }, "EddyCurrent(time_constant_s: 1.8e-4, diffusion: 1.0)"),
        (Hidden { bias_a_per_m: 500.0, ..nothing }, "BiasShift(bias_field_a_per_m: 500.0)"),
        (Hidden { pinning_growth: 0.1, ..nothing }, "ExcessLoss(pinning_growth: 0.1)"),
        (Hidden { cubic_coupling: 5e-14, ..nothing }, "Prestress(cubic_coupling_m2_per_a2: 5e-14)"),
        (Hidden { creep: 0.0325, ..nothing }, "AfterEffect(fraction: 0.0325, shortest_s: 0.03, longest_s: 3.0)"),
        (Hidden { quadratic: 0.1, ..nothing }, "QuadraticMagnetostriction(quadratic_fraction: 0.1)"),
        (Hidden { cubic_stiffness_per_m2: 1e7, ..nothing }, "Stiffening(cubic_stiffness_per_m2: 1e7)"),
        (Hidden { delta_e: 0.5, ..nothing }, "DeltaE(relative_growth: 0.5)"),
        (Hidden { friction_m: 1e-6, ..nothing }, "Friction(friction_m: 1e-6, speed_m_per_s: 1e-3)"),
        (Hidden { friction_m: 1e-6, laws: Laws::Other, ..nothing }, "Friction(friction_m: 1e-6, speed_m_per_s: 1e-5, presliding_m: 5e-7)"),
        (Hidden { backlash_m: 1.81e-6, ..nothing }, "Backlash(gap_m: 1.81e-6, start: 0.0)"),
        (Hidden { backlash_m: 1.81e-6, laws: Laws::Other, ..nothing }, "Backlash(gap_m: 1.81e-6, roundness: 1.0)"),
    ];
    let mut wrong = Vec::new();
    for (hidden, effect) in hidden {
        let [untold, told] = ["", effect].map(|believed| cut(hidden, believed));
        println!("{effect}: untold {untold:?}, told {told:?}");
        if told.rms_m > 0.2 * untold.rms_m {
            wrong.push(effect);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
