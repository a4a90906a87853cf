//! Guards what every link promises, whichever transport carries it: the token of the tick, in order, or an error by name.

use anhyst_ipc::{
    Channel, Connections, Demand, FieldCommand, LinkError, Measurement, Message, NodeId, SharedContext, Wire,
};
use anhyst_tests::SharedMemory;
use std::rc::Rc;
use std::sync::Barrier;
use std::time::Duration;

const WIRES: [Wire; 2] = [
    Wire {
        channel: Channel::Demand,
        reader: NodeId::Inverse,
        delay: 0,
    },
    Wire {
        channel: Channel::FieldCommand,
        reader: NodeId::Controller,
        delay: 1,
    },
];
const PROCESSES: [(&str, &[NodeId]); 2] = [("controller", &[NodeId::Controller]), ("inverse", &[NodeId::Inverse])];

fn demand(tick: u64) -> Demand {
    Demand {
        tick,
        magnetization_a_per_m: 1.0 / (tick as f64 + 3.0),
        status: tick << 40,
        ..Demand::default()
    }
}

#[test]
fn tokens_cross_processes_in_order() {
    let memory = SharedMemory::unique();
    let limit = Duration::from_secs(20);
    let settings = memory.settings("inverse", &PROCESSES, limit);
    let ticks = 5000;
    let inverse = move || {
        let context = Rc::new(SharedContext::open(settings).unwrap());
        let mut connections = Connections::new([NodeId::Inverse], WIRES.to_vec(), Some(context));
        let mut reader = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
        let mut sender = connections.sender::<FieldCommand>().unwrap();
        connections.start_barriers(&mut || sender.connect()).unwrap();
        for tick in 0..ticks {
            let token = reader.receive(tick).unwrap();
            assert_eq!(Demand { sent_ns: 0, ..token }, demand(tick));
            let answer = FieldCommand {
                tick,
                field_a_per_m: token.magnetization_a_per_m,
                ..FieldCommand::default()
            };
            sender.send(answer).unwrap();
        }
    };
    // The two contexts wait for each other, so this one opens while the other thread does.
    let opening = memory.settings("controller", &PROCESSES, limit);
    let worker = std::thread::spawn(inverse);
    let context = Rc::new(SharedContext::open(opening).unwrap());
    let mut connections = Connections::new([NodeId::Controller], WIRES.to_vec(), Some(context));
    let mut sender = connections.sender::<Demand>().unwrap();
    let mut back = connections.receiver::<FieldCommand>(NodeId::Controller, 1).unwrap();
    connections.start_barriers(&mut || sender.connect()).unwrap();
    for tick in 0..ticks {
        // A delayed reader gets the default token first.
        let due = if tick == 0 {
            0.0
        } else {
            demand(tick - 1).magnetization_a_per_m
        };
        assert_eq!(back.receive(tick).unwrap().field_a_per_m, due);
        sender.send(demand(tick)).unwrap();
    }
    worker.join().unwrap();
    assert_eq!(back.report().latency.count, ticks - 1);
    drop((sender, back, connections));
    // What remains is iceoryx2's 16-byte management file of the prefix, which only the launcher removes.
    let left: Vec<String> = memory
        .files()
        .into_iter()
        .filter(|name| !name.contains("global_mgmt"))
        .collect();
    assert_eq!(left, Vec::<String>::new());
}

#[test]
fn tokens_stay_in_their_cell_within_a_process() {
    let mut connections = Connections::new([NodeId::Controller, NodeId::Inverse], WIRES.to_vec(), None);
    let mut sender = connections.sender::<Demand>().unwrap();
    let mut reader = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
    let mut late = connections.receiver::<Demand>(NodeId::Inverse, 1).unwrap();
    assert_eq!(late.receive(0), Ok(Demand::default()));
    for tick in 0..100 {
        if tick > 0 {
            assert_eq!(late.receive(tick), Ok(demand(tick - 1)));
        }
        sender.send(demand(tick)).unwrap();
        assert_eq!(reader.receive(tick), Ok(demand(tick)));
    }
    assert_eq!(
        reader.receive(100),
        Err(LinkError::Gap {
            reader: NodeId::Inverse,
            channel: Channel::Demand,
            expected: 100,
            got: 99
        })
    );
}

#[test]
fn a_missing_transport_is_named() {
    let mut connections = Connections::new([NodeId::Inverse], WIRES.to_vec(), None);
    let error = connections.receiver::<Demand>(NodeId::Inverse, 0).err();
    assert_eq!(
        error,
        Some(LinkError::Unconnected {
            reader: NodeId::Inverse,
            channel: Channel::Demand
        })
    );
}

/// Guards rule 3, lossless or loud: a lost token and a silent process are errors that name channel, tick and producer.
#[test]
fn gaps_and_silence_are_loud() {
    let memory = SharedMemory::unique();
    let limit = Duration::from_millis(200);
    let settings = memory.settings("inverse", &PROCESSES, limit);
    let done = std::sync::Arc::new(Barrier::new(2));
    let other_done = done.clone();
    let worker = std::thread::spawn(move || {
        let context = Rc::new(SharedContext::open(settings).unwrap());
        let mut connections = Connections::new([NodeId::Inverse], WIRES.to_vec(), Some(context));
        let mut reader = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
        connections.start_barriers(&mut || Ok(())).unwrap();
        reader.receive(0).unwrap();
        let gap = reader.receive(1);
        let silence = reader.receive(3);
        other_done.wait();
        (gap, silence)
    });
    let context = Rc::new(SharedContext::open(memory.settings("controller", &PROCESSES, limit)).unwrap());
    let mut connections = Connections::new([NodeId::Controller], WIRES.to_vec(), Some(context));
    let mut sender = connections.sender::<Demand>().unwrap();
    connections.start_barriers(&mut || sender.connect()).unwrap();
    sender.send(demand(0)).unwrap();
    sender.send(demand(2)).unwrap();
    done.wait();
    let (gap, silence) = worker.join().unwrap();
    assert_eq!(
        gap,
        Err(LinkError::Gap {
            reader: NodeId::Inverse,
            channel: Channel::Demand,
            expected: 1,
            got: 2
        })
    );
    let text = silence.unwrap_err().to_string();
    assert!(
        text.starts_with("inverse waited 0.2") && text.ends_with("for demand of tick 3, but controller is silent"),
        "{text}"
    );
}

/// Guards the layout hash: same size and field types, other names, other type name.
#[test]
fn type_names_carry_the_fields() {
    let names = [Demand::TYPE_NAME, Measurement::TYPE_NAME];
    assert!(names[0].starts_with("Demand_") && names[0].len() == "Demand_".len() + 16);
    assert_ne!(names[0].split('_').next_back(), names[1].split('_').next_back());
}

#[test]
fn words_and_values_keep_every_bit() {
    let token = Demand {
        tick: 7,
        error_m: f64::from_bits(0x7ff8_0000_dead_beef),
        status: (1 << 52) + 1,
        ..demand(7)
    };
    let mut words = [0; 24];
    token.write_words(&mut words);
    let mut again = [0; 24];
    Demand::from_words(7, &words).write_words(&mut again);
    assert_eq!(words, again);
    let mut values = [0.0; 24];
    token.write_values(&mut values);
    Demand::from_values(7, &values).write_words(&mut again);
    assert_eq!(words, again);
}
