//! Guards docs/safety.md: each monitor's event, reaction, ticks and way back, through the guard's messages.

mod common;

use anhyst_guard::{
    CurrentMonitor, EstimateMonitor, Event, Guard, GuardSettings, Monitors, Reaction, Rearm, Response, Responses,
    State, TrackingMonitor, WayBack,
};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, Measurement, Now, SafeField};
use common::TICK_S;

fn settings() -> GuardSettings {
    GuardSettings {
        slew_limit_a_per_m_s: None,
        monitors: Monitors {
            temperature_limit_k: Some(350.0),
            current: Some(CurrentMonitor {
                coil_constant_per_m: 10_000.0,
                limit_a: 1.5,
                trip_a: 1.6,
            }),
            tracking: Some(TrackingMonitor {
                error_limit_m: 1e-6,
                after_ticks: 10,
                settling_s: 0.001,
            }),
            estimate: Some(EstimateMonitor {
                range_a_per_m: (6000.0, 8000.0),
                uninformed_ticks: Some(50),
            }),
            deadline_misses: Some(2),
            ..Monitors::default()
        },
        ..common::settings()
    }
}

fn responding(event: Event, reaction: Reaction, way_back: WayBack) -> GuardSettings {
    GuardSettings {
        reactions: Responses([(event, Response { reaction, way_back })].into()),
        ..settings()
    }
}

#[derive(Clone, Copy, Default)]
struct Tokens {
    command: FieldCommand,
    measurement: Measurement,
    demand: Demand,
    estimate: Estimate,
}

struct Bench {
    guard: Guard,
    tick: u64,
    before_a_per_m: f64,
}

impl Bench {
    fn new(settings: &GuardSettings) -> Self {
        Self {
            guard: Guard::new(settings, TICK_S).unwrap(),
            tick: 0,
            before_a_per_m: 0.0,
        }
    }

    /// A tick of healthy tokens with a slowly moving command, changed by `fault`.
    fn step(&mut self, fault: impl Fn(&mut Tokens)) -> SafeField {
        let tick = self.tick;
        let mut tokens = Tokens::default();
        tokens.command.tick = tick;
        tokens.command.field_a_per_m = 8000.0 * (tick as f64 * 0.01).sin();
        tokens.measurement.tick = tick;
        tokens.measurement.displacement_m = 1e-9 * (tick % 2) as f64;
        tokens.measurement.temperature_k = 300.0;
        tokens.demand.tick = tick;
        tokens.estimate.tick = tick;
        tokens.estimate.shape_a_per_m = 7000.0;
        fault(&mut tokens);
        let inputs = (
            Now(tokens.command),
            Now(tokens.measurement),
            Now(tokens.demand),
            Now(tokens.estimate),
        );
        let (safe,) = self.guard.step(tick, inputs);
        self.tick += 1;
        assert!(safe.field_a_per_m.abs() <= 15_000.0, "the current's limit");
        safe
    }

    fn run(&mut self, ticks: u64, fault: impl Fn(&mut Tokens)) -> Vec<SafeField> {
        (0..ticks)
            .map(|_| {
                self.before_a_per_m = self.guard.field_a_per_m();
                self.step(&fault)
            })
            .collect()
    }
}

type Fault = (Event, fn(&mut Tokens));

const FAULTS: [Fault; 17] = [
    (Event::CommandNotFinite, |t| t.command.field_a_per_m = f64::NAN),
    (Event::MeasurementNotFinite, |t| {
        t.measurement.coil_field_a_per_m = f64::INFINITY
    }),
    (Event::CommandStale, |t| t.command.tick = 299),
    (Event::MeasurementStale, |t| t.measurement.tick = 299),
    (Event::DisplacementJump, |t| {
        t.measurement.displacement_m += 6e-6 * ((t.command.tick + 1) % 2) as f64
    }),
    (Event::DisplacementStuck, |t| t.measurement.displacement_m = 0.0),
    (Event::DemandNotFinite, |t| t.demand.integral_m = f64::NAN),
    (Event::DemandStale, |t| t.demand.tick = 299),
    (Event::EstimateNotFinite, |t| {
        t.estimate.magnetization_a_per_m = f64::NAN
    }),
    (Event::EstimateStale, |t| t.estimate.tick = 299),
    (Event::EstimateOutside, |t| t.estimate.shape_a_per_m = 8000.1),
    (Event::EstimateOutside, |t| t.estimate.shape_a_per_m = -7000.0),
    (Event::EstimateUninformed, |t| t.estimate.status = Estimate::HELD),
    (Event::TemperatureExceeded, |t| t.measurement.temperature_k = 350.1),
    (Event::CurrentExceeded, |t| t.measurement.coil_field_a_per_m = -16_001.0),
    (Event::TrackingLost, |t| t.demand.error_m = -1.1e-6),
    (Event::DeadlineMissed, |t| t.measurement.tick -= 1),
];

