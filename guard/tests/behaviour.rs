//! Guards what the guard does: the table at the head of `guard.rs`, row by row, through its messages.

mod common;

use anhyst_guard::{Event, Guard, GuardSettings, Rearm, State, StuckSettings};
use anhyst_ipc::{Block, FieldCommand, Measurement, Now, SafeField};
use common::{TICK_S, others, settings};

struct Bench {
    guard: Guard,
    tick: u64,
    command: FieldCommand,
    measurement: Measurement,
}

impl Bench {
    fn new(settings: &GuardSettings) -> Self {
        Self {
            guard: Guard::new(settings, TICK_S).unwrap(),
            tick: 0,
            command: FieldCommand::default(),
            measurement: Measurement::default(),
        }
    }

    /// A tick with fresh tokens; the displacement stirs as a real one does.
    fn step(&mut self, field_a_per_m: f64) -> SafeField {
        self.command = FieldCommand {
            tick: self.tick,
            field_a_per_m,
            ..self.command
        };
        self.measurement.tick = self.tick;
        self.measurement.displacement_m = 1e-9 * (self.tick % 2) as f64;
        self.step_as_is()
    }

    fn step_as_is(&mut self) -> SafeField {
        let (demand, estimate) = others(self.tick);
        let (safe,) = self
            .guard
            .step(self.tick, (Now(self.command), Now(self.measurement), demand, estimate));
        self.tick += 1;
        safe
    }
}

/// Inside the limits the guard changes no bit of the command.
#[test]
fn passes_commands_unchanged() {
    let mut bench = Bench::new(&settings());
    for index in 0..1000 {
        let field = 3000.0 * (f64::from(index) * 0.01).sin();
        let safe = bench.step(field);
        assert_eq!(
            (safe.field_a_per_m.to_bits(), safe.status, safe.event),
            (field.to_bits(), 0, 0)
        );
    }
}

/// Amplitude and slew are limited, said so in the status, and no fault.
#[test]
fn limits_amplitude_and_slew() {
    let mut bench = Bench::new(&settings());
    assert_eq!(bench.step(15_000.0).status, SafeField::SLEW_LIMITED);
    assert_eq!(bench.guard.field_a_per_m(), 10_000.0);
    assert_eq!(bench.step(50_000.0).status, SafeField::AMPLITUDE_LIMITED);
    assert_eq!(bench.guard.field_a_per_m(), 20_000.0);
    let safe = bench.step(-50_000.0);
    assert_eq!(
        (safe.field_a_per_m, safe.status),
        (10_000.0, SafeField::AMPLITUDE_LIMITED | SafeField::SLEW_LIMITED)
    );
    assert_eq!(bench.guard.state(), State::Normal);
}

/// Every fault is named, and from the far limit the safe field is reached within the stated ticks at the stated slew, then held.
#[test]
fn faults_ramp_to_the_safe_field_in_the_stated_ticks() {
    type Fault = (Event, fn(&mut Bench));
    let faults: [Fault; 6] = [
        (Event::CommandNotFinite, |bench| bench.command.field_a_per_m = f64::NAN),
        (Event::CommandNotFinite, |bench| {
            bench.command.reached_magnetization_a_per_m = f64::INFINITY
        }),
        (Event::MeasurementNotFinite, |bench| {
            bench.measurement.displacement_m = f64::NEG_INFINITY
        }),
        (Event::CommandStale, |bench| bench.command.tick -= 4),
        (Event::MeasurementStale, |bench| bench.measurement.tick -= 4),
        (Event::DisplacementJump, |bench| bench.measurement.displacement_m = 6e-6),
    ];
    let settings = GuardSettings {
        safe_field_a_per_m: -1000.0,
        ..settings()
    };
    let (slew, most) = (settings.ramp_slew_a_per_m_s(), settings.most_ramp_ticks(TICK_S));
    for (event, fault) in faults {
        let mut bench = Bench::new(&settings);
        for _ in 0..100 {
            bench.step(20_000.0);
        }
        bench.command.tick = bench.tick;
        bench.measurement.tick = bench.tick;
        fault(&mut bench);
        let mut before = bench.guard.field_a_per_m();
        let first = bench.step_as_is();
        assert_eq!(
            (Event::from_number(first.event), first.status),
            (Some(event), SafeField::RAMPING | SafeField::SLEW_LIMITED),
            "{event}"
        );
        assert!(
            (first.field_a_per_m - before).abs() <= slew * TICK_S * (1.0 + 1e-12),
            "{event}"
        );
        before = first.field_a_per_m;
        let mut ticks = 1;
        while bench.guard.state() == State::Ramping {
            let safe = bench.step(20_000.0);
            assert!(
                (safe.field_a_per_m - before).abs() <= slew * TICK_S * (1.0 + 1e-12),
                "{event}"
            );
            assert_eq!(safe.event, 0, "an event is raised once");
            before = safe.field_a_per_m;
            ticks += 1;
        }
        println!("{event}: {ticks} ticks, at most {most}");
        assert!(ticks <= most && ticks + 2 >= most, "{event}: {ticks} ticks of {most}");
        for _ in 0..1000 {
            let safe = bench.step(20_000.0);
            assert_eq!(
                (safe.field_a_per_m, safe.status, safe.event),
                (-1000.0, SafeField::SAFE, 0),
                "{event} is latched"
            );
        }
    }
}

