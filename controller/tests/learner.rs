//! Guards the learner: what repeats dies, at any speed of the spindle and across changes of it, where the way is not the believed one; and
//! what cannot be learned from changes nothing.

mod common;

use anhyst_controller::{
    Controller, ControllerSettings, LearningSettings, PidSettings, SpeedChange, TrajectorySettings,
};
use anhyst_ipc::{Block, Demand};
use anhyst_model::Material;
use common::{Rig, TICK_S, largest, rms, settings};
use std::f64::consts::TAU;

fn profile(spindle_rpm: f64, speed_changes: Vec<SpeedChange>) -> TrajectorySettings {
    TrajectorySettings::Profile {
        spindle_rpm,
        mean_m: 0.0,
        lobes: vec![(1, 40e-6, 0.0), (3, 12e-6, 0.3)],
        speed_changes,
    }
}

fn learning(trajectory: TrajectorySettings) -> ControllerSettings {
    let pid = PidSettings {
        ease_in_s: 0.0,
        ..ron::from_str("(kp: 0.3, ki_per_s: 2000)").unwrap()
    };
    ControllerSettings {
        feedback: Some(pid),
        learning: Some(LearningSettings::default()),
        start_s: 0.02,
        ..settings(trajectory)
    }
}

/// Errors at every tick, under a force (N) of the turns and what is done to the demand on the way.
fn errors(settings: &ControllerSettings, duration_s: f64, force: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut rig = Rig::new(settings);
    let trajectory = rig.controller.trajectory().clone();
    let force_n = |tick: u64| force(TAU * trajectory.turns(tick as f64 * TICK_S).unwrap());
    let ticks = 0..(duration_s / TICK_S) as u64;
    ticks
        .map(|tick| rig.step((force_n(tick), force_n(tick + 1))).0.error_m)
        .collect()
}

/// Tooth passing at four a turn, with two harmonics.
fn heavy(angle: f64) -> f64 {
    200.0 * (4.0 * angle).sin() + 100.0 * (8.0 * angle).sin() + 50.0 * (12.0 * angle).cos()
}

fn between(errors: &[f64], from_s: f64, to_s: f64) -> &[f64] {
    &errors[(from_s / TICK_S) as usize..(to_s / TICK_S) as usize]
}

/// Whether a turn is a whole number of ticks or not.
#[test]
fn what_repeats_dies_at_any_speed() {
    for rpm in [3000.0, 2973.1, 1417.0, 9_345.0] {
        let settings = learning(profile(rpm, Vec::new()));
        let none = ControllerSettings {
            learning: None,
            ..settings.clone()
        };
        let (without, with) = (errors(&none, 1.0, heavy), errors(&settings, 1.0, heavy));
        let (without, with) = (between(&without, 0.8, 1.0), between(&with, 0.8, 1.0));
        println!("{rpm} rpm: {:.3e} m without, {:.3e} m with", rms(without), rms(with));
        assert!(
            rms(with) < 1e-3 * rms(without),
            "{rpm} rpm: {:e} of {:e} m",
            rms(with),
            rms(without)
        );
    }
}

/// Angle, not time: through a change of speed the amplitudes stay, and the way back is short; what was learnt at a speed holds when it returns.
#[test]
fn a_change_of_speed_is_taken_along() {
    let change = |at_s: f64, rpm: f64| SpeedChange {
        at_s,
        rpm,
        over_s: 0.05,
    };
    let settings = learning(profile(3000.0, vec![change(1.0, 3700.0), change(2.0, 3000.0)]));
    let none = ControllerSettings {
        learning: None,
        ..settings.clone()
    };
    let (without, with) = (errors(&none, 3.0, heavy), errors(&settings, 3.0, heavy));
    let of = |from_s: f64, to_s: f64| rms(between(&with, from_s, to_s)) / rms(between(&without, from_s, to_s));
    println!(
        "before {:.5}, during {:.3}, 0.3 s after {:.5}; back {:.3}, 0.3 s after {:.5}",
        of(0.8, 1.0),
        of(1.0, 1.1),
        of(1.35, 1.5),
        of(2.0, 2.1),
        of(2.35, 2.5)
    );
    assert!(of(0.8, 1.0) < 1e-3 && of(1.35, 1.5) < 0.03 && of(2.35, 2.5) < 3e-3);
    let peak =
        |from_s: f64| largest(between(&with, from_s, from_s + 0.3)) / largest(between(&without, from_s, from_s + 0.3));
    assert!(peak(1.0) <= 1.0 && peak(2.0) <= 1.0, "{}, {}", peak(1.0), peak(2.0));
}

