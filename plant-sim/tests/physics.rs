//! The simulated plant against closed forms. Guards: what estimator, controller and scenarios are judged by.
//! `cargo test --release -p anhyst-plant-sim -- --nocapture` prints the figures that the docs quote.

mod common;

use anhyst_model::{Hysteresis, Material, RodConstants, RodElements, RodState, TwoPolePropagator};
use anhyst_plant_sim::{
    CoilLoss, Cut, Heating, Milling, Plant, PlantRod, PlantSettings, ShapeCourse, TWO_POLE_ELEMENTS, ThermalCircuit,
};
use common::{TICK_S, circuit, copper_coil, expansion, plant_of, quiet};

fn plant(settings: &PlantSettings) -> Plant {
    plant_of(settings, TICK_S, 1)
}

/// Whose resistance does not grow, for closed forms.
fn coil() -> CoilLoss {
    CoilLoss {
        copper_temperature_coefficient_per_k: 0.0,
        ..copper_coil()
    }
}

/// Tip force per displacement, N/m.
fn static_stiffness() -> f64 {
    1.0 / RodConstants::paper().static_compliance_m_per_n()
}

#[test]
fn rest_stays_rest_to_the_last_bit() {
    for rod in [PlantRod::TwoPole, PlantRod::Elements(8)] {
        let heating = Some(Heating {
            coil: Some(coil()),
            circuit: circuit(),
        });
        let settings = PlantSettings {
            rod,
            heating,
            expansion: Some(expansion()),
            ..quiet()
        };
        let mut plant = plant(&settings);
        let start = *plant.state();
        for _ in 0..1000 {
            plant.advance(0.0);
            assert_eq!(*plant.state(), start);
            let readings = plant.measure();
            assert_eq!(
                (readings.displacement_m, readings.field_a_per_m, readings.temperature_k),
                (0.0, 0.0, 0.0)
            );
        }
    }
}

/// Half a tick before each sample the tip is where exact propagation over half ticks finds it, within tick⁴/384 times
/// the fourth derivative, here ĉ·(ĉ + k̂/tick) times the way at most; a straight line would be off by far more.
#[test]
fn between_samples_the_tip_is_where_half_ticks_take_it() {
    let two_pole = RodElements::assemble(&RodConstants::paper(), TWO_POLE_ELEMENTS)
        .unwrap()
        .two_pole(Material::terfenol_d().strain_per_magnetization());
    let half = TwoPolePropagator::new(two_pole, 0.5 * TICK_S).unwrap();
    let mut plant = plant(&quiet());
    let (mut rod, mut before_m, mut worst_m, mut straight_m) = (RodState::default(), 0.0, 0.0_f64, 0.0_f64);
    let mut from = 0.0;
    for tick in 0..400 {
        // A jump, so that the rod rings.
        plant.advance(if tick < 20 { 0.0 } else { 5e3 });
        let state = *plant.state();
        let to = two_pole.acceleration(state.magnetic.magnetization_a_per_m, 0.0);
        let middle = 0.5 * (from + to);
        rod = half.advance(rod, from, middle);
        worst_m = worst_m.max((state.displacement_between_m - rod.displacement_m).abs());
        straight_m = straight_m.max((0.5 * (before_m + state.displacement_m) - rod.displacement_m).abs());
        rod = half.advance(rod, middle, to);
        assert!((state.displacement_m - rod.displacement_m).abs() < 1e-13, "tick {tick}");
        (from, before_m) = (to, state.displacement_m);
    }
    let (stiff, damped) = (
        two_pole.stiffness_per_s2 * TICK_S * TICK_S,
        two_pole.damping_per_s * TICK_S,
    );
    let bound_m = stiff * (stiff + damped) / 384.0 * before_m.abs();
    println!("{worst_m:.2e} m, bound {bound_m:.2e} m, straight line {straight_m:.2e} m");
    assert!(worst_m <= bound_m && straight_m > 20.0 * bound_m);
}

/// A rod that starts warm starts lengthened, and does not spring there.
#[test]
fn a_warm_start_is_at_rest_too() {
    let settings = PlantSettings {
        expansion: Some(expansion()),
        start_temperature_k: 303.0,
        ..quiet()
    };
    let mut plant = plant(&settings);
    let start = *plant.state();
    assert!((start.displacement_m - 13.0e-6).abs() < 0.1e-6, "{start:?}");
    for _ in 0..100 {
        plant.advance(0.0);
        assert_eq!(*plant.state(), start);
    }
}