/// A measurement that repeats itself is a fault only while the field moves.
#[test]
fn stuck_displacement_is_told_from_rest() {
    let mut bench = Bench::new(&settings());
    for _ in 0..1000 {
        bench.command.tick = bench.tick;
        bench.measurement.tick = bench.tick;
        assert_eq!(bench.step_as_is().event, 0, "at rest a repeated value is no fault");
    }
    let raised = (0..1000).find_map(|moved| {
        bench.command = FieldCommand {
            tick: bench.tick,
            field_a_per_m: f64::from(moved) * 50.0,
            ..bench.command
        };
        bench.measurement.tick = bench.tick;
        Event::from_number(bench.step_as_is().event).map(|event| (event, moved))
    });
    assert_eq!(raised, Some((Event::DisplacementStuck, 11)));
}

/// Tokens a few ticks old are used as they are; older ones are a fault. Old measurements are not taken for a stuck sensor.
#[test]
fn old_tokens_are_used_up_to_their_limit() {
    let mut bench = Bench::new(&settings());
    bench.step(100.0);
    for age in 1..=3 {
        let safe = bench.step_as_is();
        assert_eq!((safe.field_a_per_m, safe.event), (100.0, 0), "age {age}");
    }
    assert_eq!(Event::from_number(bench.step_as_is().event), Some(Event::CommandStale));
}

/// The way back is explicit, refused while the cause lasts, and towards a command at rest has no step larger than the ramp's.
#[test]
fn coming_back_is_explicit_and_bumpless() {
    let settings = GuardSettings {
        slew_limit_a_per_m_s: None,
        ..settings()
    };
    let mut bench = Bench::new(&settings);
    bench.step(8000.0);
    assert_eq!(bench.guard.rearm(), Err(Rearm::NotSafe(State::Normal)));
    bench.step(f64::NAN);
    assert_eq!(bench.guard.rearm(), Err(Rearm::NotSafe(State::Ramping)));
    for _ in 0..500 {
        bench.step(f64::NAN);
    }
    assert_eq!(bench.guard.rearm(), Err(Rearm::StillFaulty(Event::CommandNotFinite)));
    bench.step(8000.0);
    bench.guard.rearm().unwrap();
    let step = settings.ramp_slew_a_per_m_s() * TICK_S;
    let (mut before, mut ticks) = (0.0, 0);
    while bench.guard.state() != State::Normal {
        let safe = bench.step(8000.0);
        assert_eq!(safe.event, if ticks == 0 { Event::Rearmed.number() } else { 0 });
        assert!((safe.field_a_per_m - before).abs() <= step * (1.0 + 1e-12));
        before = safe.field_a_per_m;
        ticks += 1;
    }
    assert_eq!(before, 8000.0);
    assert_eq!(ticks, (8000.0 / step).ceil() as u32);
    assert_eq!(
        bench.step(-8000.0).field_a_per_m,
        -8000.0,
        "without a slew limit Normal follows at once"
    );
}

