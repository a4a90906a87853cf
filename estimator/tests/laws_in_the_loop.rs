//! Guards the matrix law and the scalar form as laws of a scenario: exact without noise, accurate with it, and where
//! the scalar form ends.

mod common;

use anhyst_estimator::{
    Estimation, Estimator, EstimatorError, EstimatorSettings, GaussNewtonSettings, LawSettings, MinMaxSettings,
};
use anhyst_model::{AmplifierConstants, Material, Noise};
use common::{Rig, TICK_S, assert_a_snapshot_continues, command, rod, run, run_commanded, with};

fn matrix(start_a_per_m: f64) -> EstimatorSettings {
    with(LawSettings::Matrix(MinMaxSettings {
        start_a_per_m,
        ..MinMaxSettings::matrix()
    }))
}

fn scalar(start_a_per_m: f64) -> EstimatorSettings {
    with(LawSettings::Scalar(MinMaxSettings {
        start_a_per_m,
        ..MinMaxSettings::without_window()
    }))
}

/// Runs with a constant shape and any sensor: time and displacement in, measurement out.
fn run_sensed(
    settings: &EstimatorSettings,
    seconds: f64,
    shape_a_per_m: f64,
    mut sensor: impl FnMut(f64, f64) -> f64,
    mut seen: impl FnMut(f64, &Estimation),
) {
    let amplifier = AmplifierConstants::default();
    let mut rig = Rig::new(amplifier);
    let mut estimator = Estimator::new(settings, &rig.material, rod(&rig.material), amplifier, TICK_S).unwrap();
    let (mut last_command, mut field) = (0.0, 0.0);
    for tick in 0..(seconds / TICK_S) as u64 {
        let time_s = tick as f64 * TICK_S;
        if tick > 0 {
            rig.advance(shape_a_per_m, field);
        }
        let measured = sensor(time_s, rig.rod.displacement_m);
        seen(time_s, &estimator.step(tick, last_command, field, measured));
        last_command = command(tick);
        field = rig.amplifier.step(last_command).field_a_per_m;
    }
}

/// Error of `a` while it drifts with 10 nm of noise: rms and largest after 0.5 s, A/m.
fn drift(law: LawSettings, from_a_per_m: f64, rate_a_per_m_s: f64) -> (f64, f64) {
    let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    let drifting = |time_s: f64| from_a_per_m + rate_a_per_m_s * time_s;
    run(&with(law), 4.0, drifting, 10e-9, |time_s, truth, _, found| {
        if time_s > 0.5 {
            let error = found.correction.shape_a_per_m - truth;
            squares += error * error;
            count += 1.0;
            worst = worst.max(error.abs());
        }
    });
    ((squares / count).sqrt(), worst)
}

// Guards the consistency of both sides: with the true shape and no noise the error is rounding, with and without a
// washout. 6800 A/m is a member of a bank of 33, so nothing is interpolated.
#[test]
fn the_true_shape_leaves_no_error() {
    for washout_hz in [None, Some(5.0)] {
        let law = LawSettings::Matrix(MinMaxSettings {
            start_a_per_m: 6800.0,
            members: 33,
            ..MinMaxSettings::matrix()
        });
        let settings = EstimatorSettings {
            washout_hz,
            ..with(law)
        };
        let (mut error, mut moved) = (0.0_f64, 0.0_f64);
        run(
            &settings,
            0.5,
            |_| 6800.0,
            0.0,
            |_, _, _, found| {
                error = error.max(found.correction.output_error_m.abs());
                moved = moved.max((found.correction.shape_a_per_m - 6800.0).abs());
            },
        );
        println!("washout {washout_hz:?}: error {error:e} m, estimate moved by {moved:e} A/m");
        assert!(error < 1e-16 && moved < 1e-6, "{error:e} m, {moved:e} A/m");
    }
}

