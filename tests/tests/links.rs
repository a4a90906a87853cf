//! Guards what every link promises, whichever transport carries it: the token of the tick, in order, or an error by name.
//! One body, [`Controller::tick`] and [`Inverse::tick`], runs over memory cells, over iceoryx2 between two threads, and over
//! iceoryx2 between two processes.

use anhyst_ipc::{
    Channel, Connections, Demand, Discipline, FieldCommand, LinkError, MAX_PIECE, Measurement, Message, NodeId, Pace,
    Receiver, Sender, SharedContext, SharedSettings, Wire, monotonic_ns,
};
use anhyst_tests::SharedMemory;
use std::process::Command;
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
/// Where a case goes wrong.
const BROKEN: u64 = 10;

fn demand(tick: u64) -> Demand {
    Demand {
        tick,
        magnetization_a_per_m: 1.0 / (tick as f64 + 3.0),
        status: tick << 40,
        ..Demand::default()
    }
}

/// What the controller sends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Case {
    /// Every tick's token, each after the answer to the one before.
    Whole,
    /// Not that of tick [`BROKEN`].
    Lost,
    /// None from tick [`BROKEN`] on.
    Ended,
}

impl Case {
    const ALL: [Case; 3] = [Case::Whole, Case::Lost, Case::Ended];

    fn ticks(self) -> u64 {
        if self == Case::Whole { 5000 } else { BROKEN + 2 }
    }

    fn sends(self, tick: u64) -> bool {
        match self {
            Case::Whole => true,
            Case::Lost => tick != BROKEN,
            Case::Ended => tick < BROKEN,
        }
    }

    /// How long a token may take: only where one is missing is it waited for so long.
    fn limit(self) -> Duration {
        Duration::from_millis(if self == Case::Whole { 20_000 } else { 200 })
    }

    /// Checks how the inverse has ended.
    fn check(self, outcome: Result<(), LinkError>) {
        match (self, outcome) {
            (Case::Whole, Ok(())) => {}
            (
                Case::Lost | Case::Ended,
                Err(LinkError::Gap {
                    reader: NodeId::Inverse,
                    channel: Channel::Demand,
                    expected: BROKEN,
                    got,
                }),
            ) => assert_ne!(got, BROKEN),
            (Case::Ended, Err(silent @ LinkError::Silent { .. })) => {
                let text = silent.to_string();
                let end = format!("for demand of tick {BROKEN}, but controller is silent");
                assert!(text.starts_with("inverse waited 0.2") && text.ends_with(&end), "{text}");
            }
            (case, outcome) => panic!("{case:?} ended with {outcome:?}"),
        }
    }
}

struct Controller {
    demands: Sender<Demand>,
    answers: Receiver<FieldCommand>,
}

impl Controller {
    fn open(connections: &mut Connections) -> Self {
        Self {
            demands: connections.sender().unwrap(),
            answers: connections.receiver(NodeId::Controller, 1).unwrap(),
        }
    }

    fn tick(&mut self, case: Case, tick: u64) {
        if case == Case::Whole {
            // A delayed reader gets the default token first.
            let due = tick
                .checked_sub(1)
                .map_or(0.0, |before| demand(before).magnetization_a_per_m);
            assert_eq!(self.answers.receive(tick).unwrap().field_a_per_m, due);
        }
        if case.sends(tick) {
            self.demands.send(demand(tick)).unwrap();
        }
    }
}

struct Inverse {
    demands: Receiver<Demand>,
    answers: Sender<FieldCommand>,
}

impl Inverse {
    fn open(connections: &mut Connections) -> Self {
        Self {
            demands: connections.receiver(NodeId::Inverse, 0).unwrap(),
            answers: connections.sender().unwrap(),
        }
    }

    fn tick(&mut self, tick: u64) -> Result<(), LinkError> {
        let token = self.demands.receive(tick)?;
        assert_eq!(Demand { sent_ns: 0, ..token }, demand(tick));
        self.answers.send(FieldCommand {
            tick,
            field_a_per_m: token.magnetization_a_per_m,
            ..FieldCommand::default()
        })
    }
}

fn connections(node: NodeId, settings: SharedSettings) -> Connections {
    let context = Rc::new(SharedContext::open(settings).unwrap());
    Connections::new([node], WIRES.to_vec(), Some(context))
}

/// The inverse's side, between processes.
fn inverse(case: Case, settings: SharedSettings) {
    let mut connections = connections(NodeId::Inverse, settings);
    let mut inverse = Inverse::open(&mut connections);
    connections.start_barriers(&mut || inverse.answers.connect()).unwrap();
    case.check((0..case.ticks()).try_for_each(|tick| inverse.tick(tick)));
}

