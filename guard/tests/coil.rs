//! Guards the field against amplifiers that do something else than they are told: each is named within the stated ticks, and a good one never.

mod common;

use anhyst_guard::{Beliefs, BelievedCoil, Event, Guard, GuardSettings};
use anhyst_ipc::{Block, FieldCommand, Measurement, Now};
use common::{TICK_S, others};

const GOOD: BelievedCoil = BelievedCoil {
    delay_ticks: 0,
    lag_s: 0.0,
    timing: true,
};

/// The fields that were given, tick by tick, and the reading of a bad probe: 0.3 % and 3 A/m off, 1 A/m of noise.
struct Rig<'a> {
    given: Vec<f64>,
    seed: u64,
    /// From the fields given before, the last one in the tick before, to the field in the coil.
    amplifier: &'a dyn Fn(&[f64]) -> f64,
}

impl Rig<'_> {
    fn reading(&mut self) -> f64 {
        let noise = (0..12).map(|_| {
            self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.seed >> 33) as f64 / (1_u64 << 31) as f64
        });
        let noise: f64 = noise.sum::<f64>() - 6.0;
        1.003 * (self.amplifier)(&self.given) + 3.0 + noise
    }
}

/// What was given so many ticks ago; what is given in tick k is in the coil at t_k+2.
fn ago(given: &[f64], ticks: usize) -> f64 {
    given.len().checked_sub(ticks).map_or(0.0, |place| given[place])
}

/// The first event, its tick, and the last field.
fn run(believed: BelievedCoil, amplifier: &dyn Fn(&[f64]) -> f64, ticks: u64) -> (Option<(Event, u64)>, f64) {
    let settings: GuardSettings = serde_json::from_str("{\"field_limit_a_per_m\": 30e3}").unwrap();
    let mut guard = Guard::new(&settings, TICK_S).unwrap().believing(&Beliefs {
        reference_m: None,
        coil: Some(believed),
    });
    let mut rig = Rig {
        given: Vec::new(),
        seed: 1,
        amplifier,
    };
    let (mut first, mut field) = (None, 0.0);
    for tick in 0..ticks {
        let (demand, estimate) = others(tick);
        let measurement = Measurement {
            tick,
            displacement_m: 1e-9 * tick as f64,
            coil_field_a_per_m: rig.reading(),
            ..Measurement::default()
        };
        // A cut that begins smoothly: 9 kA/m at 50 Hz, a third of it at 150 Hz.
        let angle = std::f64::consts::TAU * 50.0 * TICK_S * tick as f64;
        let size = (tick as f64 / 2000.0).min(1.0);
        let command = FieldCommand {
            tick,
            field_a_per_m: size * (9e3 * angle.sin() + 3e3 * (3.0 * angle).sin()),
            ..FieldCommand::default()
        };
        let (safe,) = guard.step(tick, (Now(command), Now(measurement), demand, estimate));
        first = first.or(Event::from_number(safe.event).map(|event| (event, tick)));
        field = safe.field_a_per_m;
        rig.given.push(field);
    }
    (first, field)
}

#[test]
fn a_wrong_amplifier_is_named_and_the_field_is_safe() {
    let settings: GuardSettings = serde_json::from_str("{\"field_limit_a_per_m\": 30e3}").unwrap();
    type Amplifier = Box<dyn Fn(&[f64]) -> f64>;
    let scaled = |factor: f64| -> Amplifier { Box::new(move |given| factor * ago(given, 2)) };
    let wrong: [(&str, Amplifier, Event); 10] = [
        ("sign", scaled(-1.0), Event::CoilReversed),
        ("kA/m given as A/m", scaled(1e-3), Event::CoilScaled),
        (
            "A/m taken for kA/m, at its limit",
            Box::new(|given| (1e3 * ago(given, 2)).clamp(-4e4, 4e4)),
            Event::CoilScaled,
        ),
        ("A/m taken for Oe", scaled(79.58), Event::CoilScaled),
        ("Oe", scaled(0.012_57), Event::CoilScaled),
        ("dead", Box::new(|_| 0.0), Event::CoilStuck),
        ("stuck at a field", Box::new(|_| 200.0), Event::CoilStuck),
        ("10 % off", scaled(0.9), Event::CoilScaled),
        ("a tick late", Box::new(|given| ago(given, 3)), Event::CoilLate),
        ("a tick early", Box::new(|given| ago(given, 1)), Event::CoilEarly),
    ];
    // From here on the field is above a twentieth of its limit in most ticks, and moves.
    let large = 700;
    for (name, amplifier, expected) in wrong {
        let (first, field) = run(GOOD, &*amplifier, 6000);
        let (event, tick) = first.unwrap_or_else(|| panic!("{name}: not noticed"));
        println!("{name}: {event} in tick {tick}");
        assert_eq!(event, expected, "{name}");
        let stated = settings.detection_ticks(event, TICK_S).unwrap();
        assert!(tick <= large + 2 * stated, "{name}: {tick}");
        assert_eq!(field, settings.safe_field_a_per_m, "{name}");
    }
}

#[test]
fn what_is_believed_is_no_fault() {
    let kept = libm::exp(-TICK_S / 8e-5);
    let lagging = move |given: &[f64]| {
        // A lag of 80 µs behind two further ticks, by many small steps of its own.
        let mut field = 0.0;
        let most = given.len().saturating_sub(60);
        for place in most..given.len().saturating_sub(3) {
            let (from, to) = (if place == 0 { 0.0 } else { given[place - 1] }, given[place]);
            for part in 0..16 {
                let aim = from + (to - from) * (f64::from(part) + 0.5) / 16.0;
                field = aim + (field - aim) * libm::pow(kept, 1.0 / 16.0);
            }
        }
        field
    };
    let believed = BelievedCoil {
        delay_ticks: 2,
        lag_s: 8e-5,
        timing: true,
    };
    assert_eq!(run(GOOD, &|given| ago(given, 2), 20_000).0, None);
    assert_eq!(run(believed, &lagging, 20_000).0, None);
    // The same amplifier where nothing of it is believed.
    assert_eq!(run(GOOD, &lagging, 6000).0.unwrap().0, Event::CoilLate);
    let patient = BelievedCoil { timing: false, ..GOOD };
    assert_eq!(run(patient, &|given| ago(given, 3), 20_000).0, None);
}
