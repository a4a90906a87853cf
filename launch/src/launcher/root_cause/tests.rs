//! Guards the name in the sentence about a failed run: it is the same whoever has complained so far, in every placement, and
//! also if the one at fault was stopped while it slept, with a wait on its status that is long over.

use super::*;
use anhyst_ipc::Channel;
use anhyst_scenario::wires;

const TICK: u64 = 40;

fn alone() -> Vec<Vec<NodeId>> {
    NodeId::LOOP_ORDER.iter().map(|node| vec![*node]).collect()
}

fn in_groups() -> Vec<Vec<NodeId>> {
    use NodeId::{Amplifier, Controller, Estimator, Guard, Inverse, Plant, Recorder};
    vec![
        vec![Plant, Amplifier],
        vec![Estimator],
        vec![Controller, Inverse, Guard],
        vec![Recorder],
    ]
}

/// A loop in which `culprit` has not answered tick [`TICK`], after all others have gone on as far as they can.
fn stuck(placement: &[Vec<NodeId>], culprit: NodeId) -> Vec<Witness> {
    let wires = wires();
    let mut done = [TICK; 7];
    let index = |node: NodeId| NodeId::LOOP_ORDER.iter().position(|known| *known == node).unwrap();
    // A process works through its nodes in turn: one is at its tick only if those before it in the process have done theirs.
    let group_of = |node: NodeId| placement.iter().find(|nodes| nodes.contains(&node)).unwrap();
    let missing = |done: &[u64; 7], node: NodeId| {
        let tick = done[index(node)];
        let of_node = wires.iter().filter(|wire| wire.reader == node);
        let due = of_node.filter_map(|wire| Some((wire.channel, tick.checked_sub(wire.delay)?)));
        let is_elsewhere = |channel: Channel| !group_of(node).contains(&channel.producer());
        due.filter(|(channel, _)| is_elsewhere(*channel))
            .find(|(channel, tick)| done[index(channel.producer())] <= *tick)
    };
    let turn = |done: &[u64; 7], nodes: &[NodeId]| {
        let least = nodes.iter().map(|node| done[index(*node)]).min().unwrap();
        *nodes.iter().find(|node| done[index(**node)] == least).unwrap()
    };
    loop {
        let before = done;
        for nodes in placement {
            let node = turn(&done, nodes);
            if node != culprit && missing(&done, node).is_none() {
                done[index(node)] += 1;
            }
        }
        if done == before {
            break;
        }
    }
    let witness = |nodes: &Vec<NodeId>| {
        let node = turn(&done, nodes);
        let names: Vec<&str> = nodes.iter().map(|node| node.name()).collect();
        let wait = missing(&done, node).map(|(channel, tick)| TokenWait {
            reader: node,
            channel,
            tick,
        });
        Witness {
            name: names.join("+"),
            nodes: nodes.clone(),
            is_ours: true,
            state: Some(State::Runs),
            failure: None,
            standing: Some(Standing {
                phase: 2,
                tick: nodes.iter().map(|node| done[index(*node)]).min().unwrap(),
                wait,
            }),
        }
    };
    placement.iter().map(witness).collect()
}

/// What one says that has given up waiting.
fn complaint(witness: &Witness) -> Option<Failure> {
    let standing = witness.standing?;
    let TokenWait { reader, channel, tick } = standing.wait?;
    let error = LinkError::Silent {
        reader,
        channel,
        tick,
        waited_s: 2.0,
    };
    Some(Failure {
        tick: standing.tick,
        sentence: error.to_string(),
        cause: Cause::Link(error),
    })
}

fn position(witnesses: &[Witness], node: NodeId) -> usize {
    witnesses
        .iter()
        .position(|witness| witness.nodes.contains(&node))
        .unwrap()
}

fn cause(witnesses: &[Witness]) -> RootCause {
    Inquiry { witnesses }.root_cause().unwrap()
}

