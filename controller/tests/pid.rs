//! Guards the PID against closed forms, and its strategies against windup against each other.

mod common;

use anhyst_controller::{AntiWindup, Applied, DerivativeOn, LoopShape, Pid, PidSettings};
use common::{TICK_S, rod};

fn settings(kp: f64, ki_per_s: f64, kd_s: f64) -> PidSettings {
    PidSettings {
        kp,
        ki_per_s,
        kd_s,
        derivative_filter_s: if kd_s > 0.0 { 2e-4 } else { 0.0 },
        derivative_on: DerivativeOn::Measurement,
        output_limit_m: None,
        anti_windup: AntiWindup::Clamping,
        ease_in_s: 0.0,
    }
}

/// Integrator alone on a plant y_k = u_{k−1}: e_k = r·(1 − ki·T)^(k−1) after the first tick.
#[test]
fn integrator_on_a_static_plant_is_a_geometric_series() {
    let ki = 400.0;
    let mut pid = Pid::new(&settings(0.0, ki, 0.0), TICK_S);
    let (reference, mut y) = (1e-6, 0.0);
    for tick in 0..2000_u32 {
        let expected = reference * (1.0 - ki * TICK_S).powi(tick.saturating_sub(1) as i32);
        assert!(
            (reference - y - expected).abs() < 1e-18,
            "tick {tick}: {:e} against {expected:e}",
            reference - y
        );
        y = pid.step(reference, y, Applied::Fully).feedback_m;
    }
}

/// The derivative of a ramp of slope v settles at kd·v as 1 − exp(−t/τ).
#[test]
fn derivative_filter_settles_as_a_first_order_lag() {
    for (on, sign) in [(DerivativeOn::Measurement, -1.0), (DerivativeOn::Error, 0.0)] {
        let (kd, slope) = (1e-3, 0.02);
        let mut pid = Pid::new(
            &PidSettings {
                derivative_on: on,
                ..settings(0.0, 0.0, kd)
            },
            TICK_S,
        );
        for tick in 0..200 {
            let time_s = f64::from(tick) * TICK_S;
            let u = pid.step(slope * time_s, slope * time_s, Applied::Fully).feedback_m;
            let expected = sign * kd * slope * (1.0 - (-time_s / 2e-4).exp());
            assert!(
                (u - expected).abs() < 1e-15,
                "{on:?}, tick {tick}: {u:e} against {expected:e}"
            );
        }
    }
}

/// A step of the reference kicks a derivative on the error, and not one on the measurement.
#[test]
fn reference_steps_kick_the_derivative_on_the_error_only() {
    let kick = |on| {
        let mut pid = Pid::new(
            &PidSettings {
                derivative_on: on,
                ..settings(0.0, 0.0, 1e-3)
            },
            TICK_S,
        );
        pid.step(0.0, 0.0, Applied::Fully);
        pid.step(1e-6, 0.0, Applied::Fully).feedback_m
    };
    assert_eq!(kick(DerivativeOn::Measurement), 0.0);
    assert!(kick(DerivativeOn::Error) > 1e-6);
}

/// The first output is the given one whatever the error, with and without easing, and after a restart.
#[test]
fn starts_are_bumpless() {
    for ease_in_s in [0.0, 0.01] {
        let mut pid = Pid::new(
            &PidSettings {
                ease_in_s,
                ..settings(0.5, 100.0, 1e-4)
            },
            TICK_S,
        );
        assert!(pid.step(30e-6, 1e-6, Applied::Fully).feedback_m.abs() < 1e-20);
        let mut before = 0.0;
        for _ in 0..400 {
            let u = pid.step(30e-6, 1e-6, Applied::Fully).feedback_m;
            assert!((u - before).abs() < 0.5e-6, "a bump of {:e} m", u - before);
            before = u;
        }
        pid.restart(7e-6);
        assert!((pid.step(-20e-6, 1e-6, Applied::Fully).feedback_m - 7e-6).abs() < 1e-20);
    }
}

