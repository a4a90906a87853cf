//! Guards changes while it runs: none of them makes the demand jump, each has its full effect at the end, all are data.

mod common;

use anhyst_controller::{Controller, ControllerSettings, LearningSettings, PidSettings, change_over_s};
use anhyst_ipc::{Block, Change, Demand, FieldCommand, Measurement, Now, Previous, SafeField, Tunable};
use common::{Rig, TICK_S, controller, settings, two_tones};

const TICK: u64 = 4000;

fn pid(kp: f64, ki_per_s: f64) -> PidSettings {
    PidSettings {
        kp,
        ki_per_s,
        ..PidSettings::default()
    }
}

fn with_feedback(kp: f64, ki_per_s: f64) -> ControllerSettings {
    ControllerSettings {
        feedforward: false,
        feedback: Some(pid(kp, ki_per_s)),
        ..settings(two_tones())
    }
}

fn change(tick: u64, set: Tunable, value: f64) -> Change {
    Change { tick, set, value }
}

/// What a controller demands of measurements that follow no loop: 1 µm beside its reference.
fn open_loop(mut controller: Controller, ticks: u64) -> Vec<Demand> {
    let beside = |controller: &Controller, tick: u64| Measurement {
        displacement_m: controller.trajectory().at(tick as f64 * TICK_S).position_m - 1e-6,
        ..Measurement::default()
    };
    (0..ticks)
        .map(|tick| {
            let measured = Now(beside(&controller, tick));
            let quiet = (Previous(SafeField::default()), Previous(FieldCommand::default()));
            let (demand,) = controller.step(tick, (measured, quiet.0, quiet.1));
            demand
        })
        .collect()
}

/// A P controller with a constant error of 1 µm asks for kp·e alone, so what it asks for shows the gain: as the blend goes, steepest 2.46
/// in the middle, never in a jump, and the new one to the bit in the end.
#[test]
fn a_gain_goes_over_without_a_jump() {
    let over = (change_over_s(TICK_S) / TICK_S).round() as u64;
    let ticks = TICK + over + 10;
    let tuned = |to: f64| {
        let mut own = controller(&with_feedback(0.2, 0.0));
        assert!(own.change(&change(TICK, Tunable::Kp, to)));
        open_loop(own, ticks)
    };
    let stated = |kp: f64| open_loop(controller(&with_feedback(kp, 0.0)), ticks);
    let (before, after, moved) = (stated(0.2), stated(0.5), tuned(0.5));
    let asked = |demands: &[Demand], tick: u64| demands[tick as usize].magnetization_a_per_m;
    let whole = (asked(&after, ticks - 1) - asked(&before, ticks - 1)).abs();
    let mut steepest = 0.0_f64;
    for tick in 1..ticks {
        let step = asked(&moved, tick) - asked(&moved, tick - 1);
        steepest = steepest.max(step.abs());
        let changing = moved[tick as usize].status & Demand::CHANGING != 0;
        assert_eq!(changing, (TICK..TICK + over + 2).contains(&tick), "tick {tick}");
    }
    assert!(steepest < 2.47 * whole / over as f64, "{steepest:e} of {whole:e}");
    assert!(steepest > 2.45 * whole / over as f64, "{steepest:e} of {whole:e}");
    assert_eq!(asked(&moved, TICK), asked(&before, TICK));
    assert_eq!(asked(&moved, ticks - 1).to_bits(), asked(&after, ticks - 1).to_bits());
}

/// Feedback alone, whose error is large, all gains at once: the demand moves from tick to tick no more than it does with the old gains or
/// the new ones.
#[test]
fn a_loop_that_is_tuned_is_not_shaken() {
    let run = |(kp, ki_per_s): (f64, f64), changes: &[Change]| {
        let mut rig = Rig::new(&with_feedback(kp, ki_per_s));
        changes.iter().for_each(|change| assert!(rig.controller.change(change)));
        let demands: Vec<f64> = (0..12_000)
            .map(|_| rig.step((0.0, 0.0)).0.magnetization_a_per_m)
            .collect();
        let steps = demands[3000..].windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.fold(0.0, f64::max)
    };
    let gains = [
        change(TICK, Tunable::Kp, 0.4),
        change(TICK, Tunable::KiPerS, 300.0),
        change(TICK + 4000, Tunable::Kp, 0.1),
        change(TICK + 4000, Tunable::KiPerS, 1200.0),
    ];
    let stated = [(0.1, 1200.0), (0.4, 300.0)];
    let quiet = stated.map(|gains| run(gains, &[])).into_iter().fold(0.0, f64::max);
    let tuned = run(stated[0], &gains);
    assert!(tuned < 1.02 * quiet, "{tuned:e} of {quiet:e}");
}

/// The smooth step as Bernstein's polynomials have it: Σ C(9, j)·s^j·(1 − s)^(9−j) from j = 5 on.
fn smooth_step(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    let terms = [(5, 126.0), (6, 84.0), (7, 36.0), (8, 9.0), (9, 1.0)];
    terms
        .iter()
        .map(|(j, count)| count * s.powi(*j) * (1.0 - s).powi(9 - j))
        .sum()
}

