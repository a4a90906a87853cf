//! Guards the controller as a block: the timing of its ports, faults at its inputs, its limits, snapshots, settings files.

mod common;

use anhyst_controller::{
    AntiWindup, Controller, ControllerSettings, DerivativeOn, LearningSettings, PidSettings, TrajectorySettings,
};
use anhyst_ipc::{Block, Demand, FieldCommand, Measurement, Message, NodeId, Now, Previous, SafeField, wiring};
use anhyst_model::{Magnetostriction, Material};
use common::{Rig, TICK_S, rod, settings, two_tones};
use proptest::prelude::*;
use std::path::Path;

fn pid() -> PidSettings {
    PidSettings {
        kp: 0.3,
        ki_per_s: 400.0,
        kd_s: 5e-5,
        derivative_filter_s: 2e-4,
        derivative_on: DerivativeOn::Error,
        output_limit_m: Some(20e-6),
        anti_windup: AntiWindup::BackCalculation { tracking_time_s: 2e-3 },
        ease_in_s: 0.01,
    }
}

fn full() -> ControllerSettings {
    ControllerSettings {
        start_s: 0.02,
        feedback: Some(pid()),
        learning: Some(LearningSettings::default()),
        ..settings(two_tones())
    }
}

/// The reference is that of the measurement's instant, the feedforward that of two ticks later.
#[test]
fn ports_have_the_documented_instants() {
    let mut rig = Rig::new(&settings(two_tones()));
    let trajectory = rig.controller.trajectory().clone();
    for tick in 0..200_u64 {
        let (demand, displacement_m) = rig.step((0.0, 0.0));
        let reference_m = trajectory.at(tick as f64 * TICK_S).position_m;
        assert_eq!(demand.reference_m, reference_m);
        assert_eq!(demand.error_m, reference_m - displacement_m);
        assert_eq!(demand.magnetization_a_per_m, demand.feedforward_a_per_m);
    }
    let wires = wiring::<Controller>();
    assert_eq!(wires.iter().map(|wire| wire.delay).collect::<Vec<_>>(), [0, 1, 1]);
    assert!(wires.iter().all(|wire| wire.reader == NodeId::Controller));
}

/// A displaced rod at the start: no bump in the demand, and the status says when the start is over.
#[test]
fn start_is_bumpless() {
    let mut rig = Rig::new(&full());
    let mut before = 0.0;
    for tick in 0..1000 {
        let (demand, _) = rig.step((100.0, 100.0));
        let step = (demand.magnetization_a_per_m - before).abs();
        assert!(step < 8e3, "tick {tick}: a step of {step} A/m");
        assert_eq!(
            demand.status & Demand::STARTING != 0,
            f64::from(tick) * TICK_S < 0.02,
            "tick {tick}"
        );
        before = demand.magnetization_a_per_m;
    }
}

/// Where the inverse's limit holds the demand back, anti-windup brings the error down sooner after it.
#[test]
fn windup_at_the_inverse_limit_is_seen_and_undone() {
    let area = |anti_windup| {
        let mut with = settings(TrajectorySettings::SmoothRamps {
            points: vec![(0.0, 0.0), (0.02, 60e-6), (0.12, 60e-6), (0.14, 20e-6), (0.4, 20e-6)],
        });
        with.feedback = Some(PidSettings {
            anti_windup,
            output_limit_m: None,
            ease_in_s: 0.0,
            ..pid()
        });
        let mut rig = Rig::new(&with);
        rig.limit_a_per_m = 2.2e5;
        let (mut sum, mut stopped) = (0.0, 0);
        for tick in 0..6000 {
            let (demand, _) = rig.step((0.0, 0.0));
            stopped += u64::from(demand.status & Demand::INTEGRATION_STOPPED != 0);
            if f64::from(tick) * TICK_S > 0.14 {
                sum += demand.error_m.abs() * TICK_S;
            }
        }
        println!("{anti_windup:?}: area of the error after the limit {sum:.3e} m s, stopped in {stopped} ticks");
        sum
    };
    let none = area(AntiWindup::None);
    for strategy in [
        AntiWindup::Clamping,
        AntiWindup::BackCalculation { tracking_time_s: 2e-3 },
    ] {
        assert!(area(strategy) < 0.1 * none);
    }
}

/// A sensor that fails for a while leaves no trace in the integrator.
#[test]
fn missing_measurements_hold_the_error() {
    let mut controller = common::controller(&full());
    let mut step = |tick, displacement_m| {
        let measurement = Measurement {
            displacement_m,
            ..Measurement::default()
        };
        controller
            .step(
                tick,
                (
                    Now(measurement),
                    Previous(SafeField::default()),
                    Previous(FieldCommand::default()),
                ),
            )
            .0
    };
    let held = (0..1000).fold(None, |_, tick| Some(step(tick, 1e-7))).unwrap();
    for tick in 1000..1100 {
        let demand = step(tick, f64::NAN);
        assert_eq!(
            (demand.error_m, demand.integral_m, demand.status),
            (held.error_m, held.integral_m, Demand::INTEGRATION_STOPPED)
        );
        assert!(demand.magnetization_a_per_m.is_finite());
    }
}

