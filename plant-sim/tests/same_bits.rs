//! Determinism and snapshots. Guards: replay, and that a copied or restored plant is the plant.

mod common;

use anhyst_model::{Material, RodConstants};
use anhyst_plant_sim::{
    Contact, Cut, Heating, Plant, PlantError, PlantRod, PlantSettings, SensorFaults, Sensors, ShapeCourse,
    TemperatureSensor, ThermalCircuit,
};
use common::{TICK_S, circuit, copper_coil, expansion, plant_of, quiet};
use proptest::prelude::*;

/// Everything switched on.
fn busy(rod: PlantRod, cut: Cut) -> PlantSettings {
    PlantSettings {
        shape: ShapeCourse::Thermal {
            reference_a_per_m: 7012.0,
            reference_temperature_k: 293.0,
        },
        rod,
        sensors: Sensors {
            displacement_noise_m: 10e-9,
            displacement_resolution_m: 1e-9,
            field_noise_a_per_m: 1.0,
            field_resolution_a_per_m: 0.5,
            temperature: Some(TemperatureSensor {
                noise_k: 0.01,
                resolution_k: 0.001,
            }),
            faults: SensorFaults {
                displacement_flicker_m: 5e-9,
                ..SensorFaults::default()
            },
        },
        start_temperature_k: 295.0,
        heating: Some(Heating {
            coil: Some(copper_coil()),
            circuit: ThermalCircuit {
                heat_capacity_j_per_k: 0.5,
                ..circuit()
            },
        }),
        expansion: Some(expansion()),
        cut,
        contact: Contact {
            from_s: 0.002,
            to_s: Some(0.02),
        },
        ..quiet()
    }
}

fn plant(settings: &PlantSettings, seed: u64) -> Plant {
    plant_of(settings, TICK_S, seed)
}

