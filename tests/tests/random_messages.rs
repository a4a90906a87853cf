//! Guards every block against every bit pattern: more than a million messages of random bytes, any tick, into each node of
//! the loop. No panic, no endless step; no number that is none and no field above the limit comes out.

use anhyst_ipc::{
    CoilField, Connections, Demand, Estimate, FieldCommand, FieldKind, MAX_FIELDS, Measurement, Message, NodeId,
    SafeField, Sender,
};
use anhyst_launch::assemble;
use anhyst_scenario::{Scenario, load, wires};
use std::path::Path;

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Any bits, any number of any size, special values, and numbers as they occur.
    fn word(&mut self) -> u64 {
        let bits = self.next();
        match bits % 8 {
            0 | 1 => self.next(),
            2 => [
                f64::NAN,
                f64::INFINITY,
                f64::NEG_INFINITY,
                f64::MAX,
                f64::MIN_POSITIVE,
                -0.0,
                5e-324,
            ][bits as usize / 8 % 7]
                .to_bits(),
            3 => (1e5 * self.unit()).to_bits(),
            4 => (1e-4 * self.unit()).to_bits(),
            _ => (1e4 * self.unit()).to_bits(),
        }
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn token<M: Message>(&mut self, tick: u64) -> M {
        let words: [u64; MAX_FIELDS] = std::array::from_fn(|_| self.word());
        let stamp = match self.next() % 8 {
            0 => self.next(),
            1 => tick.wrapping_sub(self.next() % 10),
            _ => tick,
        };
        M::from_words(stamp, &words)
    }
}

struct Feeds {
    measurement: Sender<Measurement>,
    estimate: Sender<Estimate>,
    demand: Sender<Demand>,
    field_command: Sender<FieldCommand>,
    safe_field: Sender<SafeField>,
    coil_field: Sender<CoilField>,
}

fn scenario(settings: &[&str]) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/milling.ron");
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    load(&path, &settings).unwrap()
}

fn assert_finite<M: Message>(token: &M) {
    let mut words = [0; MAX_FIELDS];
    token.write_words(&mut words);
    for (field, word) in M::FIELDS.iter().zip(words) {
        let number = f64::from_bits(word);
        assert!(
            field.kind == FieldKind::U64 || number.is_finite(),
            "{}: {token:?}",
            field.name
        );
    }
}

/// Feeds a node `ticks` ticks of random tokens; how many messages that were.
fn feed(node: NodeId, scenario: &Scenario, ticks: u64, seed: u64) -> u64 {
    let mut connections = Connections::new(NodeId::LOOP_ORDER, wires(), None);
    connections.accept_any_tick(anhyst_ipc::Channel::ALL);
    let mut stage = assemble::stage(node, scenario, &mut connections).unwrap();
    let mut feeds = Feeds {
        measurement: connections.sender().unwrap(),
        estimate: connections.sender().unwrap(),
        demand: connections.sender().unwrap(),
        field_command: connections.sender().unwrap(),
        safe_field: connections.sender().unwrap(),
        coil_field: connections.sender().unwrap(),
    };
    let inputs = wires().iter().filter(|wire| wire.reader == node).count() as u64;
    let limit = scenario.guard.acting_field_limit_a_per_m();
    let mut random = Random(seed);
    for tick in 0..ticks {
        feeds.measurement.send(random.token(tick)).unwrap();
        feeds.estimate.send(random.token(tick)).unwrap();
        feeds.demand.send(random.token(tick)).unwrap();
        feeds.field_command.send(random.token(tick)).unwrap();
        feeds.safe_field.send(random.token(tick)).unwrap();
        feeds.coil_field.send(random.token(tick)).unwrap();
        stage.tick(tick).unwrap();
        match node {
            NodeId::Guard => {
                let safe: SafeField = connections.last().unwrap();
                assert!(safe.field_a_per_m.abs() <= limit, "{safe:?}");
                assert_finite(&safe);
            }
            NodeId::Inverse => {
                let command: FieldCommand = connections.last().unwrap();
                // It keeps its own limit; the guard, which comes after it, keeps the smaller one.
                let own_limit = scenario.inverse.field_limit_a_per_m.unwrap_or(limit);
                assert!(command.field_a_per_m.abs() <= own_limit, "{command:?}");
                assert_finite(&command);
            }
            NodeId::Controller => assert_finite(&connections.last::<Demand>().unwrap()),
            NodeId::Estimator => assert_finite(&connections.last::<Estimate>().unwrap()),
            NodeId::Amplifier => assert_finite(&connections.last::<CoilField>().unwrap()),
            _ => assert_finite(&connections.last::<Measurement>().unwrap()),
        }
    }
    inputs * ticks
}

#[test]
fn a_million_messages_of_random_bytes_do_no_harm() {
    let plain = scenario(&[]);
    let watched = scenario(&[
        "plant.sensors.temperature=(noise_k: 0.1)",
        "guard=(field_limit_a_per_m: 30e3, jump_limit_m: 1e-5, stuck: (ticks: 5, field_change_a_per_m: 100), monitors: \
            (temperature_limit_k: 400, current: (coil_constant_per_m: 1e4, limit_a: 2, trip_a: 3), deadline_misses: 3, \
            tracking: (error_limit_m: 1e-6), estimate: (range_a_per_m: (6000, 8000), uninformed_ticks: 10), reset_at_s: [1.0]), \
            reactions: {displacement_jump: (reaction: Hold, way_back: AfterHealth(for_s: 1e-4)), \
                command_not_finite: (reaction: RampToSafe, way_back: AfterHealth(for_s: 1e-4))})",
        "amplifier=(bandwidth_hz: 2000, field_limit_a_per_m: 40e3, slew_limit_a_per_m_s: 1e8, delay_ticks: 2)",
    ]);
    let mut messages = 0;
    for (index, scenario) in [&plain, &watched].into_iter().enumerate() {
        let seed = 77 + index as u64;
        for (node, ticks) in [
            (NodeId::Guard, 60_000),
            (NodeId::Amplifier, 100_000),
            (NodeId::Controller, 50_000),
            (NodeId::Inverse, 20_000),
            (NodeId::Estimator, 2_000),
            (NodeId::Plant, 5_000),
        ] {
            let begin = std::time::Instant::now();
            messages += feed(node, scenario, ticks, seed);
            println!("{node}: {ticks} ticks in {:.2} s", begin.elapsed().as_secs_f64());
        }
    }
    println!("{messages} messages");
    assert!(messages >= 1_000_000, "{messages}");
}