/// r = A·r₀ from two ticks after the change, with all derivatives of a product; a second change begins where the first is.
#[test]
fn the_amplitude_goes_the_way_of_its_blend() {
    let mut own = controller(&settings(two_tones()));
    let (first, second) = (TICK, TICK + 700);
    assert!(own.change(&change(first, Tunable::Amplitude, 0.25)));
    assert!(own.change(&change(second, Tunable::Amplitude, 1.5)));
    let stated = controller(&settings(two_tones()));
    let over_s = change_over_s(TICK_S);
    let amplitude = |time_s: f64| {
        let part = |tick: u64| smooth_step((time_s - (tick as f64 + 2.0) * TICK_S) / over_s);
        let one = 1.0 + (0.25 - 1.0) * part(first);
        one + (1.5 - one) * part(second)
    };
    for tick in 0..TICK + 4000 {
        let time_s = tick as f64 * TICK_S;
        let found = own.trajectory().at(time_s);
        let expected = amplitude(time_s) * stated.trajectory().at(time_s).position_m;
        assert!(
            (found.position_m - expected).abs() < 1e-15,
            "tick {tick}: {found:?} against {expected:e}"
        );
        // Each derivative is the central difference of the one before it.
        let h = 1e-7;
        let (later, earlier) = (own.trajectory().at(time_s + h), own.trajectory().at(time_s - h));
        let slope = |of: fn(&anhyst_controller::Motion) -> f64| (of(&later) - of(&earlier)) / (2.0 * h);
        assert!((slope(|own| own.position_m) - found.velocity_m_per_s).abs() < 1e-6);
        assert!((slope(|own| own.velocity_m_per_s) - found.acceleration_m_per_s2).abs() < 1e-3);
        assert!((slope(|own| own.acceleration_m_per_s2) - found.jerk_m_per_s3).abs() < 2.0);
        assert!((slope(|own| own.jerk_m_per_s3) - found.snap_m_per_s4).abs() < 3e3);
    }
    // What was decided before is as it was, to the bit; in the end the factor is the stated one.
    let at = |own: &Controller, tick: u64| own.trajectory().at(tick as f64 * TICK_S).position_m;
    assert_eq!(at(&own, TICK + 2).to_bits(), at(&stated, TICK + 2).to_bits());
    assert_eq!(at(&own, TICK + 4000), 1.5 * at(&stated, TICK + 4000));
}

/// A learner that is switched off adds nothing any more, and on again adds what it had: held meanwhile, not forgotten.
#[test]
fn a_learner_is_faded_out_and_holds() {
    let mut rig = Rig::new(&ControllerSettings {
        start_s: 0.05,
        feedback: Some(pid(0.2, 800.0)),
        learning: Some(LearningSettings::default()),
        ..settings(two_tones())
    });
    let (off, on) = (20_000, 30_000);
    assert!(rig.controller.change(&change(off, Tunable::Learning, 0.0)));
    assert!(rig.controller.change(&change(on, Tunable::Learning, 1.0)));
    // A load that repeats with the reference, and that no feedforward knows.
    let load = |tick: u64| 30.0 * (std::f64::consts::TAU * 50.0 * tick as f64 * TICK_S).sin();
    let mut errors = Vec::new();
    let mut learning = Vec::new();
    for tick in 0..36_000 {
        let (demand, _) = rig.step((load(tick), load(tick + 1)));
        errors.push(demand.error_m.abs());
        learning.push(demand.status & Demand::LEARNING != 0);
    }
    let worst = |from: usize, to: usize| errors[from..to].iter().copied().fold(0.0, f64::max);
    let (with, without, again) = (worst(18_000, 20_000), worst(26_000, 30_000), worst(32_500, 33_500));
    assert!(without > 10.0 * with, "{with:e} with, {without:e} without");
    assert!(again < 2.0 * with, "{with:e} with, {again:e} again");
    assert!(learning[19_999] && !learning[25_000] && learning[33_000]);
}

/// One that has its changes from the beginning and one that is given them in their ticks say the same, to the bit; what it does not
/// have it does not take.
#[test]
fn a_change_is_data() {
    let changes = [
        change(1000, Tunable::Kp, 0.4),
        change(1500, Tunable::Amplitude, 0.5),
        change(1500, Tunable::KiPerS, 900.0),
    ];
    let run = |early: bool| {
        let mut rig = Rig::new(&with_feedback(0.2, 800.0));
        if early {
            changes.iter().for_each(|change| assert!(rig.controller.change(change)));
        }
        let mut bits = Vec::new();
        for tick in 0..6000 {
            let due = changes.iter().filter(|change| !early && change.tick == tick);
            due.for_each(|change| assert!(Block::change(&mut rig.controller, change)));
            bits.push(rig.step((0.0, 0.0)).0.magnetization_a_per_m.to_bits());
        }
        bits
    };
    assert_eq!(run(true), run(false));
    let mut bare = controller(&settings(two_tones()));
    for set in [
        Tunable::Kp,
        Tunable::Learning,
        Tunable::LearningGain,
        Tunable::Tolerance,
    ] {
        assert!(!bare.change(&change(0, set, 0.5)), "{set}");
    }
}