/// What the guard does while it ramps opens the loop: the integral stands, and closing has no bump. What the tick in which the
/// guard acted made of the integral was not let through, be it a spike of 1 mm.
#[test]
fn opened_loops_close_without_a_bump() {
    let mut pid = Pid::new(&settings(0.3, 200.0, 0.0), TICK_S);
    for _ in 0..100 {
        pid.step(1e-6, 0.0, Applied::Fully);
    }
    let held = pid.step(1e-6, 0.0, Applied::Fully).integral_m;
    pid.step(1e-6, 1e-3, Applied::Fully);
    for _ in 0..1000 {
        let output = pid.step(5e-6, 0.0, Applied::Open);
        assert_eq!(
            (output.feedback_m, output.integral_m, output.integration_stopped),
            (held, held, true)
        );
    }
    let closed = pid.step(5e-6, 0.0, Applied::Fully);
    assert!((closed.feedback_m - held).abs() < 1e-20);
}

/// A measurement that is none holds the error and stops the integrator, also as the very first one.
#[test]
fn missing_measurements_never_enter() {
    for missing in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -2.0] {
        let mut pid = Pid::new(&settings(0.3, 200.0, 1e-4), TICK_S);
        assert_eq!(pid.step(1e-6, missing, Applied::Fully).feedback_m, 0.0);
        for _ in 0..50 {
            pid.step(1e-6, 0.4e-6, Applied::Fully);
        }
        let before = pid.step(1e-6, 0.4e-6, Applied::Fully);
        for _ in 0..50 {
            let output = pid.step(2e-6, missing, Applied::Fully);
            assert_eq!(
                (output.integral_m, output.error_m),
                (before.integral_m, before.error_m),
                "{missing}"
            );
            assert!(output.integration_stopped && output.feedback_m.is_finite());
        }
        assert!(pid.step(1e-6, 0.4e-6, Applied::Fully).feedback_m.is_finite());
    }
}

/// Largest overshoot (m) and settling time (s, to 1 %) of a step that needs more than the limit for 50 ms.
fn overshoot(anti_windup: AntiWindup, outside: bool) -> (f64, f64) {
    let limit_m = 1e-6;
    let gains = PidSettings {
        output_limit_m: (!outside).then_some(limit_m),
        anti_windup,
        ..settings(0.2, 200.0, 0.0)
    };
    let mut pid = Pid::new(&gains, TICK_S);
    // A first-order plant of 5 ms; the reference is out of reach for 50 ms, then 0.5 µm.
    let lag = (-TICK_S / 5e-3_f64).exp();
    let (mut y, mut applied, mut below_m, mut settled_s) = (0.0, Applied::Fully, 0.0_f64, 0.0);
    for tick in 0..6000 {
        let time_s = f64::from(tick) * TICK_S;
        let reference = if time_s < 0.05 { 2e-6 } else { 0.5e-6 };
        let wanted = pid.step(reference, y, applied).feedback_m;
        let given = wanted.clamp(-limit_m, limit_m);
        applied = if given == wanted {
            Applied::Fully
        } else {
            Applied::Short {
                excess_m: wanted - given,
            }
        };
        y = lag * y + (1.0 - lag) * given;
        if time_s > 0.05 {
            below_m = below_m.max(reference - y);
            if (y - reference).abs() > 0.01 * reference {
                settled_s = time_s - 0.05;
            }
        }
    }
    (below_m, settled_s)
}

/// Each strategy settles sooner than none, whether the limit is the PID's own or one that it is told about.
#[test]
fn anti_windup_shortens_the_way_back() {
    let back = AntiWindup::BackCalculation { tracking_time_s: 1e-3 };
    for outside in [false, true] {
        let found = [AntiWindup::None, AntiWindup::Clamping, back].map(|strategy| overshoot(strategy, outside));
        for (name, (below_m, settled_s)) in ["none", "clamping", "back calculation"].iter().zip(found) {
            println!(
                "{name}, limit {}: {:.1} nm beyond, settled after {:.1} ms",
                if outside { "outside" } else { "own" },
                below_m * 1e9,
                settled_s * 1e3
            );
        }
        assert!(
            found[1].1 < 0.7 * found[0].1 && found[2].1 < 0.7 * found[0].1,
            "{found:?}"
        );
    }
}