/// The bits of everything that a plant says over some ticks.
fn bits(plant: &mut Plant, ticks: std::ops::Range<u32>) -> Vec<[u64; 10]> {
    ticks
        .map(|k| {
            plant.advance(9_000.0 * libm::sin(0.0157 * f64::from(k)));
            let (readings, state) = (plant.measure(), plant.state());
            [
                readings.displacement_m,
                readings.field_a_per_m,
                readings.temperature_k,
                state.displacement_m,
                state.displacement_between_m,
                state.magnetic.field_a_per_m,
                state.magnetic.magnetization_a_per_m,
                state.shape_a_per_m,
                state.temperature_k,
                state.cutting_force_n,
            ]
            .map(f64::to_bits)
        })
        .collect()
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_other_noise() {
    let settings = busy(PlantRod::TwoPole, Cut::Heavy);
    let said = bits(&mut plant(&settings, 1), 1..600);
    assert_eq!(said, bits(&mut plant(&settings, 1), 1..600));
    let other = bits(&mut plant(&settings, 2), 1..600);
    assert!(
        said.iter().zip(&other).all(|(one, two)| one[3..] == two[3..]),
        "the seed must not move the truth"
    );
    assert!(
        said.iter().zip(&other).any(|(one, two)| one[..3] != two[..3]),
        "the seed must move the noise"
    );
}

/// Switching one sensor's noise off leaves the draws of the others.
#[test]
fn every_sensor_has_noise_of_its_own() {
    let settings = busy(PlantRod::TwoPole, Cut::Off);
    let mut deaf = settings.clone();
    deaf.sensors.displacement_noise_m = 0.0;
    deaf.sensors.temperature = None;
    let (said, other) = (
        bits(&mut plant(&settings, 1), 1..100),
        bits(&mut plant(&deaf, 1), 1..100),
    );
    assert!(said.iter().zip(&other).all(|(one, two)| one[1] == two[1]));
    assert!(said.iter().zip(&other).any(|(one, two)| one[0] != two[0]));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    /// Wherever a run is copied or put on disk, it goes on with the same bits: rod, face, noise and all.
    #[test]
    fn a_snapshot_goes_on_with_the_same_bits(
        before in 1_u32..700,
        seed: u64,
        rod in prop_oneof![Just(PlantRod::TwoPole), (1_usize..10).prop_map(PlantRod::Elements)],
        cut in prop_oneof![Just(Cut::Off), Just(Cut::Light), Just(Cut::Heavy)],
    ) {
        let mut original = plant(&busy(rod, cut), seed);
        bits(&mut original, 1..before);
        let mut copy = original.clone();
        let mut restored: Plant = serde_json::from_str(&serde_json::to_string(&original).unwrap()).unwrap();
        prop_assert_eq!(&restored, &original);
        let said = bits(&mut original, before..before + 200);
        prop_assert_eq!(&said, &bits(&mut copy, before..before + 200));
        prop_assert_eq!(&said, &bits(&mut restored, before..before + 200));
    }

    /// A sensor's error is its noise and half a step of its resolution, no more: six sigma of 10 nm white and 5 nm flicker, and 0.5 nm.
    #[test]
    fn readings_stay_near_the_truth(seed: u64) {
        let mut plant = plant(&busy(PlantRod::TwoPole, Cut::Light), seed);
        for k in 1..200_u32 {
            plant.advance(f64::from(k));
            let (readings, state) = (plant.measure(), *plant.state());
            prop_assert!((readings.displacement_m - state.displacement_m).abs() < 68e-9);
            prop_assert!((readings.field_a_per_m - state.magnetic.field_a_per_m).abs() < 6.3);
            prop_assert!((readings.temperature_k - state.temperature_k).abs() < 0.061);
        }
    }
}

#[test]
fn settings_read_from_ron_with_defaults_and_refuse_what_they_do_not_know() {
    let least = "(shape: Constant(a_per_m: 7012.0), sensors: (displacement_noise_m: 1e-8, field_noise_a_per_m: 1.0))";
    let settings: PlantSettings = ron::from_str(least).unwrap();
    assert_eq!(settings.validate(), Ok(()));
    assert_eq!(
        (settings.rod, settings.cut, settings.start_temperature_k),
        (PlantRod::TwoPole, Cut::Off, 293.0)
    );
    assert_eq!(
        ron::from_str::<PlantSettings>(&ron::to_string(&settings).unwrap()).unwrap(),
        settings
    );
    assert!(ron::from_str::<PlantSettings>(&least.replace("shape:", "shap:")).is_err());
    assert!(ron::from_str::<PlantSettings>(&least.replace("1.0))", "1.0), noise: 3)")).is_err());
}

/// A refusal says where: the scenario's line is found by this path.
#[test]
fn refusals_have_their_path() {
    let good = busy(PlantRod::TwoPole, Cut::Heavy);
    let path = |change: &dyn Fn(&mut PlantSettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        settings.validate().unwrap_err().path
    };
    assert_eq!(
        path(&|s| s.shape = ShapeCourse::Constant { a_per_m: -1.0 }),
        "shape.a_per_m"
    );
    assert_eq!(path(&|s| s.rod = PlantRod::Elements(0)), "rod");
    assert_eq!(
        path(&|s| s.sensors.displacement_noise_m = f64::NAN),
        "sensors.displacement_noise_m"
    );
    assert_eq!(path(&|s| s.start_temperature_k = 20.0), "start_temperature_k");
    assert_eq!(path(&|s| s.contact.to_s = Some(0.0)), "contact.to_s");
    assert_eq!(
        path(&|s| s.heating.as_mut().unwrap().circuit.heat_capacity_j_per_k = 0.0),
        "heating.circuit"
    );
    // A tick that cannot resolve the teeth is found when the plant is built.
    let build = |settings: &PlantSettings, tick_s| {
        Plant::new(settings, &Material::terfenol_d(), &RodConstants::paper(), tick_s, 1).unwrap_err()
    };
    assert!(matches!(build(&good, 1e-3), PlantError::Invalid(refusal) if refusal.path == "cut.spindle_rpm"));
}

/// A drift into shapes at which the anhysteretic curve folds (αMs/3a ≥ 1) is refused before the run, not found in it.
#[test]
fn a_drift_into_invalid_shapes_is_refused() {
    let mut material = Material::terfenol_d();
    material.hysteresis.coupling = 0.02;
    let build = |to_a_per_m| {
        let shape = ShapeCourse::Ramp {
            from_a_per_m: 7000.0,
            rate_a_per_m_s: -1.0,
            to_a_per_m,
        };
        let settings = PlantSettings {
            shape,
            ..busy(PlantRod::TwoPole, Cut::Off)
        };
        Plant::new(&settings, &material, &RodConstants::paper(), 5e-5, 1)
    };
    assert!(build(6500.0).is_ok());
    assert!(matches!(build(5000.0), Err(PlantError::Model(_))));
}
