//! Guards the drives: values of the development runs, continuity, and the form in files.

use super::*;

// Guards agreement with the development runs: fields read off their commanded column (4 s, 10 kHz), two or more of
// each part.
#[test]
fn the_fields_of_the_development_runs() {
    let standard = DriveSignal::standard(4.0);
    // The first rows of the staircase already have the step of their first tick behind them.
    let staircase = |time: f64| (time + 1e-4, 0.01);
    for ((time, tolerance), expected) in [
        ((0.0323, 0.01), 434.42),
        ((0.5754, 0.01), -8628.27),
        ((0.7908, 0.01), -6481.33),
        // The sweep's phase was summed row by row; at its first peaks that does not matter yet.
        ((0.9474, 0.3), 7200.0),
        ((1.1363, 5.0), 7200.0),
        (staircase(1.61), 9792.58),
        (staircase(1.65), 10644.74),
        (staircase(1.6998), 10644.78),
        ((2.02, 0.01), -4888.09),
        ((2.4024, 0.01), -200.02),
        ((2.4049, 0.01), 893.98),
        ((3.225, 0.01), -11700.0),
        ((3.9915, 0.01), -2500.77),
    ] {
        let found = standard.field_a_per_m(time);
        assert!(
            (found - expected).abs() <= tolerance,
            "{time} s: {found} A/m, not {expected} A/m"
        );
    }
    let tracking = DriveSignal::tracking();
    for (time, expected) in [(0.0059, 243.90), (0.2, 1168.26), (0.206, 8451.12), (0.211, -5888.71)] {
        let found = tracking.field_a_per_m(time);
        assert!(
            (found - expected).abs() <= 0.011,
            "{time} s: {found} A/m, not {expected} A/m"
        );
    }
}

// Guards other durations: the parts keep their shares, nothing jumps within a part, and after the end the field is
// held.
#[test]
fn parts_scale_with_the_duration() {
    for duration in [0.3, 5.0, 40.0] {
        let signal = DriveSignal::standard(duration);
        let part = duration / 5.0;
        let step = 1e-6;
        for index in 0..5 {
            for sample in 1..2000 {
                let time = part * (f64::from(index) + f64::from(sample) / 2000.5);
                let moved = signal.field_a_per_m(time + step) - signal.field_a_per_m(time);
                // The fastest is the multisine: at most 0.2 A·2π·622 Hz.
                assert!(
                    moved.abs() < 12e3 * 800.0 * step,
                    "{time} s of {duration} s: {moved} A/m"
                );
            }
        }
        assert_eq!(signal.field_a_per_m(duration + 1.0), signal.field_a_per_m(duration));
        assert_eq!(signal.field_a_per_m(0.0), 0.0);
    }
}

#[test]
fn simple_signals() {
    let triangle = DriveSignal::Triangle {
        amplitude_a_per_m: 8.0,
        period_s: 2.0,
    };
    let found = [0.0, 0.25, 0.5, 1.0, 1.5, 1.75, 2.0].map(|time| triangle.field_a_per_m(time));
    assert_eq!(found, [0.0, 4.0, 8.0, 0.0, -8.0, -4.0, 0.0]);
    let ramp = DriveSignal::Ramp {
        from_a_per_m: 1.0,
        to_a_per_m: 3.0,
        duration_s: 4.0,
    };
    assert_eq!([-1.0, 2.0, 9.0].map(|time| ramp.field_a_per_m(time)), [1.0, 2.0, 3.0]);
    let sine = DriveSignal::Sine {
        amplitude_a_per_m: 2.0,
        frequency_hz: 0.25,
        offset_a_per_m: 1.0,
        rise_s: 2.0,
    };
    assert_eq!([1.0, 5.0].map(|time| sine.field_a_per_m(time)), [1.5, 3.0]);
    assert!(sine.validate().is_ok() && DriveSignal::standard(0.0).validate().is_err());
}

// Guards the form in files: a variant with its fields by name, unknown ones refused.
#[test]
fn signals_are_stored_and_read_back() {
    let text = serde_json::to_string(&DriveSignal::standard(5.0)).expect("stored");
    assert_eq!(
        serde_json::from_str::<DriveSignal>(&text).expect("read"),
        DriveSignal::standard(5.0)
    );
    assert!(serde_json::from_str::<DriveSignal>(&text.replace("duration_s", "duration")).is_err());
}

// Guards the probing drives: where they begin, what they reach, and that a sweep of one frequency is a sine.
#[test]
fn probing_signals() {
    let stairs = DriveSignal::Staircase {
        amplitude_a_per_m: 4.0,
        steps: 2,
        hold_s: 1.0,
    };
    let found: Vec<f64> = (0..9).map(|k| stairs.field_a_per_m(f64::from(k) + 0.5)).collect();
    assert_eq!(found, [0.0, 2.0, 4.0, 2.0, 0.0, -2.0, -4.0, -2.0, 0.0]);
    let sweep = |from_hz, to_hz| DriveSignal::Sweep {
        amplitude_a_per_m: 1.0,
        from_hz,
        to_hz,
        duration_s: 2.0,
    };
    for time in [0.0, 0.3, 1.7, 2.0] {
        let plain = libm::sin(2.0 * std::f64::consts::PI * 5.0 * time);
        assert!((sweep(5.0, 5.0).field_a_per_m(time) - plain).abs() < 1e-12);
        assert!((sweep(5.0, 5.000001).field_a_per_m(time) - plain).abs() < 1e-4);
    }
    // The frequency at the end is the last one: the phase grows by 2π·80 Hz there.
    let (before, after) = (1.9999, 2.0);
    let slope = (sweep(5.0, 80.0).field_a_per_m(after) - sweep(5.0, 80.0).field_a_per_m(before)) / (after - before);
    assert!(slope.abs() <= 2.0 * std::f64::consts::PI * 80.0);
    let growing = DriveSignal::Growing {
        amplitude_a_per_m: 2.0,
        frequency_hz: 0.25,
        duration_s: 4.0,
    };
    assert_eq!(growing.field_a_per_m(1.0), 0.5);
    assert!(sweep(0.0, 5.0).validate().is_err() && sweep(1.0, 5.0).validate().is_ok());
}
