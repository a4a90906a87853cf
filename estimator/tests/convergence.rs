//! Guards the estimator as a whole against a plant made of the same physics: bank, rod, timing and law together.

mod common;

use anhyst_estimator::{
    Estimator, EstimatorSettings, Excitation, FieldSource, GaussNewtonSettings, LawSettings, MinMaxSettings,
};
use anhyst_model::{AmplifierConstants, Anhysteretic, Material};
use common::{Rig, TICK_S, assert_a_snapshot_continues, command, rod, run, run_commanded, with};

fn folded(start_a_per_m: f64) -> EstimatorSettings {
    with(LawSettings::Folded(MinMaxSettings {
        start_a_per_m,
        ..MinMaxSettings::folded()
    }))
}

fn gauss_newton(start_a_per_m: f64) -> EstimatorSettings {
    with(LawSettings::GaussNewton(GaussNewtonSettings {
        start_a_per_m,
        ..GaussNewtonSettings::default()
    }))
}

// Guards convergence with the default settings, dead zone included, from both sides and from the middle.
#[test]
fn converges_to_the_true_shape_from_anywhere() {
    for start in [6400.0, 6800.0, 7250.0] {
        for settings in [folded(start), gauss_newton(start)] {
            let mut last = f64::NAN;
            run(
                &settings,
                2.0,
                |_| 7012.0,
                0.0,
                |_, _, _, found| last = found.correction.shape_a_per_m,
            );
            assert!((last - 7012.0).abs() < 1.0, "{settings:?} goes to {last} A/m");
        }
    }
}

// Guards the reason for the window: covers over the whole range leave a threshold that holds the estimate above the truth
// for ever (condition (b) after the paper's (19)), although V never grows.
#[test]
fn covers_over_the_whole_range_stop_short() {
    let mut last = f64::NAN;
    let law = LawSettings::Folded(MinMaxSettings {
        start_a_per_m: 7250.0,
        filter_per_s: 2000.0,
        window_a_per_m: None,
        ..MinMaxSettings::folded()
    });
    let settings = with(law);
    run(
        &settings,
        2.0,
        |_| 7012.0,
        0.0,
        |_, _, _, found| last = found.correction.shape_a_per_m,
    );
    assert!((5.0..50.0).contains(&(last - 7012.0)), "from 7250 A/m to {last} A/m");
}

// Guards the lag while the material warms up or cools down: 200 A/m per second with 10 nm of noise.
#[test]
fn follows_a_drifting_shape() {
    for (from, rate_per_s) in [(6400.0, 200.0), (7200.0, -200.0)] {
        for (settings, bar) in [(folded(6800.0), 5.0), (gauss_newton(6800.0), 3.0)] {
            let mut worst = 0.0_f64;
            let drifting = |time_s: f64| from + rate_per_s * time_s;
            run(&settings, 3.0, drifting, 10e-9, |time_s, truth, _, found| {
                if time_s > 0.5 {
                    worst = worst.max((found.correction.shape_a_per_m - truth).abs());
                }
            });
            println!("{:?} at {rate_per_s} A/m per second: worst {worst} A/m", settings.law);
            assert!(
                worst < bar,
                "{:?} lags by {worst} A/m at {rate_per_s} A/m per second",
                settings.law
            );
        }
    }
}

// Guards the monitor in its place: every law holds at rest and says so, learns from the cut, and holds again in a dwell, where only
// an unknown offset could be learnt.
#[test]
fn rest_and_dwell_hold_and_a_cut_informs() {
    let (cut_from, dwell_from) = (0.2, 0.505);
    let ticks = |time_s: f64| (time_s / TICK_S) as u64;
    let moving = |tick: u64| command(tick.clamp(ticks(cut_from), ticks(dwell_from)) - ticks(cut_from));
    for settings in [folded(6800.0), gauss_newton(6800.0)] {
        let (mut informed_at, mut held_at, mut in_dwell) = (f64::INFINITY, f64::INFINITY, f64::NAN);
        run_commanded(
            &settings,
            2.5,
            |_| 7012.0,
            10e-9,
            moving,
            |time_s, _, _, found| {
                let held = found.correction.held;
                assert_eq!(held, !found.excitation.informed, "at {time_s} s");
                if time_s < cut_from {
                    assert!(held && found.correction.shape_a_per_m == 6800.0, "at {time_s} s");
                } else if time_s < dwell_from {
                    informed_at = if held { informed_at } else { informed_at.min(time_s) };
                    assert!(!held || time_s < cut_from + 2e-3, "held at {time_s} s");
                } else if held {
                    held_at = held_at.min(time_s);
                    in_dwell = if in_dwell.is_nan() {
                        found.correction.shape_a_per_m
                    } else {
                        in_dwell
                    };
                    assert_eq!(
                        found.correction.shape_a_per_m, in_dwell,
                        "moves while held at {time_s} s"
                    );
                }
            },
        );
        println!(
            "{:?}: informed from {informed_at} s, held from {held_at} s at {in_dwell} A/m",
            settings.law
        );
        assert!(
            held_at < dwell_from + 1.5 && (in_dwell - 7012.0).abs() < 5.0,
            "{in_dwell} A/m"
        );
    }
}