#[test]
fn the_cause_is_the_same_whoever_has_complained() {
    for placement in [alone(), in_groups()] {
        for culprit in NodeId::SENDERS {
            let witnesses = stuck(&placement, culprit);
            let at = position(&witnesses, culprit);
            for who in 0_u32..1 << witnesses.len() {
                let mut witnesses = witnesses.clone();
                for (index, witness) in witnesses.iter_mut().enumerate().filter(|(index, _)| *index != at) {
                    witness.failure = complaint(witness).filter(|_| who >> index & 1 == 1);
                }
                for state in [State::Runs, State::Stopped] {
                    witnesses[at].state = Some(state);
                    assert_eq!(Inquiry { witnesses: &witnesses }.is_at_rest(), state == State::Stopped);
                    let found = cause(&witnesses);
                    assert_eq!(
                        (found.process, found.tick),
                        (at, Some(TICK)),
                        "{culprit}, {who:b}: {found:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_wait_that_is_over_accuses_nobody() {
    let wires = wires();
    for culprit in NodeId::SENDERS {
        let mut witnesses = stuck(&alone(), culprit);
        let at = position(&witnesses, culprit);
        let prompt = wires.iter().find(|wire| wire.reader == culprit).unwrap();
        let standing = witnesses[at].standing.as_mut().unwrap();
        standing.wait = Some(TokenWait {
            reader: culprit,
            channel: prompt.channel,
            tick: TICK - prompt.delay,
        });
        let found = cause(&witnesses);
        assert_eq!((found.process, found.fault), (at, Fault::Hangs), "{found:?}");
    }
}

/// A user's program that gives up early is not to blame for what it waited for, but it is for what it owes.
#[test]
fn a_program_that_leaves_is_blamed_for_what_it_owes() {
    let leaves = |culprit: NodeId| {
        let mut witnesses = stuck(&alone(), culprit);
        let amplifier = position(&witnesses, NodeId::Amplifier);
        witnesses[amplifier].is_ours = false;
        witnesses[amplifier].state = Some(State::Ended(End::Status(4)));
        let found = cause(&witnesses);
        witnesses[found.process].nodes[0]
    };
    assert_eq!(leaves(NodeId::Controller), NodeId::Controller);
    assert_eq!(leaves(NodeId::Amplifier), NodeId::Amplifier);
}

fn fails_by(witness: &mut Witness, cause: Cause) {
    witness.failure = Some(Failure {
        tick: TICK,
        cause,
        sentence: "it failed".into(),
    });
    witness.state = Some(State::Ended(End::Status(3)));
}

/// The recorder has no room any more; the plant notices only that a reader has gone, and the others wait for the plant.
#[test]
fn one_that_fails_by_itself_is_named_and_not_who_notices() {
    for failure in [
        Cause::Write,
        Cause::Panic,
        Cause::Link(LinkError::System {
            operation: "go on recording".into(),
            cause: "0 MiB are left".into(),
        }),
    ] {
        let mut witnesses = stuck(&alone(), NodeId::Plant);
        let (plant, recorder) = (0, position(&witnesses, NodeId::Recorder));
        fails_by(&mut witnesses[recorder], failure);
        let undelivered = LinkError::Undelivered {
            channel: Channel::Measurement,
            tick: TICK,
            reached: 3,
            expected: 4,
        };
        fails_by(&mut witnesses[plant], Cause::Link(undelivered));
        let found = cause(&witnesses);
        assert_eq!((found.process, found.fault), (recorder, Fault::Failed));
        assert_eq!(found.sentence, "it failed");
    }
}

/// Whoever hears a wrong tick has done nothing wrong.
#[test]
fn a_wrong_tick_is_its_senders() {
    let mut witnesses = stuck(&alone(), NodeId::Amplifier);
    let (amplifier, recorder) = (
        position(&witnesses, NodeId::Amplifier),
        position(&witnesses, NodeId::Recorder),
    );
    witnesses[amplifier].is_ours = false;
    for got in [TICK - 1, TICK + 1] {
        let gap = LinkError::Gap {
            reader: NodeId::Recorder,
            channel: Channel::CoilField,
            expected: TICK,
            got,
        };
        fails_by(&mut witnesses[recorder], Cause::Link(gap));
        let found = cause(&witnesses);
        assert_eq!(
            (found.process, found.fault, found.tick),
            (amplifier, Fault::WrongTick, Some(TICK))
        );
    }
}

/// At the start all wait for the one that is not as far, whoever says so.
#[test]
fn one_that_does_not_come_is_named() {
    let mut witnesses = stuck(&alone(), NodeId::Plant);
    for witness in &mut witnesses {
        witness.standing = Some(Standing::default());
    }
    let inverse = position(&witnesses, NodeId::Inverse);
    witnesses[inverse].standing = None;
    witnesses[inverse].state = Some(State::Stopped);
    let absent = LinkError::Absent {
        process: "inverse".into(),
        phase: 0,
        waited_s: 2.0,
    };
    fails_by(&mut witnesses[0], Cause::Link(absent));
    let found = cause(&witnesses);
    assert_eq!((found.process, found.fault), (inverse, Fault::Stopped));
}

/// The plant waits for a recorder that has fallen behind, all others for the plant.
#[test]
fn a_recorder_that_does_not_follow_is_named() {
    let mut witnesses = stuck(&alone(), NodeId::Plant);
    let behind = LinkError::Behind {
        process: "recorder".into(),
        ticks: 4160,
        waited_s: 2.0,
    };
    let plant = position(&witnesses, NodeId::Plant);
    fails_by(&mut witnesses[plant], Cause::Link(behind));
    let found = cause(&witnesses);
    let recorder = position(&witnesses, NodeId::Recorder);
    assert_eq!((found.process, found.fault), (recorder, Fault::Hangs));
}

/// Of one that was started again nothing is known once it has ended; nobody waits for it while the others write their reports.
#[test]
fn at_the_end_nobody_waits_for_one_that_has_left() {
    let mut witnesses = stuck(&alone(), NodeId::Amplifier);
    for witness in &mut witnesses {
        witness.standing = Some(Standing {
            phase: 3,
            tick: TICK,
            wait: None,
        });
    }
    let ended = Some(State::Ended(End::Status(0)));
    let amplifier = position(&witnesses, NodeId::Amplifier);
    (witnesses[amplifier].is_ours, witnesses[amplifier].state) = (false, ended);
    let estimator = position(&witnesses, NodeId::Estimator);
    (witnesses[estimator].standing, witnesses[estimator].state) = (None, ended);
    assert!(!Inquiry { witnesses: &witnesses }.is_at_rest());
    // Unlike one that has not come yet.
    witnesses[estimator].state = None;
    assert!(Inquiry { witnesses: &witnesses }.is_at_rest());
}

/// A signal, and a request to end, are causes before anything that follows from them.
#[test]
fn who_was_killed_or_told_to_end_is_named() {
    let mut witnesses = stuck(&alone(), NodeId::Controller);
    let guard = position(&witnesses, NodeId::Guard);
    fails_by(&mut witnesses[guard], Cause::Link(LinkError::Stopped { tick: TICK }));
    assert_eq!(cause(&witnesses).fault, Fault::ToldToEnd);
    let inverse = position(&witnesses, NodeId::Inverse);
    witnesses[inverse].state = Some(State::Ended(End::Signal(9)));
    assert_eq!(
        (cause(&witnesses).process, cause(&witnesses).fault),
        (inverse, Fault::Ended)
    );
}