// Guards convergence with the default settings from both sides and from the middle.
#[test]
fn the_matrix_law_converges_from_anywhere() {
    for start in [6400.0, 6800.0, 7250.0] {
        let mut last = f64::NAN;
        run(
            &matrix(start),
            2.0,
            |_| 7012.0,
            0.0,
            |_, _, _, found| last = found.correction.shape_a_per_m,
        );
        println!("from {start} to {last} A/m");
        assert!((last - 7012.0).abs() < 0.5, "from {start} to {last} A/m");
    }
}

// Guards the tuned defaults while `a` drifts by 200 A/m per second with 10 nm of noise; prints what the docs compare.
#[test]
fn the_matrix_law_follows_a_drift_better_than_the_folded_law() {
    let laws = [
        LawSettings::Matrix(MinMaxSettings::matrix()),
        LawSettings::Folded(MinMaxSettings::folded()),
        LawSettings::GaussNewton(GaussNewtonSettings::default()),
        LawSettings::Gradient(MinMaxSettings::without_window()),
        LawSettings::Scalar(MinMaxSettings::without_window()),
    ];
    let found = laws.map(|law| {
        let name = format!("{law:?}");
        let name = name.split('(').next().unwrap_or_default().to_owned();
        let (rising, falling) = (drift(law, 6400.0, 200.0), drift(law, 7200.0, -200.0));
        println!(
            "{name:12} rising {:.2} A/m rms, {:.2} largest; falling {:.2} A/m rms, {:.2} largest",
            rising.0, rising.1, falling.0, falling.1
        );
        (rising, falling)
    });
    let [matrix, folded, ..] = found;
    assert!(matrix.0.0 < 1.3 && matrix.1.0 < 1.5, "{matrix:?}");
    assert!(matrix.0.1 < 3.5 && matrix.1.1 < 3.5, "{matrix:?}");
    assert!(
        matrix.0.0 < folded.0.0 && matrix.1.0 < folded.1.0,
        "{matrix:?} {folded:?}"
    );
}

// Guards the finding about the paper's scalar form on a cut with Langevin: from below it arrives and follows a rising
// `a`; from above, where (19) does not hold, its covers over all of Θ stop it short, and a falling `a` leaves it
// behind.
#[test]
fn the_scalar_law_stops_short_from_above() {
    for (start, least, most) in [
        (6400.0, -2.0, 2.0),
        (6800.0, -2.0, 2.0),
        (7012.0, -2.0, 2.0),
        (7250.0, 5.0, 50.0),
    ] {
        let (mut error, mut condition) = (f64::NAN, f64::NAN);
        run(
            &scalar(start),
            2.0,
            |_| 7012.0,
            0.0,
            |_, _, _, found| {
                error = found.correction.shape_a_per_m - 7012.0;
                condition = found.excitation.least_error_below_a_per_m;
            },
        );
        println!("from {start}: {error:.3} A/m; (19) holds below the estimate from {condition:.1} A/m");
        assert!((least..most).contains(&error), "from {start}: {error} A/m");
        assert!(condition > 5.0, "{condition} A/m");
    }
    let law = LawSettings::Scalar(MinMaxSettings::without_window());
    let (rising, falling) = (drift(law, 6400.0, 200.0).0, drift(law, 7200.0, -200.0).0);
    assert!(rising < 3.5 && falling > 10.0, "{rising} {falling}");
}

// Guards the monitor's hold for the new laws: nothing moves at rest, the cut informs, and a dwell holds again.
#[test]
fn rest_and_dwell_hold_and_a_cut_informs() {
    let ticks = |time_s: f64| (time_s / TICK_S) as u64;
    let moving = |tick: u64| command(tick.clamp(ticks(0.2), ticks(0.505)) - ticks(0.2));
    for settings in [matrix(6800.0), scalar(6800.0)] {
        let (mut held_at, mut dwelling) = (f64::INFINITY, f64::NAN);
        run_commanded(
            &settings,
            2.5,
            |_| 7012.0,
            10e-9,
            moving,
            |time_s, _, _, found| {
                let (held, shape) = (found.correction.held, found.correction.shape_a_per_m);
                assert_eq!(held, !found.excitation.informed, "at {time_s} s");
                assert!(
                    time_s >= 0.2 || (held && shape == 6800.0),
                    "moves at rest, at {time_s} s"
                );
                if time_s > 0.505 && held {
                    dwelling = if held_at.is_finite() { dwelling } else { shape };
                    held_at = held_at.min(time_s);
                    assert_eq!(shape, dwelling, "moves while held at {time_s} s");
                }
            },
        );
        println!("{:?}: held from {held_at} s at {dwelling} A/m", settings.law);
        assert!(held_at < 2.0 && (dwelling - 7012.0).abs() < 3.0, "{dwelling} A/m");
    }
}