/// Every law's ends are respected and nothing but finite numbers comes out, whatever bits come in.
fn never_nan(law: Magnetostriction, words: &[[Vec<u64>; 3]]) -> Result<(), TestCaseError> {
    let material = Material {
        magnetostriction: law,
        ..Material::terfenol_d()
    };
    let mut controller = Controller::new(&full(), rod(), &material, TICK_S, Path::new(".")).unwrap();
    let saturation = material.hysteresis.saturation_magnetization_a_per_m;
    for (tick, [measurement, safe, command]) in words.iter().enumerate() {
        let tick = tick as u64;
        let inputs = (
            Now(Measurement::from_words(tick, &measurement[..Measurement::FIELDS.len()])),
            Previous(SafeField::from_words(tick, &safe[..SafeField::FIELDS.len()])),
            Previous(FieldCommand::from_words(tick, &command[..FieldCommand::FIELDS.len()])),
        );
        let (demand,) = controller.step(tick, inputs);
        prop_assert!(demand.magnetization_a_per_m.abs() <= saturation, "{demand:?}");
        for value in [
            demand.magnetization_rate_a_per_m_s,
            demand.feedforward_a_per_m,
            demand.feedback_a_per_m,
            demand.error_m,
            demand.integral_m,
        ] {
            prop_assert!(value.is_finite(), "{demand:?}");
        }
    }
    Ok(())
}

fn words() -> impl Strategy<Value = Vec<u64>> {
    let word = prop_oneof![
        any::<u64>(),
        (-1e-4..1e-4f64).prop_map(f64::to_bits),
        (-1e6..1e6f64).prop_map(f64::to_bits),
        Just(f64::NAN.to_bits()),
        0..16_u64,
    ];
    prop::collection::vec(word, 8)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nothing_but_finite_numbers_comes_out(tokens in prop::collection::vec([words(), words(), words()], 60)) {
        let saturation_magnetostriction = 1.005e-3;
        for law in [
            Magnetostriction::Linearised { saturation_magnetostriction, bias_fraction: 0.5 },
            Magnetostriction::Biased { saturation_magnetostriction, bias_fraction: 0.5 },
            Magnetostriction::Quadratic { saturation_magnetostriction },
        ] {
            never_nan(law, &tokens)?;
        }
    }
}

/// A snapshot continues as the original does, bit for bit.
#[test]
fn snapshots_continue_alike() {
    let mut rig = Rig::new(&full());
    for _ in 0..777 {
        rig.step((10.0, 10.0));
    }
    let text = serde_json::to_string(&rig.controller).unwrap();
    let mut copy: Controller = serde_json::from_str(&text).unwrap();
    assert_eq!(copy, rig.controller);
    for tick in 777..1000 {
        let measurement = Measurement {
            displacement_m: 1e-6 * (tick as f64).sin(),
            ..Measurement::default()
        };
        let inputs = (
            Now(measurement),
            Previous(SafeField::default()),
            Previous(FieldCommand::default()),
        );
        assert_eq!(copy.step(tick, inputs), rig.controller.step(tick, inputs));
    }
}

/// What stands in a scenario file: short where the defaults do, unknown names refused.
#[test]
fn settings_read_from_ron() {
    let short = r#"(
        trajectory: Profile(spindle_rpm: 3000, lobes: [(1, 40e-6, 0), (3, 12e-6, 0.3)]),
        start_s: 0.1,
        feedback: Some((kp: 0.3, ki_per_s: 400, anti_windup: BackCalculation(tracking_time_s: 2e-3))),
        learning: Some((harmonics: 20)),
    )"#;
    let settings: ControllerSettings = ron::from_str(short).unwrap();
    assert!(settings.feedforward && settings.hold_correction);
    settings.validate(TICK_S, 1.0).unwrap();
    let refused = ron::from_str::<ControllerSettings>(&short.replace("kp:", "gain:")).unwrap_err();
    assert!(refused.to_string().contains("gain"), "{refused}");
    let path = |change: fn(&mut ControllerSettings)| {
        let mut changed = settings.clone();
        change(&mut changed);
        changed.validate(TICK_S, 1.0).unwrap_err().path
    };
    assert_eq!(path(|s| s.start_s = 2.0), "start_s");
    assert_eq!(
        path(|s| s.trajectory = TrajectorySettings::SmoothRamps { points: vec![] }),
        "trajectory.points"
    );
    let mut unstable = settings.clone();
    unstable.feedback = Some(PidSettings { kp: 3.0, ..pid() });
    let refusal = Controller::new(&unstable, rod(), &Material::terfenol_d(), TICK_S, Path::new(".")).unwrap_err();
    assert_eq!(refusal.path, "feedback");
    assert!(refusal.sentence.contains("unstable"), "{refusal}");
}