/// A load that comes on in the middle is learned as well, and nothing is taken back for it.
#[test]
fn a_step_of_the_load_is_learned() {
    let settings = learning(profile(3000.0, Vec::new()));
    let steps = |angle: f64| {
        if angle > TAU * 50.0 {
            heavy(angle)
        } else {
            0.1 * heavy(angle)
        }
    };
    let errors = errors(&settings, 1.6, steps);
    let [before, at, after] =
        [(0.9, 1.0), (1.0, 1.04), (1.3, 1.5)].map(|(from_s, to_s)| rms(between(&errors, from_s, to_s)));
    println!("{before:.3e} m, then {at:.3e} m, 0.3 s later {after:.3e} m");
    assert!(after < 0.01 * at, "{after:e} of {at:e} m");
}

/// While the demand meets a limit, and while no measurement comes, nothing moves.
#[test]
fn what_says_nothing_teaches_nothing() {
    let settings = learning(profile(3000.0, Vec::new()));
    let mut rig = Rig::new(&settings);
    let mut errors = Vec::new();
    for tick in 0..40_000_u64 {
        // A limit that the motion meets twice a turn, for half a second.
        rig.limit_a_per_m = if (16_000..26_000).contains(&tick) {
            1.5e5
        } else {
            f64::INFINITY
        };
        errors.push(rig.step((0.0, 0.0)).0.error_m);
    }
    let (before, during, after) = (
        rms(between(&errors, 0.6, 0.8)),
        rms(between(&errors, 1.0, 1.3)),
        rms(between(&errors, 1.4, 1.6)),
    );
    println!("{before:.3e} m, limited {during:.3e} m, after {after:.3e} m");
    assert!(during > 1e3 * before, "the limit is not met: {during:e} m");
    assert!(
        after < 2.0 * before.max(1e-12),
        "{after:e} m after, {before:e} m before"
    );
}

/// A loop whose sensor is suddenly turned round under the learner: taken back, said, and never larger than without learner for long.
#[test]
fn what_grows_is_taken_back_and_said() {
    let mut settings = learning(profile(3000.0, Vec::new()));
    settings.feedback = None;
    let course = |settings: &ControllerSettings| {
        let mut rig = Rig::new(settings);
        let (mut errors, mut said) = (Vec::new(), 0);
        for tick in 0..60_000_u64 {
            let angle = TAU * 50.0 * tick as f64 * TICK_S;
            if tick == 20_000 {
                rig.reverse();
            }
            let (demand, _) = rig.step((heavy(angle), heavy(angle + TAU * 50.0 * TICK_S)));
            said += u64::from(demand.status & Demand::TAKEN_BACK != 0);
            errors.push(demand.error_m);
        }
        (errors, said)
    };
    let (with, said) = course(&settings);
    settings.learning = None;
    let (without, never) = course(&settings);
    let (with, without) = (between(&with, 2.0, 3.0), between(&without, 2.0, 3.0));
    println!(
        "{said} ticks taken back; {:.3e} m without, {:.3e} m with",
        rms(without),
        rms(with)
    );
    assert!(said > 0 && never == 0);
    assert!(rms(with) <= 1.3 * rms(without));
}

/// Amplitudes so bounded that nothing helps: the learner rests and says so, and a load that comes on wakes it.
#[test]
fn a_rest_ends_when_the_load_grows() {
    let mut settings = learning(profile(3000.0, Vec::new()));
    settings.learning = Some(ron::from_str("(limit_m: Some(1e-12))").unwrap());
    let mut rig = Rig::new(&settings);
    let force_n = |tick: u64| {
        let size = if tick < 40_000 { 0.2 } else { 1.0 };
        size * heavy(TAU * 50.0 * tick as f64 * TICK_S)
    };
    let said: Vec<bool> = (0..44_000)
        .map(|tick| rig.step((force_n(tick), force_n(tick + 1))).0.status & Demand::TAKEN_BACK != 0)
        .collect();
    assert!(said[39_000..40_000].iter().all(|own| *own), "it does not rest");
    assert!(!said[43_999], "it sleeps on");
}