/// The controller's side; it stays until the other one, which `join` waits for, has ended.
fn controller(case: Case, settings: SharedSettings, join: impl FnOnce()) {
    let mut connections = connections(NodeId::Controller, settings);
    let mut controller = Controller::open(&mut connections);
    connections
        .start_barriers(&mut || controller.demands.connect())
        .unwrap();
    for tick in 0..case.ticks() {
        controller.tick(case, tick);
    }
    join();
    let taken = if case == Case::Whole { case.ticks() - 1 } else { 0 };
    assert_eq!(controller.answers.report().latency.count, taken);
}

#[test]
fn over_memory_cells() {
    for case in Case::ALL {
        let mut connections = Connections::new([NodeId::Controller, NodeId::Inverse], WIRES.to_vec(), None);
        let mut controller = Controller::open(&mut connections);
        let mut inverse = Inverse::open(&mut connections);
        case.check((0..case.ticks()).try_for_each(|tick| {
            controller.tick(case, tick);
            inverse.tick(tick)
        }));
    }
}

#[test]
fn over_iceoryx2_between_threads() {
    for case in Case::ALL {
        let memory = SharedMemory::unique();
        let settings = memory.settings("inverse", &PROCESSES, case.limit());
        let worker = std::thread::spawn(move || inverse(case, settings));
        let own = memory.settings("controller", &PROCESSES, case.limit());
        controller(case, own, || worker.join().unwrap());
        left_as_found(&memory);
    }
}

/// Where the inverse of [`over_iceoryx2_between_processes`] finds the other one: the case's number, prefix and root.
const OTHER: [&str; 3] = ["LINKS_CASE", "LINKS_PREFIX", "LINKS_ROOT"];

#[test]
fn over_iceoryx2_between_processes() {
    for (number, case) in Case::ALL.into_iter().enumerate() {
        let memory = SharedMemory::unique();
        let (number, root) = (number.to_string(), memory.root.to_string_lossy());
        let mut other = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "the_other_process"])
            .envs(OTHER.into_iter().zip([&*number, &memory.prefix, &root]))
            .spawn()
            .unwrap();
        let own = memory.settings("controller", &PROCESSES, case.limit());
        controller(case, own, || assert!(other.wait().unwrap().success()));
        left_as_found(&memory);
    }
}

/// Not a test of its own: the process that [`over_iceoryx2_between_processes`] starts.
#[test]
fn the_other_process() {
    let [Ok(number), Ok(prefix), Ok(root)] = OTHER.map(std::env::var) else {
        return;
    };
    let case = Case::ALL[number.parse::<usize>().unwrap()];
    let root = root.into();
    let memory = std::mem::ManuallyDrop::new(SharedMemory { prefix, root });
    inverse(case, memory.settings("inverse", &PROCESSES, case.limit()));
}

/// What remains is iceoryx2's 16-byte management file of the prefix, which only the launcher removes.
fn left_as_found(memory: &SharedMemory) {
    let mut left = memory.files();
    left.retain(|name| !name.contains("global_mgmt"));
    assert_eq!(left, Vec::<String>::new());
}

/// Runs a reader that is paced by demands, and what sends them; both get the moment at which tick 0 begins.
fn paced<T: Send>(
    period: Duration,
    reader: impl FnOnce(&mut Receiver<Demand>, &Pace) -> T + Send,
    sender: impl FnOnce(&mut Sender<Demand>, u64),
) -> T {
    let memory = SharedMemory::unique();
    let limit = Duration::from_secs(20);
    let settings = memory.settings("inverse", &PROCESSES, limit);
    let (connected, done) = (&Barrier::new(2), &Barrier::new(2));
    let began_ns = &std::sync::OnceLock::new();
    std::thread::scope(|scope| {
        let reading = scope.spawn(move || {
            let pace = Rc::new(Pace::new(&[NodeId::Inverse], period, true));
            let mut connections =
                connections(NodeId::Inverse, settings).with_discipline(Discipline::Newest(pace.clone()));
            let mut demands = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
            connections.start_barriers(&mut || Ok(())).unwrap();
            connected.wait();
            pace.anchor(0, *began_ns.get_or_init(monotonic_ns));
            let read = reader(&mut demands, &pace);
            done.wait();
            read
        });
        let mut connections = connections(NodeId::Controller, memory.settings("controller", &PROCESSES, limit));
        let mut demands = connections.sender::<Demand>().unwrap();
        connections.start_barriers(&mut || demands.connect()).unwrap();
        connected.wait();
        sender(&mut demands, *began_ns.get_or_init(monotonic_ns));
        done.wait();
        reading.join().unwrap()
    })
}

/// Guards real time against a token with a false tick: its reader waited for that tick, deaf, and a loop that is paced by its
/// tokens turned to it, past the end of the run.
#[test]
fn a_token_from_the_future_is_passed_over() {
    for false_tick in [43, 1_000_003] {
        let sent = Barrier::new(2);
        let heard = paced(
            Duration::from_secs(1),
            |demands, pace| {
                sent.wait();
                [0, 1, 2, 3, 4, 5].map(|tick| (demands.receive(tick).unwrap().tick, pace.present(tick)))
            },
            |demands, _| {
                for tick in [0, 1, 2, false_tick, 4, 5] {
                    demands.send(demand(tick)).unwrap();
                }
                sent.wait();
            },
        );
        // Of tick 3 there is no token; that 4 has come tells.
        assert_eq!(heard, [(0, 1), (1, 2), (2, 4), (2, 4), (4, 5), (5, 5)]);
    }
}