/// Every monitor: named, in the stated ticks, with the stated reaction; no event without a fault.
#[test]
fn every_monitor_names_its_fault_and_reacts_in_the_stated_ticks() {
    // Two misses would come before four ticks of age: that monitor is alone in its own case.
    for (event, fault) in FAULTS {
        let mut settings = settings();
        if event != Event::DeadlineMissed {
            settings.monitors.deadline_misses = None;
        }
        let mut bench = Bench::new(&settings);
        let healthy = bench.run(300, |_| {});
        assert!(
            healthy.iter().all(|safe| safe.event == 0 && safe.status == 0),
            "{event}"
        );
        let tokens = bench.run(600, fault);
        let detected = tokens
            .iter()
            .position(|safe| safe.event != 0)
            .unwrap_or_else(|| panic!("{event}")) as u64
            + 1;
        let first = tokens[detected as usize - 1];
        assert_eq!(Event::from_number(first.event), Some(event));
        let stated = settings.detection_ticks(event, TICK_S).unwrap();
        // From the frozen value on the field must also have moved far enough.
        let slack = if event == Event::DisplacementStuck { 20 } else { 0 };
        assert!(
            detected <= stated + slack && detected >= stated.min(2),
            "{event}: {detected} of {stated} ticks"
        );
        let bound = settings.reaction_ticks(event, TICK_S) as usize;
        let after = &tokens[detected as usize - 1 + bound - 1..];
        match settings.reactions.to(event).reaction {
            Reaction::RampToSafe => {
                assert!(first.status & (SafeField::RAMPING | SafeField::SAFE) != 0, "{event}");
                assert!(
                    after
                        .iter()
                        .all(|safe| safe.field_a_per_m == 0.0 && safe.status == SafeField::SAFE),
                    "{event}"
                );
            }
            Reaction::FallBack => assert!(
                after.iter().all(|safe| safe.status & SafeField::FALL_BACK != 0),
                "{event}"
            ),
            Reaction::Hold => unreachable!(),
        }
    }
}

/// The command of the tick in which the guard falls back still relies on the estimate: it is not used.
#[test]
fn falling_back_repeats_the_field_once_and_comes_back_by_itself() {
    let mut bench = Bench::new(&settings());
    bench.run(300, |_| {});
    let before = bench.guard.field_a_per_m();
    let first = bench.step(|t| t.estimate.shape_a_per_m = 9000.0);
    assert_eq!((first.field_a_per_m, first.status), (before, SafeField::FALL_BACK));
    let second = bench.step(|t| t.estimate.shape_a_per_m = 9000.0);
    assert!(second.field_a_per_m != before && second.status == SafeField::FALL_BACK && second.event == 0);
    assert_eq!(bench.guard.state(), State::Normal);
    let healthy = bench.run(2100, |_| {});
    let back = healthy.iter().position(|safe| safe.event != 0).unwrap();
    assert_eq!(Event::from_number(healthy[back].event), Some(Event::Resumed));
    assert_eq!(back as u64 + 1, (0.1_f64 / TICK_S).round() as u64);
    assert_eq!(healthy[back].status, 0);
}