/// Whatever the command does, the difference from it shrinks by the ramp's step a tick: a field that walks towards a command
/// that moves faster than it could chase it for ever.
#[test]
fn a_fast_command_is_reached_in_a_stated_time() {
    let settings = GuardSettings {
        slew_limit_a_per_m_s: None,
        ..settings()
    };
    let step = settings.ramp_slew_a_per_m_s() * TICK_S;
    // Its largest step is five times the ramp's.
    let command = |tick: u32| 8000.0 * (f64::from(tick) * 5.0 * step / 8000.0).sin();
    let mut bench = Bench::new(&settings);
    bench.step(8000.0);
    bench.step(f64::NAN);
    for _ in 0..500 {
        bench.step(8000.0);
    }
    let begin = (0..).find(|tick| command(*tick) > 7900.0).unwrap();
    bench.guard.rearm().unwrap();
    let mut difference = command(begin).abs();
    let mut ticks = 0;
    while bench.guard.state() != State::Normal {
        let wanted = command(begin + ticks);
        let now = (bench.step(wanted).field_a_per_m - wanted).abs();
        assert!(
            now <= (difference - step).max(0.0) + 1e-9,
            "{ticks}: {now} after {difference}"
        );
        difference = now;
        ticks += 1;
    }
    assert_eq!(difference, 0.0);
    assert!(
        f64::from(ticks) <= 2.0 * settings.field_limit_a_per_m / step,
        "{ticks} ticks"
    );
}

/// A fault on the way back goes to the safe field again.
#[test]
fn faults_on_the_way_back_ramp_again() {
    let mut bench = Bench::new(&settings());
    bench.step(f64::NAN);
    for _ in 0..500 {
        bench.step(8000.0);
    }
    bench.guard.rearm().unwrap();
    for _ in 0..10 {
        bench.step(8000.0);
    }
    assert_eq!(bench.guard.state(), State::Returning);
    assert_eq!(
        Event::from_number(bench.step(f64::NAN).event),
        Some(Event::CommandNotFinite)
    );
    for _ in 0..500 {
        bench.step(8000.0);
    }
    assert_eq!((bench.guard.state(), bench.guard.field_a_per_m()), (State::Safe, 0.0));
}

/// Contradictory settings are refused, with numbers.
#[test]
fn settings_are_validated_together() {
    type Case = (&'static str, fn(&mut GuardSettings));
    let cases: [Case; 10] = [
        ("field_limit_a_per_m", |s| s.field_limit_a_per_m = 0.0),
        ("field_limit_a_per_m", |s| s.field_limit_a_per_m = f64::MAX),
        ("safe_field_a_per_m", |s| s.safe_field_a_per_m = 30_000.0),
        ("lowest_field_a_per_m", |s| s.lowest_field_a_per_m = Some(1.0)),
        ("lowest_field_a_per_m", |s| s.lowest_field_a_per_m = Some(-20_001.0)),
        ("ramp_time_s", |s| s.ramp_time_s = 1e-5),
        ("ramp_time_s", |s| s.slew_limit_a_per_m_s = Some(1e6)),
        ("slew_limit_a_per_m_s", |s| s.slew_limit_a_per_m_s = Some(f64::NAN)),
        ("jump_limit_m", |s| s.jump_limit_m = Some(-1.0)),
        ("stuck.ticks", |s| {
            s.stuck = Some(StuckSettings {
                ticks: 0,
                field_change_a_per_m: 1.0,
            })
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

/// A snapshot continues as the original does, bit for bit.
#[test]
fn snapshots_continue_alike() {
    let mut bench = Bench::new(&settings());
    for _ in 0..50 {
        bench.step(9000.0);
    }
    bench.step(f64::NAN);
    let text = serde_json::to_string(&bench.guard).unwrap();
    let mut copy = serde_json::from_str::<Guard>(&text).unwrap();
    for _ in 0..200 {
        let safe = bench.step(1.0);
        let (demand, estimate) = others(bench.tick - 1);
        let (again,) = copy.step(
            bench.tick - 1,
            (Now(bench.command), Now(bench.measurement), demand, estimate),
        );
        assert_eq!(safe, again);
    }
}
