//! Guards the loop against knowing its plant by heart: estimator, inverse, controller and guard of milling.ron around an
//! amplifier, a plant and sensors that share no code with the model that they believe in.

mod around;

use anhyst_scenario::load;
use anhyst_tests::{Witness, repository};
use anhyst_witness::{Hidden, Material, Noise, Plant, Rod};
use around::Cut;

/// 1.5 times what is reached.
const RMS_M: f64 = 5e-9;
const MAX_M: f64 = 21.6e-9;

/// The witness with the sensors and the drift of milling.ron.
fn cut(hidden: Hidden, settings: &[&str]) -> Cut {
    let rod = Rod::PRINTED;
    let believed = format!(
        "rod.two_pole=(gain: {}, damping_per_s: {:?}, stiffness_per_s2: {:?})",
        rod.gain, rod.damping_per_s, rod.stiffness_per_s2
    );
    let settings: Vec<_> = [believed.as_str(), "placement=Embedded"]
        .iter()
        .chain(settings)
        .map(|setting| setting.parse().unwrap())
        .collect();
    let scenario = load(&repository().join("scenarios/milling.ron"), &settings).unwrap();
    let material = Material {
        shape_a_per_m: 6400.0,
        ..Material::TERFENOL_D
    };
    let witness = Witness {
        plant: Plant::new(material, rod, hidden, scenario.tick_s),
        tick_s: scenario.tick_s,
        shape_a_per_m: Box::new(|time_s| (6400.0 + 200.0 * time_s).min(7200.0)),
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
fn a_plant_of_somebody_elses_making_is_cut_as_well() {
    let cut = cut(Hidden::default(), &[]);
    println!("{cut:?}");
    assert!(cut.rms_m <= RMS_M && cut.max_m <= MAX_M, "{cut:?}");
    assert!(cut.shape_rms_a_per_m < 5.0, "{cut:?}");
}

/// The other half of the proof: the same cut with an estimate that stays where it is, and on a plant with a lag that nobody knows.
#[test]
fn the_bound_is_one_that_can_be_missed() {
    let lag = Hidden {
        eddy_current_s: 2e-5,
        ..Hidden::default()
    };
    let fixed = "estimator.law=FixedShape(shape_a_per_m: 6800.0)";
    for (hidden, settings) in [(Hidden::default(), &[fixed][..]), (lag, &[])] {
        let cut = cut(hidden, &[&["duration_s=1.0"], settings].concat());
        println!("{hidden:?} {settings:?}: {cut:?}");
        assert!(
            cut.rms_m > RMS_M && cut.max_m > MAX_M,
            "{hidden:?} {settings:?}: {cut:?}"
        );
    }
}