#[test]
fn what_does_not_repeat_is_refused() {
    for trajectory in [
        TrajectorySettings::Rest,
        TrajectorySettings::SmoothRamps {
            points: vec![(0.0, 0.0), (1.0, 1e-5)],
        },
    ] {
        let refused = Controller::new(
            &learning(trajectory),
            common::rod(),
            &Material::terfenol_d(),
            TICK_S,
            std::path::Path::new("."),
        );
        assert_eq!(refused.unwrap_err().path, "learning");
    }
    for (settings, path) in [
        ("(harmonics: 0)", "harmonics"),
        ("(gain: 1.5)", "gain"),
        ("(limit_m: Some(0))", "limit_m"),
    ] {
        let settings: LearningSettings = ron::from_str(settings).unwrap();
        assert_eq!(settings.validate().unwrap_err().path, path);
    }
}

/// From run to run: the next begins where the last ended; on a rig that is not what it was, what was learned is taken back.
#[test]
fn the_next_run_begins_with_what_this_one_learned() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("learned.json");
    let course = |settings: &ControllerSettings, sign: f64, ticks: u64| {
        let mut rig = Rig::new(settings);
        let force_n = |tick: u64| sign * heavy(TAU * 50.0 * tick as f64 * TICK_S);
        let errors: Vec<f64> = (0..ticks)
            .map(|tick| rig.step((force_n(tick), force_n(tick + 1))).0.error_m)
            .collect();
        (errors, rig.controller.memory())
    };
    let first = learning(profile(3000.0, Vec::new()));
    let (errors, memory) = course(&first, 1.0, 30_000);
    std::fs::write(&path, memory.unwrap()).unwrap();
    let mut next = first.clone();
    next.learning.as_mut().unwrap().from = Some(path.clone());
    let (again, _) = course(&next, 1.0, 30_000);
    let early = |errors: &[f64]| rms(between(errors, 0.05, 0.1));
    println!(
        "{:.3e} m at first, {:.3e} m in the next run",
        early(&errors),
        early(&again)
    );
    assert!(early(&again) < 0.05 * early(&errors));
    let (other, _) = course(&next, -1.0, 60_000);
    let last = |errors: &[f64]| rms(&errors[errors.len() - 4000..]);
    println!("with the load turned round: {:.3e} m at the end", last(&other));
    assert!(last(&other) < 0.01 * early(&errors));
    // More harmonics than were learned, and fewer; a speed at which most are too fast to be learned.
    for harmonics in [5, 80] {
        next.learning.as_mut().unwrap().harmonics = harmonics;
        let (own, _) = course(&next, 1.0, 30_000);
        assert!(own.iter().all(|error_m| error_m.is_finite()), "{harmonics} harmonics");
        assert!(
            harmonics < 12 || last(&own) < 0.01 * early(&errors),
            "{harmonics} harmonics: {:e} m",
            last(&own)
        );
    }
    next.learning.as_mut().unwrap().harmonics = 40;
    let slower = SpeedChange {
        at_s: 0.5,
        rpm: 1500.0,
        over_s: 0.1,
    };
    let turning = ControllerSettings {
        trajectory: profile(6000.0, vec![slower]),
        ..first
    };
    let (_, memory) = course(&turning, 1.0, 40_000);
    std::fs::write(&path, memory.unwrap()).unwrap();
    let (fast, _) = course(
        &ControllerSettings {
            learning: next.learning.clone(),
            ..turning
        },
        1.0,
        40_000,
    );
    assert!(fast.iter().all(|error_m| error_m.is_finite()));
    // Files that are none of a run's.
    let refusal = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Controller::new(&next, common::rod(), &Material::terfenol_d(), TICK_S, root.path())
            .unwrap_err()
            .to_string()
    };
    assert!(refusal("{").contains("is not what a run has learned"));
    let broken = r#"{"noise_m":0.0,"scatter_m":0.0,"base_m":-1.0,"speeds":[]}"#;
    assert!(refusal(broken).contains("numbers in it that no run learns"));
    std::fs::remove_file(&path).unwrap();
    let absent = Controller::new(&next, common::rod(), &Material::terfenol_d(), TICK_S, root.path());
    assert!(absent.unwrap_err().to_string().starts_with("learning.from: "));
}