/// Hold, then back by itself without a step; and on to the safe field if the cause lasts.
#[test]
fn a_hold_ends_in_a_walk_back_or_at_the_safe_field() {
    let health = WayBack::AfterHealth { for_s: 0.01 };
    let settings = responding(Event::DisplacementJump, Reaction::Hold, health);
    let jumps = |t: &mut Tokens| t.measurement.displacement_m += 1e-5 * ((t.command.tick + 1) % 2) as f64;
    let mut bench = Bench::new(&settings);
    bench.run(300, |_| {});
    let before = bench.guard.field_a_per_m();
    let held = bench.run(20, jumps);
    assert_eq!(Event::from_number(held[0].event), Some(Event::DisplacementJump));
    assert!(
        held.iter()
            .all(|safe| safe.field_a_per_m == before && safe.status == SafeField::HOLDING)
    );
    let mut last = before;
    let most = settings.ramp_slew_a_per_m_s() * TICK_S * (1.0 + 1e-12);
    let back = bench.run(600, |_| {});
    assert_eq!(
        back.iter().filter(|safe| safe.event == Event::Resumed.number()).count(),
        1
    );
    for safe in back {
        assert!(
            (safe.field_a_per_m - last).abs() <= most,
            "a step of {} A/m",
            safe.field_a_per_m - last
        );
        last = safe.field_a_per_m;
    }
    assert_eq!(bench.guard.state(), State::Normal);
    let held_too_long = bench.run(3000, jumps);
    let raised: Vec<_> = held_too_long
        .iter()
        .filter_map(|safe| Event::from_number(safe.event))
        .collect();
    assert_eq!(raised, [Event::DisplacementJump, Event::HoldTooLong]);
    assert_eq!((bench.guard.state(), bench.guard.field_a_per_m()), (State::Safe, 0.0));
}

/// From the safe field back by itself after the stated health, never while the cause lasts, and never by itself with `Reset`.
#[test]
fn the_safe_field_is_left_as_stated() {
    let health = WayBack::AfterHealth { for_s: 0.02 };
    let mut bench = Bench::new(&responding(Event::TemperatureExceeded, Reaction::RampToSafe, health));
    let hot = |t: &mut Tokens| t.measurement.temperature_k = 400.0;
    bench.run(300, |_| {});
    assert!(
        bench
            .run(2000, hot)
            .iter()
            .all(|safe| safe.event != Event::Resumed.number())
    );
    let back = bench.run(1000, |_| {});
    let resumed = back
        .iter()
        .position(|safe| safe.event == Event::Resumed.number())
        .unwrap() as u64
        + 1;
    assert_eq!(resumed, (0.02_f64 / TICK_S).round() as u64);
    assert_eq!(bench.guard.state(), State::Normal);
    // A second fault whose way back is a reset rules, also if it comes while the field is safe already.
    bench.run(500, hot);
    bench.run(1, |t| t.command.field_a_per_m = f64::NAN);
    bench.run(2000, |_| {});
    assert_eq!(bench.guard.state(), State::Safe);
    bench.guard.rearm().unwrap();
    bench.run(400, |_| {});
    assert_eq!(bench.guard.state(), State::Normal);
}

/// An operator's reset that the scenario plans: refused while the cause lasts, then bumpless.
#[test]
fn planned_resets_bring_it_back() {
    let mut settings = settings();
    settings.monitors.reset_at_s = vec![0.03, 0.06];
    let mut bench = Bench::new(&settings);
    bench.run(300, |_| {});
    let faulty = bench.run(700, |t| t.command.field_a_per_m = f64::NAN);
    assert!(faulty.iter().all(|safe| safe.event != Event::Rearmed.number()));
    assert_eq!(bench.guard.rearm(), Err(Rearm::StillFaulty(Event::CommandNotFinite)));
    let back = bench.run(1000, |_| {});
    assert_eq!(back[200].event, Event::Rearmed.number());
    assert_eq!(bench.guard.state(), State::Normal);
}

/// At the safe field the reference runs on: that is no tracking error, neither then nor while the loop settles again.
#[test]
fn tracking_is_judged_only_while_commands_are_followed() {
    let mut bench = Bench::new(&settings());
    bench.run(5, |t| t.demand.error_m = 1.0);
    bench.run(295, |_| {});
    bench.step(|t| t.command.field_a_per_m = f64::NAN);
    bench.run(500, |t| t.demand.error_m = 1.0);
    bench.guard.rearm().unwrap();
    // About 34 ticks of walking back and 20 of settling: the last few errors count, but are not ten in a row.
    bench.run(105, |t| {
        if t.command.tick < 860 {
            t.demand.error_m = 1.0
        }
    });
    bench.run(500, |_| {});
    assert_eq!(bench.guard.state(), State::Normal);
}

