//! Guards memories against pauses: a node whose process is held up knows afterwards what it would know had it never been,
//! because it takes up the tokens of the ticks that it left out. Over iceoryx2, with every token of a cut, and without a clock.

use anhyst_ipc::{
    CoilField, Connections, Demand, Discipline, Estimate, FieldCommand, LinkError, MAX_FIELDS, Measurement, Message,
    NodeId, Pace, SafeField, Sender, SharedContext, SharedSettings, Wire, monotonic_ns,
};
use anhyst_launch::assemble;
use anhyst_scenario::{Scenario, load, wires};
use anhyst_tests::{SharedMemory, repository};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Barrier;
use std::time::Duration;

const TICKS: u64 = 1500;
/// Nothing here takes so long: no token is late.
const LIMIT: Duration = Duration::from_secs(60);

/// All that the nodes of this test are told in a cut.
#[derive(Default)]
struct Said {
    measurement: Vec<Measurement>,
    estimate: Vec<Estimate>,
    demand: Vec<Demand>,
    safe: Vec<SafeField>,
}

/// The first ticks of the scenario, in one process.
fn said(scenario: &Scenario) -> Said {
    let mut connections = Connections::new(NodeId::LOOP_ORDER, wires(), None);
    let mut stages = NodeId::SENDERS.map(|node| assemble::stage(node, scenario, &mut connections).unwrap());
    let mut said = Said::default();
    for tick in 0..TICKS {
        stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
        said.measurement.push(connections.last().unwrap());
        said.estimate.push(connections.last().unwrap());
        said.demand.push(connections.last().unwrap());
        said.safe.push(connections.last().unwrap());
    }
    said
}

/// Everybody but the node that is held up.
struct Others {
    measurement: Sender<Measurement>,
    estimate: Option<Sender<Estimate>>,
    demand: Sender<Demand>,
    safe: Sender<SafeField>,
}

impl Others {
    fn open(connections: &mut Connections, node: NodeId) -> Self {
        Self {
            measurement: connections.sender().unwrap(),
            estimate: (node != NodeId::Estimator).then(|| connections.sender().unwrap()),
            demand: connections.sender().unwrap(),
            safe: connections.sender().unwrap(),
        }
    }

    fn connect(&mut self) -> Result<(), LinkError> {
        self.measurement.connect()?;
        self.estimate.as_mut().map_or(Ok(()), Sender::connect)?;
        self.demand.connect()?;
        self.safe.connect()
    }

    fn say(&mut self, said: &Said, tick: usize) {
        self.measurement.send(said.measurement[tick]).unwrap();
        if let Some(estimate) = &mut self.estimate {
            estimate.send(said.estimate[tick]).unwrap();
        }
        self.demand.send(said.demand[tick]).unwrap();
        self.safe.send(said.safe[tick]).unwrap();
    }
}

fn connect(nodes: &[NodeId], settings: SharedSettings) -> Connections {
    let heard = |wire: &Wire| wire.reader != NodeId::Recorder;
    let context = Rc::new(SharedContext::open(settings).unwrap());
    Connections::new(
        nodes.iter().copied(),
        wires().into_iter().filter(heard).collect(),
        Some(context),
    )
}

/// What the node answers after its process has left out these ticks, which it takes up then or not; as bits.
fn answers<M: Message>(
    node: NodeId,
    scenario: &Scenario,
    said: &Said,
    left_out: &Range<u64>,
    follows: bool,
) -> Vec<[u64; MAX_FIELDS]> {
    let memory = SharedMemory::unique();
    let others: Vec<NodeId> = NodeId::SENDERS.into_iter().filter(|other| *other != node).collect();
    let processes = [("node", &[node][..]), ("others", &others[..])];
    let [own, theirs] = ["node", "others"].map(|name| memory.settings(name, &processes, LIMIT));
    let (sent, done) = (&Barrier::new(2), &Barrier::new(2));
    std::thread::scope(|scope| {
        let answers = scope.spawn(move || {
            let pace = Rc::new(Pace::new(&[node], LIMIT, false));
            let mut connections = connect(&[node], own).with_discipline(Discipline::Newest(pace.clone()));
            let mut stage = assemble::stage(node, scenario, &mut connections).unwrap();
            connections.start_barriers(&mut || stage.connect()).unwrap();
            pace.anchor(0, monotonic_ns());
            let mut answers = Vec::new();
            for tick in 0..TICKS {
                sent.wait();
                if tick == left_out.end && follows {
                    left_out.clone().for_each(|past| stage.follow(past).unwrap());
                }
                if !left_out.contains(&tick) {
                    stage.tick(tick).unwrap();
                }
                if tick >= left_out.end {
                    let mut words = [0; MAX_FIELDS];
                    connections.last::<M>().unwrap().write_words(&mut words);
                    answers.push(words);
                }
                done.wait();
            }
            answers
        });
        let mut connections = connect(&others, theirs);
        let mut speakers = Others::open(&mut connections, node);
        connections.start_barriers(&mut || speakers.connect()).unwrap();
        for tick in 0..TICKS {
            speakers.say(said, tick as usize);
            sent.wait();
            done.wait();
        }
        answers.join().unwrap()
    })
}

/// Twenty ticks around a turning point of the field: what is lost of it changes the hysteresis for good.
fn around_a_turn(safe: &[SafeField]) -> Range<u64> {
    let field = |tick: usize| safe[tick].field_a_per_m;
    let turns = |tick: &usize| (field(*tick) - field(tick - 1)) * (field(tick + 1) - field(*tick)) < 0.0;
    let turn = (800..safe.len() - 1).find(turns).unwrap() as u64;
    turn - 10..turn + 10
}

/// The answers after a pause have the bits of a node that was never held up, and other bits if it forgets what was said.
fn remembers<M: Message>(node: NodeId, scenario: &Scenario, said: &Said) {
    let left_out = around_a_turn(&said.safe);
    let none = left_out.end..left_out.end;
    let never_held_up = answers::<M>(node, scenario, said, &none, false);
    assert!(!never_held_up.is_empty());
    assert!(
        answers::<M>(node, scenario, said, &left_out, true) == never_held_up,
        "{node}"
    );
    assert!(
        answers::<M>(node, scenario, said, &left_out, false) != never_held_up,
        "{node}"
    );
}

#[test]
fn whoever_is_held_up_remembers_all_the_same() {
    let path = repository().join("scenarios/milling_heavy.ron");
    let scenario = load(&path, &[]).unwrap();
    let mut said = said(&scenario);
    remembers::<Estimate>(NodeId::Estimator, &scenario, &said);
    remembers::<CoilField>(NodeId::Amplifier, &scenario, &said);
    // Later the inverse needs its own memory of the material.
    let later = around_a_turn(&said.safe).end as usize + 50;
    for safe in &mut said.safe[later..] {
        safe.status |= SafeField::FALL_BACK;
    }
    remembers::<FieldCommand>(NodeId::Inverse, &scenario, &said);
}
