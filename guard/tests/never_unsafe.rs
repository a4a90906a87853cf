//! Guards the one promise that holds whatever happens: the field is finite, inside the limit, and its step inside the slew.
//! Every field of every token is made of random bits, so NaN, infinities, subnormals and huge numbers all occur.

mod common;

use anhyst_guard::{Guard, GuardSettings, Monitors, Responses, State, StuckSettings};
use anhyst_ipc::{Block, FieldCommand, Measurement, Message, Now};
use common::{TICK_S, others};
use proptest::prelude::*;

/// Half of the words are any bits at all, half are ordinary numbers, so that the guard does not stay at the safe field.
fn word() -> impl Strategy<Value = u64> {
    prop_oneof![
        any::<u64>(),
        (-1e5..1e5f64).prop_map(f64::to_bits),
        (-1e5..1e5f64).prop_map(f64::to_bits),
        Just(f64::NAN.to_bits()),
        Just(f64::INFINITY.to_bits()),
        Just(f64::MAX.to_bits()),
    ]
}

/// Ordinary commands with a rare word of any kind; displacement in nanometres.
fn tokens() -> impl Strategy<Value = (Vec<u64>, Vec<u64>, u64, u64, bool)> {
    let ordinary = prop::collection::vec((-3e4..3e4f64).prop_map(f64::to_bits), 16);
    let wild = prop::collection::vec(word(), 16);
    let words = prop_oneof![8 => ordinary, 1 => wild].boxed();
    let age = prop_oneof![20 => Just(0), 1 => any::<u64>()].boxed();
    (words.clone(), words, age.clone(), age, any::<bool>())
}

fn settings() -> impl Strategy<Value = GuardSettings> {
    let lowest = prop::option::of(0.0..=1.0f64);
    (
        1.0..1e5f64,
        0.0..1.0f64,
        1e-4..0.05f64,
        any::<bool>(),
        any::<bool>(),
        lowest,
    )
        .prop_map(
            |(limit, safe_part, ramp_time_s, slews, watches, lowest)| GuardSettings {
                field_limit_a_per_m: limit,
                // From the limit's negative to what the safe field permits.
                lowest_field_a_per_m: lowest.map(|share| {
                    let most = (limit * (2.0 * safe_part - 1.0)).min(0.0);
                    (most - share * (limit + most)).max(-limit)
                }),
                slew_limit_a_per_m_s: slews.then_some(2.5 * limit / ramp_time_s),
                safe_field_a_per_m: limit * (2.0 * safe_part - 1.0),
                ramp_time_s,
                max_age_ticks: 3,
                jump_limit_m: watches.then_some(1.0),
                stuck: watches.then_some(StuckSettings {
                    ticks: 2,
                    field_change_a_per_m: limit / 10.0,
                }),
                monitors: Monitors::default(),
                reactions: Responses::default(),
            },
        )
}

proptest! {
    // 3 000 runs of 40 ticks: 120 000 ticks with a fresh set of words each.
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn field_is_finite_and_within_limits(settings in settings(), run in prop::collection::vec(tokens(), 40)) {
        let mut guard = Guard::new(&settings, TICK_S).unwrap();
        let limit = settings.field_limit_a_per_m;
        let ramp = settings.ramp_slew_a_per_m_s();
        let mut before = 0.0;
        let mut command_before: f64 = 0.0;
        for (tick, (command, measurement, command_age, measurement_age, rearm)) in run.iter().enumerate() {
            let tick = tick as u64;
            let state = guard.state();
            if *rearm {
                let _ = guard.rearm();
            }
            let command = FieldCommand::from_words(tick.wrapping_sub(*command_age), &command[..FieldCommand::FIELDS.len()]);
            let measurement = Measurement::from_words(tick.wrapping_sub(*measurement_age), &measurement[..Measurement::FIELDS.len()]);
            let (demand, estimate) = others(tick);
            let (safe,) = guard.step(tick, (Now(command), Now(measurement), demand, estimate));
            let field = safe.field_a_per_m;
            prop_assert!(field.is_finite(), "{field} A/m");
            let lowest = settings.lowest_field_a_per_m.unwrap_or(-limit);
            prop_assert!((lowest..=limit).contains(&field), "{field} A/m is beyond {lowest} to {limit} A/m");
            let slew_limit = settings.slew_limit_a_per_m_s.unwrap_or(f64::INFINITY);
            let command = command.field_a_per_m.clamp(lowest, limit);
            // On the way back the field moves as the command does, and a ramp's step besides.
            let follows = state == State::Returning && command.is_finite() && command_before.is_finite();
            let with_command = if follows { (command - command_before).abs() } else { 0.0 };
            let most = if state == State::Normal && guard.state() == State::Normal {
                slew_limit * TICK_S
            } else {
                (ramp * TICK_S + with_command).min(slew_limit * TICK_S)
            };
            command_before = command;
            let step: f64 = field - before;
            // Roundings are all that is granted: one of the field; on the way back of a difference of up to twice the limit, of
            // what is left of it, and of the sum, half a unit each, and of the step itself.
            let back = state != State::Normal && matches!(guard.state(), State::Normal | State::Returning);
            let rounding = limit * f64::EPSILON * if back { 3.5 } else { 1.0 };
            prop_assert!(step.abs() <= most + rounding, "a step of {step} A/m in {state:?}, not {most} A/m");
            before = field;
        }
    }
}

proptest! {
    // 100 000 single faults: a healthy tick at any field, then a tick of nothing but random bits, then a healthy one.
    #![proptest_config(ProptestConfig { cases: 100_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn one_tick_of_random_bits_is_harmless(
        settings in settings(),
        part in -1.5..1.5f64,
        command in any::<[u64; 5]>(),
        measurement in any::<[u64; 3]>(),
        ticks in any::<[u64; 2]>(),
    ) {
        let mut guard = Guard::new(&settings, TICK_S).unwrap();
        let limit = settings.field_limit_a_per_m;
        let healthy = FieldCommand { field_a_per_m: part * limit, ..FieldCommand::default() };
        let mut step = |tick: u64, command: FieldCommand, measurement: Measurement| {
            let (demand, estimate) = others(tick);
            guard.step(tick, (Now(command), Now(measurement), demand, estimate)).0
        };
        let first = step(0, healthy, Measurement::default());
        let wild = FieldCommand::from_words(ticks[0] % 8, &command);
        let wild_measurement = Measurement::from_words(ticks[1] % 8, &measurement);
        let second = step(1, wild, wild_measurement);
        let third = step(2, FieldCommand { tick: 2, ..healthy }, Measurement { tick: 2, ..Measurement::default() });
        let slew = settings.slew_limit_a_per_m_s.unwrap_or(f64::INFINITY).max(settings.ramp_slew_a_per_m_s());
        let mut before = 0.0;
        for safe in [first, second, third] {
            let field: f64 = safe.field_a_per_m;
            let lowest = settings.lowest_field_a_per_m.unwrap_or(-limit);
            prop_assert!((lowest..=limit).contains(&field), "{field} A/m, limits {lowest} to {limit} A/m");
            prop_assert!((field - before).abs() <= slew * TICK_S + limit * f64::EPSILON, "from {before} to {field} A/m");
            before = field;
        }
    }
}
