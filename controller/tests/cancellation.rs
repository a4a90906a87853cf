//! Guards the cancellation of known disturbances: its rate is the stated one, its phase is right up to the rod's resonance and
//! beyond, alone and around a PID.

mod common;

use anhyst_controller::{AntiWindup, CancellationSettings, DerivativeOn, PidSettings, TrajectorySettings};
use common::{Rig, TICK_S, largest, rms, settings, two_tones};
use std::f64::consts::TAU;

fn pid() -> PidSettings {
    PidSettings {
        kp: 0.3,
        ki_per_s: 400.0,
        kd_s: 0.0,
        derivative_filter_s: 0.0,
        derivative_on: DerivativeOn::Measurement,
        output_limit_m: Some(20e-6),
        anti_windup: AntiWindup::Clamping,
        ease_in_s: 0.01,
    }
}

/// Errors at every tick under a force Σ amplitude (N)·sin at the given frequencies (Hz).
fn errors(
    feedback: Option<PidSettings>,
    cancellation: Option<CancellationSettings>,
    trajectory: TrajectorySettings,
    force: &[(f64, f64)],
    duration_s: f64,
) -> Vec<f64> {
    let mut settings = settings(trajectory);
    settings.start_s = 0.02;
    settings.feedback = feedback;
    settings.cancellation = cancellation;
    let mut rig = Rig::new(&settings);
    let force_n = |tick: u64| {
        let time_s = tick as f64 * TICK_S;
        force
            .iter()
            .map(|(amplitude_n, frequency_hz)| amplitude_n * (TAU * frequency_hz * time_s).sin())
            .sum::<f64>()
    };
    (0..(duration_s / TICK_S) as u64)
        .map(|tick| rig.step((force_n(tick), force_n(tick + 1))).0.error_m)
        .collect()
}

fn last(errors: &[f64], duration_s: f64) -> &[f64] {
    &errors[errors.len() - (duration_s / TICK_S) as usize..]
}

/// With any PID and at any frequency the error's component dies as exp(−κt): the phase of rod, hold and delay is compensated.
#[test]
fn error_dies_at_the_stated_rate() {
    for feedback in [None, Some(pid())] {
        for frequency_hz in [80.0, 400.0, 1200.0, 2500.0] {
            let rate_per_s = 20.0;
            let known = CancellationSettings {
                frequencies_hz: vec![frequency_hz],
                rate_per_s,
            };
            let force = [(50.0, frequency_hz)];
            let errors = errors(feedback.clone(), Some(known), TrajectorySettings::Rest, &force, 0.3);
            let ticks = (0.05 / TICK_S) as usize;
            let (early, late) = (rms(&errors[ticks..2 * ticks]), rms(&errors[3 * ticks..4 * ticks]));
            let rate = (early / late).ln() / 0.1;
            println!(
                "{frequency_hz} Hz, PID {}: {rate:.2} 1/s, stated {rate_per_s} 1/s",
                feedback.is_some()
            );
            assert!((rate / rate_per_s - 1.0).abs() < 0.15, "{frequency_hz} Hz: {rate} 1/s");
        }
    }
}

/// A heavy cut, tooth passing at 200 Hz with two harmonics, on a moving profile: what is left of the error.
#[test]
fn heavy_cut_with_and_without() {
    let force = [(200.0, 200.0), (100.0, 400.0), (50.0, 600.0)];
    let known = CancellationSettings {
        frequencies_hz: vec![200.0, 400.0, 600.0],
        rate_per_s: 60.0,
    };
    let without = errors(Some(pid()), None, two_tones(), &force, 1.0);
    let with = errors(Some(pid()), Some(known), two_tones(), &force, 1.0);
    let (without, with) = (last(&without, 0.2), last(&with, 0.2));
    println!(
        "PID alone:         {:.3e} m rms, {:.3e} m max",
        rms(without),
        largest(without)
    );
    println!(
        "with cancellation: {:.3e} m rms, {:.3e} m max",
        rms(with),
        largest(with)
    );
    assert!(rms(with) < 1e-3 * rms(without));
}

/// The fastest permitted rate is stable, around a PID too.
#[test]
fn fastest_permitted_rate_is_stable() {
    for feedback in [None, Some(pid())] {
        let known = CancellationSettings {
            frequencies_hz: vec![50.0, 100.0, 150.0],
            rate_per_s: 31.0,
        };
        known.validate(TICK_S).unwrap();
        let force = [(50.0, 50.0), (50.0, 100.0), (50.0, 150.0)];
        let errors = errors(feedback, Some(known), TrajectorySettings::Rest, &force, 1.0);
        assert!(
            largest(last(&errors, 0.1)) < 1e-9,
            "{:e} m",
            largest(last(&errors, 0.1))
        );
    }
}

/// Rates that averaging cannot carry, and frequencies that are the same twice, are refused.
#[test]
fn rates_and_frequencies_are_validated_together() {
    let refused = |frequencies_hz: Vec<f64>, rate_per_s| {
        CancellationSettings {
            frequencies_hz,
            rate_per_s,
        }
        .validate(TICK_S)
        .unwrap_err()
        .path
    };
    assert_eq!(refused(vec![50.0], 100.0), "rate_per_s");
    assert_eq!(refused(vec![50.0, 50.0], 1.0), "rate_per_s");
    assert_eq!(refused(vec![50.0, 9000.0], 1.0), "frequencies_hz.1");
    assert_eq!(refused(vec![-50.0], 1.0), "frequencies_hz.0");
}