/// A rod at rest tells the estimator nothing: that must not keep the guard at the safe field for ever.
#[test]
fn an_uninformed_estimate_does_not_keep_the_field_safe() {
    let health = WayBack::AfterHealth { for_s: 0.02 };
    let mut bench = Bench::new(&responding(Event::MeasurementNotFinite, Reaction::RampToSafe, health));
    bench.run(300, |_| {});
    bench.step(|t| t.measurement.displacement_m = f64::NAN);
    bench.run(1000, |t| t.estimate.status = Estimate::HELD);
    assert_eq!((bench.guard.state(), bench.guard.fallen_back()), (State::Normal, true));
    bench.run(2100, |_| {});
    assert!(!bench.guard.fallen_back());
}

/// A late measurement tells the estimator nothing either, but says nothing of the motion: such ticks neither count nor end a
/// row of uninformed ones.
#[test]
fn late_measurements_are_not_uninformed() {
    let mut bench = Bench::new(&settings());
    let unmeasured = Estimate::HELD | Estimate::UNMEASURED;
    let late = bench.run(1000, |t| t.estimate.status = unmeasured);
    assert!(late.iter().all(|safe| safe.event == 0));
    let limit = settings().monitors.estimate.unwrap().uninformed_ticks.unwrap();
    let mixed = bench.run(2 * limit, |t| {
        let late = t.estimate.tick % 2 == 0;
        t.estimate.status = if late { unmeasured } else { Estimate::HELD };
    });
    let raised = mixed
        .iter()
        .position(|safe| safe.event == Event::EstimateUninformed.number());
    assert_eq!(raised, Some(2 * limit as usize - 1));
}

/// The way to the safe field when the links are gone: by itself, within the stated ticks, then silence.
#[test]
fn alone_it_ramps_and_then_says_no_more() {
    let settings = settings();
    let mut bench = Bench::new(&settings);
    bench.run(150, |_| {});
    let start = bench.guard.field_a_per_m();
    assert!(start.abs() > 7000.0);
    let alone: Vec<SafeField> = std::iter::from_fn(|| bench.guard.alone(150))
        .map(|(safe,)| safe)
        .collect();
    assert_eq!(alone[0].event, Event::CommandStale.number());
    assert!(alone.len() as u64 <= settings.most_ramp_ticks(TICK_S));
    assert_eq!(
        alone.last().map(|safe| (safe.field_a_per_m, safe.status)),
        Some((0.0, SafeField::SAFE))
    );
    assert!(bench.guard.alone(0).is_none());
}

/// Guards the sentences of a scenario's check.
#[test]
fn contradictory_monitors_are_refused() {
    type Case = (&'static str, fn(&mut GuardSettings));
    let cases: [Case; 8] = [
        ("monitors.temperature_limit_k", |s| {
            s.monitors.temperature_limit_k = Some(f64::NAN)
        }),
        ("monitors.current.trip_a", |s| {
            s.monitors.current.as_mut().unwrap().trip_a = 1.0
        }),
        ("monitors.tracking.after_ticks", |s| {
            s.monitors.tracking.as_mut().unwrap().after_ticks = 0
        }),
        ("monitors.estimate.range_a_per_m", |s| {
            s.monitors.estimate.as_mut().unwrap().range_a_per_m.1 = 1.0
        }),
        ("monitors.deadline_misses", |s| s.monitors.deadline_misses = Some(0)),
        ("safe_field_a_per_m", |s| s.safe_field_a_per_m = 15_001.0),
        ("reactions.displacement_jump", |s| {
            *s = responding(
                Event::DisplacementJump,
                Reaction::Hold,
                WayBack::AfterHealth { for_s: 0.2 },
            );
        }),
        ("reactions.command_stale", |s| {
            *s = responding(Event::CommandStale, Reaction::FallBack, WayBack::Reset)
        }),
    ];
    for (path, change) in cases {
        let mut changed = settings();
        change(&mut changed);
        let refusal = changed.validate(TICK_S).unwrap_err();
        println!("{refusal}");
        assert_eq!(refusal.path, path);
    }
}