// Guards against a sensor that drops out in the middle of a cut, for a tick and for a while: the estimate stays while
// it is away, and its return is no shock.
#[test]
fn a_sensor_that_comes_back_is_no_shock() {
    for settings in [matrix(6800.0), scalar(6800.0)] {
        let mut noise = Noise::new(3, 0);
        let away = |time_s: f64| (1.0..1.1).contains(&time_s) || (time_s * 1e3) % 200.0 < 0.04;
        let sensor = |time_s: f64, displacement: f64| {
            if away(time_s) {
                f64::NAN
            } else {
                displacement + 10e-9 * noise.normal()
            }
        };
        let mut worst = 0.0_f64;
        run_sensed(&settings, 2.0, 7012.0, sensor, |time_s, found| {
            assert!(!away(time_s) || found.correction.held, "at {time_s} s");
            if time_s > 0.5 {
                worst = worst.max((found.correction.shape_a_per_m - 7012.0).abs());
            }
        });
        println!("{:?}: worst {worst} A/m", settings.law);
        assert!(worst < 3.0, "{worst} A/m");
    }
}

// Guards the washout with the matrix law: a tip that creeps by 0.5 µm a second, as a rod's that warms by 0.35 K a
// second.
#[test]
fn a_washout_keeps_creep_out_of_the_matrix_law() {
    let worst = |washout_hz| {
        let settings = EstimatorSettings {
            washout_hz,
            ..matrix(6800.0)
        };
        let mut worst = 0.0_f64;
        let creeping = |time_s: f64, displacement: f64| displacement + 0.5e-6 * time_s;
        run_sensed(&settings, 2.0, 7012.0, creeping, |time_s, found| {
            if time_s > 1.5 {
                worst = worst.max((found.correction.shape_a_per_m - 7012.0).abs());
            }
        });
        worst
    };
    let (without, with) = (worst(None), worst(Some(5.0)));
    println!("without a washout {without} A/m, with one of 5 Hz {with} A/m");
    assert!(without > 50.0 && with < 10.0, "{without} {with}");
}

// Guards snapshots: stored, loaded and continued, the estimator gives the same bits.
#[test]
fn a_snapshot_continues_with_the_same_bits() {
    for settings in [matrix(6800.0), scalar(6800.0)] {
        let settings = EstimatorSettings {
            washout_hz: Some(5.0),
            ..settings
        };
        assert_a_snapshot_continues(&settings, AmplifierConstants::default());
    }
}

// Guards the refusal of a zero that the rod's damping does not cover, with the path of the setting.
#[test]
fn a_zero_beyond_the_rods_damping_is_refused() {
    let material = Material::terfenol_d();
    let settings = with(LawSettings::Matrix(MinMaxSettings {
        zero_per_s: Some(8000.0),
        ..MinMaxSettings::matrix()
    }));
    let refused = Estimator::new(
        &settings,
        &material,
        rod(&material),
        AmplifierConstants::default(),
        TICK_S,
    )
    .unwrap_err();
    assert!(matches!(refused, EstimatorError::Setting(_)), "{refused}");
    assert!(
        refused
            .to_string()
            .starts_with("law.zero_per_s: 8000 1/s must be below the rod's damping 7889.9 1/s"),
        "{refused}"
    );
}