/// x = w/ĉ·M = 2.1369e-10 m per A/m for the linearised law, whichever the rod: EA·(dλ/dM)/(EA/L + k_L).
#[test]
fn a_held_field_settles_at_the_static_gain() {
    for rod in [PlantRod::TwoPole, PlantRod::Elements(1), PlantRod::Elements(8)] {
        let mut plant = plant(&PlantSettings { rod, ..quiet() });
        for k in 0..4000 {
            plant.advance(10_000.0 * (f64::from(k) / 1000.0).min(1.0));
        }
        let state = plant.state();
        let gain = state.displacement_m / state.magnetic.magnetization_a_per_m;
        let slope = Material::terfenol_d().strain_per_magnetization();
        let expected = RodConstants::paper().force_per_strain_n() * slope / static_stiffness();
        println!("static gain, {rod:?}: {gain:.5e} m per A/m");
        assert!(
            (gain / expected - 1.0).abs() < 1e-9,
            "{rod:?}: {gain} m per A/m, not {expected}"
        );
        assert!((gain / 2.1369e-10 - 1.0).abs() < 1e-4);
    }
}

/// The reduction that estimator and controller build on: below 1 nm of ±34 µm at 50 Hz, and its gain is the paper's.
#[test]
fn the_two_pole_rod_is_the_rod_of_elements_at_low_frequency() {
    let two_pole = RodElements::assemble(&RodConstants::paper(), TWO_POLE_ELEMENTS)
        .unwrap()
        .two_pole(Material::terfenol_d().strain_per_magnetization());
    println!("two-pole of {TWO_POLE_ELEMENTS} elements: {two_pole:?}");
    assert!((two_pole.gain / 1.3724e-2 - 1.0).abs() < 1e-4);

    let mut plants = [PlantRod::TwoPole, PlantRod::Elements(8)].map(|rod| plant(&PlantSettings { rod, ..quiet() }));
    let (mut amplitude, mut difference): (f64, f64) = (0.0, 0.0);
    for k in 1..4000 {
        let field = 9_000.0 * libm::sin(2.0 * core::f64::consts::PI * 50.0 * TICK_S * f64::from(k));
        plants.iter_mut().for_each(|plant| plant.advance(field));
        let [one, other] = plants.each_ref().map(|plant| plant.state().displacement_m);
        amplitude = amplitude.max(one.abs());
        difference = difference.max((one - other).abs());
    }
    println!(
        "50 Hz, amplitude {:.1} um: two-pole and 8 elements differ by {:.3} nm",
        amplitude * 1e6,
        difference * 1e9
    );
    assert!((30e-6..50e-6).contains(&amplitude), "{amplitude} m");
    assert!(difference < 1e-9, "{difference} m");
}

/// `a` of the milling scenario: what the plant uses at t_k is 6400 + 200·t_k, and the magnetization is the model's at that a.
#[test]
fn a_drifts_as_told_and_the_magnetization_with_it() {
    let shape = ShapeCourse::Ramp {
        from_a_per_m: 6400.0,
        rate_a_per_m_s: 200.0,
        to_a_per_m: 6450.0,
    };
    let mut plant = plant(&PlantSettings { shape, ..quiet() });
    let mut expected = Default::default();
    for k in 1..8000_u32 {
        let field = 9_000.0 * libm::sin(0.0157 * f64::from(k));
        plant.advance(field);
        let shape_a_per_m = (6400.0 + 200.0 * (f64::from(k) * TICK_S)).min(6450.0);
        assert_eq!(plant.state().shape_a_per_m, shape_a_per_m);
        expected = Hysteresis::terfenol_d()
            .with_shape(shape_a_per_m)
            .advance(expected, field);
        assert_eq!(plant.state().magnetic, expected);
    }
}

/// 1 K lengthens a free rod of 0.115 m by 1.38 µm; against its end spring 1.30 µm are left.
#[test]
fn warmth_lengthens_the_rod_against_its_end_spring() {
    let settings = PlantSettings {
        heating: Some(Heating {
            coil: None,
            circuit: ThermalCircuit {
                heat_capacity_j_per_k: 1e-3,
                ..circuit()
            },
        }),
        expansion: Some(expansion()),
        cut: Cut::Custom(Milling {
            heat_w: 0.5,
            cutting_coefficient_n_per_m2: 1e-3,
            ..Milling::heavy()
        }),
        ..quiet()
    };
    let mut plant = plant(&settings);
    (0..4000).for_each(|_| plant.advance(0.0));
    let rod = RodConstants::paper();
    let against_spring = rod.force_per_strain_n() / rod.length_m / static_stiffness();
    let expected = 12e-6 * 0.115 * against_spring;
    assert!(
        (plant.state().temperature_k - 294.0).abs() < 1e-9,
        "{:?}",
        plant.state()
    );
    println!("expansion: {:.3} um/K", plant.state().displacement_m * 1e6);
    assert!((plant.state().displacement_m / expected - 1.0).abs() < 1e-6 && (expected - 1.30e-6).abs() < 0.01e-6);
}