/// A cut of which only the side is known stops the integrator on that side only.
#[test]
fn cuts_stop_one_side() {
    for strategy in [
        AntiWindup::Clamping,
        AntiWindup::BackCalculation { tracking_time_s: 1e-3 },
    ] {
        let mut pid = Pid::new(
            &PidSettings {
                anti_windup: strategy,
                ..settings(0.0, 100.0, 0.0)
            },
            TICK_S,
        );
        pid.step(1e-6, 0.0, Applied::Fully);
        let stopped = pid.step(1e-6, 0.0, Applied::Cut { side: 1.0 });
        assert_eq!((stopped.integral_m, stopped.integration_stopped), (0.0, true));
        let free = pid.step(1e-6, 0.0, Applied::Cut { side: -1.0 });
        assert!(free.integral_m > 0.0 && !free.integration_stopped);
    }
}

/// Gains are refused one by one and together; the words name the field.
#[test]
fn gains_are_validated_as_a_whole() {
    type Case = (&'static str, fn(&mut PidSettings));
    let cases: [Case; 8] = [
        ("kp", |s| s.kp = -0.1),
        ("kp", |s| s.kp = f64::NAN),
        ("kp", |s| *s = settings(0.0, 0.0, 0.0)),
        ("ki_per_s", |s| s.ki_per_s = 1e6),
        ("derivative_filter_s", |s| (s.kd_s, s.derivative_filter_s) = (1e-4, 0.0)),
        ("output_limit_m", |s| s.output_limit_m = Some(0.0)),
        ("anti_windup.tracking_time_s", |s| {
            s.anti_windup = AntiWindup::BackCalculation { tracking_time_s: 1e-6 }
        }),
        ("anti_windup", |s| {
            s.ki_per_s = 0.0;
            s.anti_windup = AntiWindup::BackCalculation { tracking_time_s: 1e-2 };
        }),
    ];
    for (path, change) in cases {
        let mut changed = settings(0.2, 100.0, 0.0);
        change(&mut changed);
        let refusal = changed.validate(TICK_S).unwrap_err();
        assert_eq!(refusal.path, path, "{refusal}");
    }
}

/// Nyquist's answer agrees with what a simulated loop does, on both sides of the edge.
#[test]
fn stability_agrees_with_simulation() {
    let mut seen = [0, 0];
    for kp in [0.0, 0.3, 0.6, 0.9, 1.2, 1.6, 2.2, 3.0] {
        for ki_per_s in [0.0, 300.0, 1000.0, 2500.0, 4000.0, 6000.0] {
            for kd_s in [0.0, 1e-4, 3e-4] {
                if kp + ki_per_s + kd_s == 0.0 {
                    continue;
                }
                let gains = settings(kp, ki_per_s, kd_s);
                let shape = LoopShape::new(&rod(), Some(&gains), TICK_S);
                if shape.modulus_margin() < 0.01 {
                    continue;
                }
                let bounded = bounded(&gains);
                assert_eq!(
                    shape.is_stable(),
                    bounded,
                    "kp {kp}, ki {ki_per_s}, kd {kd_s}, margin {}",
                    shape.modulus_margin()
                );
                seen[usize::from(bounded)] += 1;
            }
        }
    }
    println!("{} unstable, {} stable", seen[0], seen[1]);
    assert!(seen[0] > 20 && seen[1] > 20);
}

/// Whether an initial displacement dies in the simulated linear loop.
fn bounded(gains: &PidSettings) -> bool {
    use anhyst_model::{RodState, TwoPolePropagator};
    let propagator = TwoPolePropagator::new(rod(), TICK_S).unwrap();
    let mut state = RodState {
        displacement_m: 1e-9,
        velocity_m_per_s: 0.0,
    };
    let mut pid = Pid::new(gains, TICK_S);
    let (mut demands, mut late) = ([0.0; 2], 0.0_f64);
    for tick in 0..20_000 {
        let u = pid.step(0.0, state.displacement_m, Applied::Fully).feedback_m;
        let [from, to] = demands.map(|p| p * rod().stiffness_per_s2);
        state = propagator.advance(state, from, to);
        demands = [demands[1], u];
        if state.displacement_m.abs() > 0.5 {
            return false;
        }
        if tick > 18_000 {
            late = late.max(state.displacement_m.abs());
        }
    }
    late < 1e-9
}
