//! Guards the margins against a loop whose margins are known in closed form, and against a sum of its own.

mod common;

use anhyst_controller::{AntiWindup, DerivativeOn, LoopShape, MeasuredResponse, PidSettings};
use anhyst_model::TwoPole;
use common::TICK_S;
use std::f64::consts::PI;

fn integrating(ki_per_s: f64) -> LoopShape {
    let pid = PidSettings {
        kp: 0.0,
        ki_per_s,
        kd_s: 0.0,
        derivative_filter_s: 0.0,
        derivative_on: DerivativeOn::Measurement,
        output_limit_m: None,
        anti_windup: AntiWindup::Clamping,
        ease_in_s: 0.0,
    };
    // So stiff that it only holds: P = sinc²(ωT/2).
    let rod = TwoPole {
        damping_per_s: 0.0,
        stiffness_per_s2: 1e20,
        ..common::rod()
    };
    LoopShape::new(&rod, Some(&pid), TICK_S)
}

fn near(what: &str, found: f64, expected: f64, relative: f64) {
    assert!(
        (found - expected).abs() <= relative * expected.abs(),
        "{what}: {found} against {expected}"
    );
}

/// L = ki·T·sinc²(h)/(2 sin h)·e^{−j(π/2 + 3h)}, h = ωT/2: −π at h = π/6, where |L| = ki·T·(3/π)²; |L| = 1 where ki·T·sin h = 2h².
#[test]
fn an_integrator_behind_the_hold_has_the_margins_of_its_formula() {
    for h in [0.05_f64, 0.1, 0.2, 0.3] {
        let gain = 2.0 * h * h / h.sin();
        let margins = integrating(gain / TICK_S).margins();
        near("gain", margins.gain.unwrap(), (PI / 3.0).powi(2) / gain, 1e-6);
        let (phase_rad, omega) = (PI / 2.0 - 3.0 * h, 2.0 * h / TICK_S);
        near("phase", margins.phase_rad.unwrap(), phase_rad, 1e-4);
        near("delay", margins.delay_s.unwrap(), phase_rad / omega, 1e-4);
        near("crossover", margins.crossover_hz.unwrap(), omega / (2.0 * PI), 1e-4);
        // |1 + L|² = 1 + 2 Re L + |L|², on a grid of its own.
        let square = |h: f64| {
            let size = gain * (h.sin() / h).powi(2) / (2.0 * h.sin());
            1.0 - 2.0 * size * (3.0 * h).sin() + size * size
        };
        let grid = (1..100_000).map(|index| square(PI / 2.0 * f64::from(index) / 1e5));
        let least = grid.fold(1.0, f64::min).sqrt();
        near("Ms", margins.sensitivity.value, 1.0 / least, 1e-5);
        near(
            "modulus",
            integrating(gain / TICK_S).modulus_margin(),
            1.0 / margins.sensitivity.value,
            1e-12,
        );
        // Where |1 + L| = 1 first: |L| = 2 sin 3h.
        let helps = margins.rejects_below_hz.unwrap() * PI * TICK_S;
        near("S = 1", square(helps), 1.0, 2e-2);
    }
}

/// S + T = 1 by definition, so |S| and |T| cannot differ by more than 1; the phase goes on without a break.
#[test]
fn the_points_are_of_one_loop() {
    let points = integrating(2000.0).points(1.0, 400);
    assert_eq!(points.len(), 400);
    for pair in points.windows(2) {
        assert!((pair[0].phase_rad - pair[1].phase_rad).abs() < 0.5, "{pair:?}");
    }
    for own in &points {
        let half = PI * own.frequency_hz * TICK_S;
        near("phase", own.phase_rad, -(PI / 2.0 + 3.0 * half), 1e-6);
        assert!((own.sensitivity - own.complementary).abs() <= 1.0 + 1e-12, "{own:?}");
        near("T = L·S", own.complementary, own.open * own.sensitivity, 1e-12);
    }
}

/// Without feedback nothing can be too much, and nothing is made smaller.
#[test]
fn a_loop_without_feedback_has_no_margins() {
    let margins = LoopShape::new(&common::rod(), None, TICK_S).margins();
    assert_eq!((margins.gain, margins.phase_rad, margins.delay_s), (None, None, None));
    assert_eq!((margins.rejects_below_hz, margins.sensitivity.value), (None, 1.0));
}

/// Guards measured responses in the place of believed ones: of a loop that is a tick later than believed, told at forty frequencies, the
/// margins are those of the later loop, and what was measured as believed changes nothing.
#[test]
fn a_measured_response_takes_the_place_of_the_believed_one() {
    let believed = integrating(600.0);
    let later = integrating(600.0).with_amplifier_delay(1);
    let of = |shape: &LoopShape| -> Vec<MeasuredResponse> {
        let lines = (1..=40).map(|line| 200.0 * f64::from(line));
        let told = lines.map(|frequency_hz| {
            let (gain, phase_rad) = shape.believed_response(frequency_hz);
            MeasuredResponse {
                frequency_hz,
                gain,
                phase_rad,
            }
        });
        told.collect()
    };
    let measured = integrating(600.0).with_measured(&of(&later)).margins();
    for (found, expected) in [
        (measured, later.margins()),
        (
            integrating(600.0).with_measured(&of(&believed)).margins(),
            believed.margins(),
        ),
    ] {
        near("gain", found.gain.unwrap(), expected.gain.unwrap(), 1e-4);
        near("phase", found.phase_rad.unwrap(), expected.phase_rad.unwrap(), 1e-4);
        near("Ms", found.sensitivity.value, expected.sensitivity.value, 1e-4);
    }
}