/// A coil at ±10 kA/m, 50 Hz, loses 1.5 W on average; T(t) = T∞ + (T₀ − T∞)e^(−t/RC), and Langevin's a follows it.
#[test]
fn coil_loss_warms_the_rod_and_a_follows() {
    let settings = PlantSettings {
        shape: ShapeCourse::Thermal {
            reference_a_per_m: 7012.0,
            reference_temperature_k: 293.0,
        },
        heating: Some(Heating {
            coil: Some(coil()),
            circuit: circuit(),
        }),
        ..quiet()
    };
    let mut plant = plant(&settings);
    for k in 1..=40_000_u32 {
        plant.advance(1e4 * libm::sin(2.0 * core::f64::consts::PI * 50.0 * (f64::from(k) * TICK_S)));
    }
    let state = plant.state();
    let expected = 3.0 * -libm::expm1(-2.0 / 100.0);
    assert!(
        (state.temperature_k - 293.0 - expected).abs() < 1e-4,
        "{} K, not {expected} K",
        state.temperature_k - 293.0
    );
    // But for the last bits: the effect counts from ambient.
    assert!((state.shape_a_per_m / (7012.0 * state.temperature_k / 293.0) - 1.0).abs() < 1e-15);
}

/// A constant force (four teeth in a slot) bends the rod by F/k; with the cut off there is no force.
#[test]
fn a_steady_cut_deflects_by_force_over_stiffness() {
    let milling = Milling {
        teeth: 4,
        spindle_rpm: 6000.0,
        ..Milling::heavy()
    };
    for rod in [PlantRod::TwoPole, PlantRod::Elements(8)] {
        let mut cut = plant(&PlantSettings {
            rod,
            cut: Cut::Custom(milling),
            ..quiet()
        });
        let mut free = plant(&PlantSettings { rod, ..quiet() });
        for _ in 0..4000 {
            cut.advance(0.0);
            free.advance(0.0);
        }
        let force = milling.cutting_stiffness_n_per_m() * milling.feed_per_tooth_m;
        assert!(
            (cut.state().cutting_force_n / force - 1.0).abs() < 1e-9,
            "{:?}",
            cut.state()
        );
        let deflection = -force / static_stiffness();
        assert!(
            (cut.state().displacement_m / deflection - 1.0).abs() < 1e-9,
            "{:?}",
            cut.state()
        );
        assert_eq!((free.state().cutting_force_n, free.state().displacement_m), (0.0, 0.0));
    }
}

/// Tlusty: at the worst tooth period the cut is stable up to K = 2kζ(1 + ζ), and chatters above.
/// That period follows from ω = ω_n√(1 + 2ζ) and cot(ωT/2) = 2K·Im G(iω).
#[test]
fn chatter_begins_at_the_known_limit() {
    let tick_s = 1e-5;
    let rod = RodElements::assemble(&RodConstants::paper(), TWO_POLE_ELEMENTS)
        .unwrap()
        .two_pole(1.0);
    let (stiffness, damping_ratio) = (static_stiffness(), rod.damping_ratio());
    let limit = 2.0 * stiffness * damping_ratio * (1.0 + damping_ratio);
    println!("stiffness {stiffness:.4e} N/m, chatter limit {limit:.4e} N/m");
    assert!(Milling::heavy().cutting_stiffness_n_per_m() < 0.01 * limit);

    let ratio = libm::sqrt(1.0 + 2.0 * damping_ratio);
    let angular_frequency = ratio * libm::sqrt(rod.stiffness_per_s2);
    let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * damping_ratio * ratio);
    let imaginary_compliance = -imaginary / (stiffness * (real * real + imaginary * imaginary));
    let phase = 2.0 * libm::atan2(1.0, 2.0 * limit * imaginary_compliance);
    let tooth_period_s = (phase + 2.0 * core::f64::consts::PI * 3.0) / angular_frequency;

    let feed_per_tooth_m = 1e-6;
    let late_swing = |share: f64| {
        let milling = Milling {
            teeth: 4,
            spindle_rpm: 60.0 / (4.0 * tooth_period_s),
            cutting_coefficient_n_per_m2: share * limit / 1e-3,
            axial_depth_m: 1e-3,
            feed_per_tooth_m,
            ..Milling::heavy()
        };
        let settings = PlantSettings {
            cut: Cut::Custom(milling),
            ..quiet()
        };
        let mut plant = plant_of(&settings, tick_s, 1);
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for k in 0..200_000 {
            plant.advance(0.0);
            if k > 190_000 {
                low = low.min(plant.state().displacement_m);
                high = high.max(plant.state().displacement_m);
            }
        }
        (high - low) / feed_per_tooth_m
    };
    let (below, above) = (late_swing(0.97), late_swing(1.03));
    println!("swing after 2 s, in feeds: {below:.2e} at 0.97 of the limit, {above:.2} at 1.03");
    assert!(below < 1e-3, "chatters at 0.97 of the limit: {below} feeds");
    assert!(above > 0.1, "no chatter at 1.03 of the limit: {above} feeds");
}
