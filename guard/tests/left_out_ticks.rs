//! Guards the guard of a real-time loop, in which tokens are missing and ticks of its own are left out.

mod common;

use anhyst_guard::{Event, Guard, GuardSettings, Monitors, State};
use anhyst_ipc::{Block, FieldCommand, Measurement, Now, SafeField};
use common::TICK_S;

/// A tick in which the newest measurement is that of `measured_at`.
fn step(guard: &mut Guard, tick: u64, measured_at: u64, displacement_m: f64, field_a_per_m: f64) -> SafeField {
    let command = FieldCommand {
        tick,
        field_a_per_m,
        ..FieldCommand::default()
    };
    let measurement = Measurement {
        tick: measured_at,
        displacement_m,
        ..Measurement::default()
    };
    let (demand, estimate) = common::others(tick);
    let (safe,) = guard.step(tick, (Now(command), Now(measurement), demand, estimate));
    safe
}

/// A tip that moves by 4 of 5 µm a tick does not jump where measurements are missing or the guard was held up; what it cannot
/// have moved by in the ticks that have passed is a jump all the same.
#[test]
fn the_jump_limit_is_per_tick_whatever_is_missing() {
    const STEP_M: f64 = 4e-6;
    let jump = Event::DisplacementJump.number();
    let heard = |ticks: &[(u64, u64)], last_m: f64| {
        let mut guard = Guard::new(&common::settings(), TICK_S).unwrap();
        let (last, before) = ticks.split_last().unwrap();
        for (tick, measured_at) in before {
            let safe = step(&mut guard, *tick, *measured_at, STEP_M * *measured_at as f64, 0.0);
            assert_eq!(safe.event, 0, "tick {tick}");
        }
        step(&mut guard, last.0, last.1, last_m, 0.0).event
    };
    // Measurements 3 and 4 never come.
    let missing = [(0, 0), (1, 1), (2, 2), (3, 2), (4, 2), (5, 5)];
    assert_eq!(heard(&missing, 5.0 * STEP_M), 0);
    assert_eq!(heard(&missing, 2.0 * STEP_M + 15.1e-6), jump);
    // The guard itself leaves out ticks 3 to 5.
    let held_up = [(0, 0), (1, 1), (2, 2), (6, 6)];
    assert_eq!(heard(&held_up, 6.0 * STEP_M), 0);
    assert_eq!(heard(&held_up, 2.0 * STEP_M + 20.1e-6), jump);
    // Nothing is missing.
    assert_eq!(heard(&[(0, 0), (1, 1), (2, 2)], STEP_M + 5.1e-6), jump);
}

/// A planned reset happens in the first tick that is not left out, once, in whatever order the instants are given.
#[test]
fn a_reset_whose_tick_is_left_out_happens_later() {
    let settings = GuardSettings {
        monitors: Monitors {
            reset_at_s: vec![0.06, 0.03],
            ..Monitors::default()
        },
        ..common::settings()
    };
    let mut guard = Guard::new(&settings, TICK_S).unwrap();
    // A NaN at tick 100 leads to the safe field; the resets are planned for the ticks 600 and 1200.
    let mut rearmed = Vec::new();
    let left_out = |tick: u64| (595..605).contains(&tick);
    for tick in (0..2000).filter(|tick| !left_out(*tick)) {
        let broken = tick == 100 || tick == 1000;
        let displacement_m = if broken { f64::NAN } else { 1e-9 * (tick % 2) as f64 };
        let safe = step(&mut guard, tick, tick, displacement_m, 1000.0);
        if safe.event == Event::Rearmed.number() {
            rearmed.push(tick);
        }
        assert!(tick != 594 || guard.state() == State::Safe);
    }
    assert_eq!(rearmed, [605, 1200]);
    assert_eq!(guard.state(), State::Normal);
}
