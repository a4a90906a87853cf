//! Plant and amplifier as blocks: the loop's timing, and what the cuts do to a plain loop around them.
//! Guards: u_k in the coil at t_k+2, and that `Heavy` can be held within ±2 µm by an ordinary PID.

mod common;

use anhyst_ipc::{Block, CoilField, Now, Previous, SafeField};
use anhyst_model::{AmplifierConstants, Hysteresis, MagneticState, Material, RodConstants, RodElements, TwoPole};
use anhyst_plant_sim::{AmplifierNode, Contact, Cut, Heating, PlantNode, PlantSettings, Sensors, TWO_POLE_ELEMENTS};
use common::{TICK_S, circuit, copper_coil, expansion, quiet};

fn settings(cut: Cut) -> PlantSettings {
    PlantSettings {
        sensors: Sensors {
            displacement_noise_m: 10e-9,
            ..Sensors::default()
        },
        heating: Some(Heating {
            coil: Some(copper_coil()),
            circuit: circuit(),
        }),
        expansion: Some(expansion()),
        cut,
        contact: Contact {
            from_s: 0.3,
            to_s: None,
        },
        ..quiet()
    }
}

fn nodes(settings: &PlantSettings, amplifier: AmplifierConstants) -> (PlantNode, AmplifierNode) {
    let plant = PlantNode::new(settings, &Material::terfenol_d(), &RodConstants::paper(), TICK_S, 7).unwrap();
    (plant, AmplifierNode::new(&amplifier, TICK_S).unwrap())
}

#[test]
fn a_command_is_in_the_coil_two_ticks_later() {
    let (mut plant, mut amplifier) = nodes(&settings(Cut::Off), AmplifierConstants::default());
    let mut coil = CoilField::default();
    let mut seen = Vec::new();
    for tick in 0..20 {
        let (_, truth) = plant.step(tick, (Previous(coil),));
        seen.push(truth.coil_field_a_per_m);
        let safe = SafeField {
            field_a_per_m: 100.0 + tick as f64,
            ..SafeField::default()
        };
        (coil,) = amplifier.step(tick, (Now(safe),));
    }
    assert_eq!(seen[..2], [0.0, 0.0]);
    for (tick, field) in seen.iter().enumerate().skip(2) {
        assert_eq!(*field, 98.0 + tick as f64);
    }
}

/// A command that is no number never leaves the amplifier; limits are told in the status bits.
#[test]
fn broken_commands_and_limits() {
    let limits = AmplifierConstants {
        field_limit_a_per_m: Some(1000.0),
        slew_limit_a_per_m_s: Some(600.0 / TICK_S),
        ..AmplifierConstants::default()
    };
    let (_, mut amplifier) = nodes(&settings(Cut::Off), limits);
    let given: Vec<_> = [500.0, f64::NAN, 2000.0, 2000.0, 0.0]
        .into_iter()
        .map(|field_a_per_m| {
            let (coil,) = amplifier.step(
                0,
                (Now(SafeField {
                    field_a_per_m,
                    ..SafeField::default()
                }),),
            );
            (coil.field_a_per_m, coil.status)
        })
        .collect();
    assert_eq!(given, [(0.0, 0), (500.0, 0), (500.0, 0), (1000.0, 1), (1000.0, 1)]);
    let (coil,) = amplifier.step(0, (Now(SafeField::default()),));
    assert_eq!((coil.field_a_per_m, coil.status), (400.0, CoilField::SLEW_LIMITED));
}

/// ±40 µm at 50 Hz and ±12 µm at 150 Hz, faded in over 0.1 s, with two derivatives.
fn reference(time_s: f64) -> [f64; 3] {
    let fade = if time_s < 0.1 {
        0.5 - 0.5 * libm::cos(10.0 * core::f64::consts::PI * time_s)
    } else {
        1.0
    };
    [(40e-6, 50.0), (12e-6, 150.0)]
        .into_iter()
        .fold([0.0; 3], |[x, v, a], (amplitude, frequency_hz)| {
            let speed = 2.0 * core::f64::consts::PI * frequency_hz;
            let (sine, cosine) = libm::sincos(speed * time_s);
            let amplitude = fade * amplitude;
            [
                x + amplitude * sine,
                v + amplitude * speed * cosine,
                a - amplitude * speed * speed * sine,
            ]
        })
}

/// What a plain loop leaves: rod feedforward and PI on the magnetization, exact inverse at the true a.
struct Outcome {
    largest_error_m: f64,
    largest_force_n: f64,
    warmed_k: f64,
}

fn run(cut: Cut, crossover_hz: f64) -> Outcome {
    let (mut plant, mut amplifier) = nodes(&settings(cut), AmplifierConstants::default());
    let rod: TwoPole = RodElements::assemble(&RodConstants::paper(), TWO_POLE_ELEMENTS)
        .unwrap()
        .two_pole(Material::terfenol_d().strain_per_magnetization());
    let mut known = MagneticState::default();
    let mut coil = CoilField::default();
    let mut integral_m = 0.0;
    let mut outcome = Outcome {
        largest_error_m: 0.0,
        largest_force_n: 0.0,
        warmed_k: 0.0,
    };
    for tick in 0..30_000_u64 {
        let time_s = tick as f64 * TICK_S;
        let (measured, truth) = plant.step(tick, (Previous(coil),));
        let error_m = reference(time_s)[0] - measured.displacement_m;
        integral_m += 2.0 * core::f64::consts::PI * crossover_hz * TICK_S * error_m;
        let [x, v, a] = reference(time_s + 2.0 * TICK_S);
        let feedforward = (a + rod.damping_per_s * v + rod.stiffness_per_s2 * x) / rod.gain;
        let demand = feedforward + (0.3 * error_m + integral_m) / rod.dc_gain();
        known = Hysteresis::terfenol_d()
            .advance_to_magnetization(known, demand, 1e5)
            .state;
        let safe = SafeField {
            field_a_per_m: known.field_a_per_m,
            ..SafeField::default()
        };
        (coil,) = amplifier.step(tick, (Now(safe),));
        if time_s > 0.2 {
            outcome.largest_error_m = outcome
                .largest_error_m
                .max((reference(time_s)[0] - truth.displacement_m).abs());
            outcome.largest_force_n = outcome.largest_force_n.max(truth.cutting_force_n);
        }
        outcome.warmed_k = truth.temperature_k - 293.0;
    }
    outcome
}

#[test]
fn a_plain_loop_holds_every_preset_within_its_tolerance() {
    for (cut, name, force_n, tolerance_m) in [
        (Cut::Off, "off", 0.0..=0.0, 0.05e-6),
        (Cut::Light, "light", 3.0..=4.0, 0.2e-6),
        (Cut::Heavy, "heavy", 55.0..=70.0, 2.0e-6),
    ] {
        for crossover_hz in [100.0, 200.0, 300.0] {
            let outcome = run(cut, crossover_hz);
            println!(
                "{name:>5}, crossover {crossover_hz} Hz: largest error {:.0} nm, force {:.1} N, warmed by {:.2} K",
                outcome.largest_error_m * 1e9,
                outcome.largest_force_n,
                outcome.warmed_k
            );
            assert!(
                force_n.contains(&outcome.largest_force_n),
                "{name}: {} N",
                outcome.largest_force_n
            );
            assert!(
                outcome.largest_error_m < tolerance_m,
                "{name}: {} m",
                outcome.largest_error_m
            );
        }
    }
}
