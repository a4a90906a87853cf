//! Guards the plant with physical effects: the chain of the model library in place of hysteresis, strain law and rod.

mod common;

use anhyst_model::{Effect, EffectKind, Material, RodConstants};
use anhyst_plant_sim::{CoilLoss, Heating, Plant, PlantError, PlantRod, PlantSettings, ShapeCourse, ThermalCircuit};
use common::{TICK_S, circuit, copper_coil, plant_of, quiet};

fn settings(effects: &[Effect]) -> PlantSettings {
    PlantSettings {
        shape: ShapeCourse::Ramp {
            from_a_per_m: 6800.0,
            rate_a_per_m_s: 500.0,
            to_a_per_m: 7000.0,
        },
        effects: Some(effects.to_vec()),
        ..quiet()
    }
}

fn plant(settings: &PlantSettings) -> Plant {
    plant_of(settings, TICK_S, 1)
}

fn field(k: u32) -> f64 {
    9e3 * libm::sin(2.0 * std::f64::consts::PI * 50.0 * TICK_S * f64::from(k))
}

// Guards the change from the plain plant to the chain: with an effect of no size a(t) drifts, the field moves and the
// tip follows as before, but for what a straight line between ticks leaves out of M: in the mean over a tick a twelfth of its
// second difference. The rod adds up to half of that by swinging.
#[test]
fn an_effect_of_no_size_changes_nothing_but_the_mean_between_ticks() {
    let absent = Effect::identity(EffectKind::EddyCurrent);
    let (mut plain, mut chained) = (plant(&settings(&[])), plant(&settings(&[absent])));
    let material = Material::terfenol_d();
    let elements = anhyst_model::RodElements::assemble(&RodConstants::paper(), 8).unwrap();
    let metres = elements.two_pole(material.strain_per_magnetization()).dc_gain();
    let mut before = [0.0; 2];
    let mut mean_excess = 0.0_f64;
    for k in 1..8000 {
        plain.advance(field(k));
        chained.advance(field(k));
        let (one, other) = (plain.state(), chained.state());
        assert_eq!(one.shape_a_per_m, other.shape_a_per_m);
        let gap_m = one.displacement_m - other.displacement_m;
        let magnetization = one.magnetic.magnetization_a_per_m;
        mean_excess = mean_excess.max((magnetization - 2.0 * before[0] + before[1]).abs() / 12.0);
        before = [magnetization, before[0]];
        let largest_m = 1.5 * metres * mean_excess;
        assert!(gap_m.abs() < largest_m, "tick {k}: {gap_m} m, not within {largest_m} m");
        let gap = one.magnetic.magnetization_a_per_m - other.magnetic.magnetization_a_per_m;
        assert!(gap.abs() < 1e-3, "tick {k}: {gap} A/m");
    }
}

// Guards the truth: a sensor that is late says what the tip was, and the state says where it is.
#[test]
fn a_late_sensor_does_not_move_the_tip() {
    let late = Effect::new(EffectKind::SensorDelay, &[4.0 * TICK_S, 0.0]).unwrap();
    let mut plant = plant(&settings(&[late]));
    let mut were = vec![plant.state().displacement_m];
    for k in 1..2000 {
        plant.advance(field(k));
        were.push(plant.state().displacement_m);
        let says = plant.measure().displacement_m;
        if k >= 4 {
            assert!((says - were[were.len() - 5]).abs() < 1e-18, "tick {k}");
        }
    }
    assert!(were.iter().any(|displacement_m| *displacement_m > 20e-6));
}

// Guards the heat: it comes from the coil's field, 1 kA/m where the amplifier gives no more, and not from the command of 7 kA/m
// that it could not follow. 2 J/K lose next to nothing in 0.2 s; the factor for the first millisecond's way there is left out.
#[test]
fn a_saturated_amplifier_heats_by_what_it_gives() {
    let limit = Effect::new(EffectKind::AmplifierSaturation, &[1e3, 1e3]).unwrap();
    let heated = PlantSettings {
        heating: Some(Heating {
            coil: Some(CoilLoss {
                resistance_ohm: 50.0,
                copper_temperature_coefficient_per_k: 0.0,
                ..copper_coil()
            }),
            circuit: ThermalCircuit {
                heat_capacity_j_per_k: 2.0,
                resistance_k_per_w: 1e3,
                ..circuit()
            },
        }),
        ..settings(&[limit])
    };
    let mut plant = plant(&heated);
    for _ in 0..4000 {
        plant.advance(7e3);
    }
    assert_eq!(plant.state().magnetic.field_a_per_m, 1e3);
    let rise_k = plant.state().temperature_k - 293.0;
    let expected_k = 50.0 * 0.1 * 0.1 / 2.0 * (4000.0 * TICK_S);
    assert!(
        (rise_k / expected_k - 1.0).abs() < 1e-2,
        "{rise_k} K, not {expected_k} K"
    );
}

// Guards the rod of elements under effects: it follows the one of two poles within 1 nm of 30 µm at 50 Hz, and an effect that is
// written for two poles is refused by name.
#[test]
fn effects_act_on_a_rod_of_elements_too() {
    let creep = [Effect::typical(EffectKind::AfterEffect)];
    let of_elements = |effects: &[Effect]| PlantSettings {
        rod: PlantRod::Elements(8),
        ..settings(effects)
    };
    let mut plants = [settings(&creep), of_elements(&creep)].map(|settings| plant(&settings));
    let mut most_m = 0.0_f64;
    for k in 1..4000 {
        let [one_m, other_m] = plants.each_mut().map(|plant| {
            plant.advance(field(k));
            plant.state().displacement_m
        });
        assert!((one_m - other_m).abs() < 1e-9, "tick {k}: {one_m} m and {other_m} m");
        most_m = most_m.max(one_m);
    }
    assert!(most_m > 30e-6);
    let wrong = of_elements(&[Effect::typical(EffectKind::Stiffening)]);
    let refused = Plant::new(&wrong, &Material::terfenol_d(), &RodConstants::paper(), TICK_S, 1).unwrap_err();
    assert!(
        matches!(&refused, PlantError::Invalid(invalid) if invalid.path == "rod"),
        "{refused}"
    );
    assert!(refused.to_string().contains("stiffening") && refused.to_string().contains("two poles"));
}