/// Guards a loop paced by hardware that stops for 0.8 of a tick: its reader timed out on every token from then on, because the
/// last one in time said when the next were due.
#[test]
fn a_clock_that_slips_is_followed() {
    let period = Duration::from_millis(200);
    let heard = paced(
        period,
        |demands, _| [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|tick| demands.receive(tick).unwrap().tick == tick),
        |demands, began_ns| {
            for tick in 0..9 {
                let slip = if tick < 2 { 0.0 } else { 0.8 };
                let due_ns = began_ns + period.mul_f64(tick as f64 + slip).as_nanos() as u64;
                std::thread::sleep(Duration::from_nanos(due_ns.saturating_sub(monotonic_ns())));
                demands.send(demand(tick)).unwrap();
            }
        },
    );
    // A machine that stands still for half a tick may make some of them late, too.
    assert!(!heard[2] && heard[4..].contains(&true), "{heard:?}");
}

/// Guards the waking of sleepers: a reader that is not notified finds its token when it looks up by itself, and says so; not while its
/// sender may only have been kept from the core between sending and notifying.
#[test]
fn a_lost_notification_is_counted() {
    // A sender that does not know in which process its reader lives notifies nobody.
    const NOBODY: [(&str, &[NodeId]); 2] = [PROCESSES[0], ("inverse", &[])];
    for (known, finished, lost) in [(PROCESSES, true, 0), (NOBODY, true, 1), (NOBODY, false, 0)] {
        let memory = SharedMemory::unique();
        let settings = |process: &str, processes| memory.settings(process, processes, Duration::from_secs(20));
        let [own, theirs] = [settings("inverse", &PROCESSES), settings("controller", &known)];
        let done = Barrier::new(2);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let context = Rc::new(SharedContext::open(own).unwrap());
                let mut connections = Connections::new([NodeId::Inverse], WIRES.to_vec(), Some(context.clone()));
                let mut demands = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
                connections.start_barriers(&mut || Ok(())).unwrap();
                demands.receive(0).unwrap();
                done.wait();
                assert_eq!(context.lost_notifications(), lost);
            });
            let context = Rc::new(SharedContext::open(theirs).unwrap());
            let mut connections = Connections::new([NodeId::Controller], WIRES.to_vec(), Some(context.clone()));
            let mut demands = connections.sender::<Demand>().unwrap();
            connections.start_barriers(&mut || demands.connect()).unwrap();
            // By then the reader sleeps, and not for the first time: for the last time in a piece of its wait.
            std::thread::sleep(MAX_PIECE - Duration::from_millis(10));
            demands.send(demand(0)).unwrap();
            if finished {
                context.set_tick(1);
            }
            done.wait();
        });
    }
}

/// Guards a run on a busy machine: who has just begun may be slow with its first token, and with no other.
#[test]
fn the_first_token_may_take_longer_than_others() {
    let memory = SharedMemory::unique();
    let limit = Duration::from_secs(1);
    let settings = |process: &str| memory.settings(process, &PROCESSES, limit);
    let [own, theirs] = ["inverse", "controller"].map(settings);
    let done = Barrier::new(2);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let context = Rc::new(SharedContext::open(own).unwrap());
            let mut connections = Connections::new([NodeId::Inverse], WIRES.to_vec(), Some(context));
            let mut demands = connections.receiver::<Demand>(NodeId::Inverse, 0).unwrap();
            connections.start_barriers(&mut || Ok(())).unwrap();
            let heard = [0, 1].map(|tick| demands.receive(tick).map(|demand| demand.tick));
            done.wait();
            assert_eq!(heard[0], Ok(0));
            assert!(matches!(heard[1], Err(LinkError::Silent { tick: 1, .. })), "{heard:?}");
        });
        let context = Rc::new(SharedContext::open(theirs).unwrap());
        let mut connections = Connections::new([NodeId::Controller], WIRES.to_vec(), Some(context));
        let mut demands = connections.sender::<Demand>().unwrap();
        connections.start_barriers(&mut || demands.connect()).unwrap();
        std::thread::sleep(2 * limit);
        demands.send(demand(0)).unwrap();
        done.wait();
    });
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

/// Guards the layout hash: same size and field types, other names, other type name.
#[test]
fn type_names_carry_the_fields() {
    let names = [Demand::TYPE_NAME, Measurement::TYPE_NAME];
    assert!(names[0].starts_with("Demand_") && names[0].len() == "Demand_".len() + 16);
    assert_ne!(names[0].split('_').next_back(), names[1].split('_').next_back());
}

#[test]
fn words_keep_every_bit() {
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
}