// Guards the monitor's (19) against what the law with covers over the whole range does: with Langevin, the side on which it
// stops short is the side on which (19) does not hold for small errors.
#[test]
fn condition_19_tells_where_covers_over_the_whole_range_stop() {
    let mut last = Excitation::default();
    run(
        &folded(7012.0),
        0.5,
        |_| 7012.0,
        0.0,
        |_, _, _, found| last = found.excitation,
    );
    println!("{last:?}");
    assert!(last.least_error_above_a_per_m < 1.0, "{last:?}");
    assert!(last.least_error_below_a_per_m > 5.0, "{last:?}");
}

// Guards what the inverse starts from: field exact, magnetization as good as the bank's spacing allows.
#[test]
fn the_state_handed_on_is_the_plants() {
    let mut worst = 0.0_f64;
    // 7012 is no member of the grid, so this is the interpolation, not a lookup; a start at the truth leaves it alone.
    run(
        &folded(7012.0),
        0.5,
        |_| 7012.0,
        0.0,
        |_, _, magnetic, found| {
            assert_eq!(found.field.now_a_per_m, magnetic.field_a_per_m);
            worst = worst.max((found.magnetization_a_per_m - magnetic.magnetization_a_per_m).abs());
        },
    );
    assert!(worst < 0.5, "magnetization off by {worst} A/m");
}

// Guards the fixed law: one model. A bank steps in lanes and the plant alone, so their bits differ; no more than that does.
#[test]
fn a_fixed_shape_is_one_exact_model() {
    let law = LawSettings::FixedShape { shape_a_per_m: 7012.0 };
    let settings = with(law);
    run(
        &settings,
        0.2,
        |_| 7012.0,
        0.0,
        |_, _, magnetic, found| {
            assert!((found.magnetization_a_per_m - magnetic.magnetization_a_per_m).abs() < 1e-3);
            assert!(found.correction.output_error_m.abs() < 1e-12);
        },
    );
}

// Guards the play: a noisy measured field may cost accuracy, but must not ratchet the estimate away.
#[test]
fn a_noisy_measured_field_goes_through_the_play() {
    let settings = EstimatorSettings {
        field: FieldSource::Measured { play_a_per_m: 3.0 },
        ..folded(6800.0)
    };
    let material = Material::terfenol_d();
    let mut rig = Rig::new(AmplifierConstants::default());
    let mut estimator = Estimator::new(
        &settings,
        &material,
        rod(&material),
        AmplifierConstants::default(),
        TICK_S,
    )
    .unwrap();
    let (mut field, mut last) = (0.0, f64::NAN);
    for tick in 0..20_000 {
        if tick > 0 {
            rig.advance(7012.0, field);
        }
        let measured_field = field + rig.noise.normal();
        last = estimator
            .step(tick, 0.0, measured_field, rig.rod.displacement_m)
            .correction
            .shape_a_per_m;
        field = rig.amplifier.step(command(tick)).field_a_per_m;
    }
    assert!((last - 7012.0).abs() < 20.0, "{last} A/m");
}

// Guards snapshots: stored, loaded and continued, the estimator gives the same bits.
#[test]
fn a_snapshot_continues_with_the_same_bits() {
    let amplifier = AmplifierConstants {
        bandwidth_hz: Some(2000.0),
        ..AmplifierConstants::default()
    };
    assert_a_snapshot_continues(&folded(6800.0), amplifier);
}

/// Length of the paper's example.
const SECONDS: f64 = 3.0;

/// The paper's input, monotone to near saturation.
fn ramp(time_s: f64) -> f64 {
    40e3 * time_s / SECONDS
}

fn sine(time_s: f64) -> f64 {
    40e3 * (2.0 * std::f64::consts::PI * time_s).sin()
}

fn papers_example(curve: Anhysteretic, field: fn(f64) -> f64, start_a_per_m: f64) -> f64 {
    let amplifier = AmplifierConstants::default();
    let mut rig = Rig::new(amplifier);
    rig.material.hysteresis.anhysteretic = curve;
    let settings = folded(start_a_per_m);
    let mut estimator = Estimator::new(&settings, &rig.material, rod(&rig.material), amplifier, TICK_S).unwrap();
    let (mut command, mut in_coil, mut last) = (0.0, 0.0, start_a_per_m);
    for tick in 0..(SECONDS / TICK_S) as u64 {
        if tick > 0 {
            rig.advance(7012.0, in_coil);
        }
        let found = estimator.step(tick, command, in_coil, rig.rod.displacement_m);
        last = found.correction.shape_a_per_m;
        command = field((tick + 1) as f64 * TICK_S);
        in_coil = rig.amplifier.step(command).field_a_per_m;
    }
    last
}

// Guards the folded law on the paper's example without noise. Its window lets it arrive from above the truth as well, where covers over
// all of Θ stop (scalar_tests.rs).
#[test]
fn arrives_on_the_papers_example_from_everywhere() {
    for (curve, name, field) in [
        (Anhysteretic::Langevin, "ramp", ramp as fn(f64) -> f64),
        (Anhysteretic::Langevin, "sine", sine),
        (Anhysteretic::Ising, "ramp", ramp),
        (Anhysteretic::Ising, "sine", sine),
    ] {
        for start in [6400.0, 6800.0, 7250.0] {
            let error = papers_example(curve, field, start) - 7012.0;
            println!("{curve:?} {name} from {start}: {error:.3} A/m");
            assert!(error.abs() < 1.0, "{curve:?} {name} from {start}: {error} A/m");
        }
    }
}
