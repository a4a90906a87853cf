//! Guards the plant with physical effects: the chain of the model library in place of hysteresis, strain law and rod.

use anhyst_model::{Effect, EffectKind, Material, RodConstants};
use anhyst_plant_sim::{Cut, Plant, PlantRod, PlantSettings, Sensors, ShapeCourse};

const TICK_S: f64 = 5e-5;

fn settings(effects: &[Effect]) -> PlantSettings {
    PlantSettings {
        shape: ShapeCourse::Ramp {
            from_a_per_m: 6800.0,
            rate_a_per_m_s: 500.0,
            to_a_per_m: 7000.0,
        },
        rod: PlantRod::TwoPole,
        sensors: Sensors::default(),
        start_temperature_k: 293.0,
        heating: None,
        expansion: None,
        cut: Cut::Off,
        contact: Default::default(),
        effects: Some(effects.to_vec()),
        material: None,
        two_pole: None,
    }
}

fn plant(settings: &PlantSettings) -> Plant {
    Plant::new(settings, &Material::terfenol_d(), &RodConstants::paper(), TICK_S, 1).unwrap()
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
    let mut bulge = 0.0_f64;
    for k in 1..8000 {
        plain.advance(field(k));
        chained.advance(field(k));
        let (one, other) = (plain.state(), chained.state());
        assert_eq!(one.shape_a_per_m, other.shape_a_per_m);
        let gap_m = one.displacement_m - other.displacement_m;
        let magnetization = one.magnetic.magnetization_a_per_m;
        bulge = bulge.max((magnetization - 2.0 * before[0] + before[1]).abs() / 12.0);
        before = [magnetization, before[0]];
        let largest_m = 1.5 * metres * bulge;
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

// Guards against silence: what only the plain plant has is refused beside effects.
#[test]
fn elements_are_refused_beside_effects() {
    let wrong = PlantSettings {
        rod: PlantRod::Elements(8),
        ..settings(&[Effect::typical(EffectKind::AfterEffect)])
    };
    let refused = Plant::new(&wrong, &Material::terfenol_d(), &RodConstants::paper(), TICK_S, 1);
    assert!(refused.is_err_and(|error| error.to_string().contains("two poles")));
}
