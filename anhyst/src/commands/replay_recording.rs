//! Replays a lockstep run from its recording: every tick's tokens are those of the same tick.

use anhyst_ipc::{
    CoilField, Connections, Demand, Estimate, FieldCommand, Measurement, Message, NodeId, SafeField, Sender,
    TokenFault, Truth,
};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Replayed;
use anhyst_recorder::Recording;
use anhyst_scenario::Scenario;

/// Every token of a run, by tick.
pub struct Recorded {
    measurement: Vec<Measurement>,
    truth: Vec<Truth>,
    estimate: Vec<Estimate>,
    demand: Vec<Demand>,
    field_command: Vec<FieldCommand>,
    safe_field: Vec<SafeField>,
    coil_field: Vec<CoilField>,
}

impl Recorded {
    /// Reads the recording of a run.
    ///
    /// # Errors
    /// If it is missing or cannot be read, or a fault of the scenario makes no sense.
    pub fn read(folder: &RunFolder, scenario: &Scenario) -> Result<Self, RunError> {
        let recording = Recording::open(&folder.recording())?;
        let faults = scenario.token_faults()?;
        Ok(Self {
            measurement: as_stamped(recording.tokens()?, &faults),
            truth: as_stamped(recording.tokens()?, &faults),
            estimate: as_stamped(recording.tokens()?, &faults),
            demand: as_stamped(recording.tokens()?, &faults),
            field_command: as_stamped(recording.tokens()?, &faults),
            safe_field: as_stamped(recording.tokens()?, &faults),
            coil_field: as_stamped(recording.tokens()?, &faults),
        })
    }

    /// Ticks that all channels have: a run that was cut short may have recorded more of one than of another.
    pub fn ticks(&self) -> usize {
        let lengths = [
            self.measurement.len(),
            self.truth.len(),
            self.estimate.len(),
            self.demand.len(),
            self.field_command.len(),
            self.safe_field.len(),
            self.coil_field.len(),
        ];
        lengths.into_iter().min().unwrap_or_default()
    }
}

/// The tokens with the ticks that they were sent with: a recording has them in the ticks in which they were heard.
fn as_stamped<M: Message>(mut tokens: Vec<M>, faults: &[TokenFault]) -> Vec<M> {
    for token in &mut tokens {
        let mine = faults.iter().filter(|fault| fault.channel == M::CHANNEL);
        token.stamp(mine.fold(token.tick(), |tick, fault| fault.stamp(tick)), 0);
    }
    tokens
}

/// One channel of the replay: the recorded token is fed before the node steps, and what the node sends compared after.
struct Feed<'a, M: Message> {
    sender: Sender<M>,
    recorded: &'a [M],
}

impl<'a, M: Message> Feed<'a, M> {
    fn open(connections: &mut Connections, recorded: &'a [M]) -> Result<Self, RunError> {
        Ok(Self {
            sender: connections.sender::<M>()?,
            recorded,
        })
    }

    fn send(&mut self, tick: usize) -> Result<(), RunError> {
        Ok(self.sender.send(self.recorded[tick])?)
    }

    fn difference(&self, tick: usize, connections: &mut Connections) -> Option<String> {
        let sent = connections.last::<M>()?;
        let (mut now, mut then) = ([0; anhyst_ipc::MAX_FIELDS], [0; anhyst_ipc::MAX_FIELDS]);
        sent.write_words(&mut now);
        self.recorded[tick].write_words(&mut then);
        let field = M::FIELDS
            .iter()
            .zip(now.iter().zip(&then))
            .find(|(_, (now, then))| now != then)?
            .0;
        Some(format!(
            "tick {tick}, {} of {}: {:?} recorded, {:?} replayed",
            field.name,
            M::CHANNEL,
            self.recorded[tick],
            sent
        ))
    }
}

/// Runs one node again.
///
/// # Errors
/// If the node cannot be built.
pub fn replay(node: NodeId, scenario: &Scenario, recorded: &Recorded) -> Result<Replayed, RunError> {
    // All producers count as local, so that the node's inputs are cells that we fill.
    let mut connections = Connections::new(NodeId::LOOP_ORDER, anhyst_scenario::wires(), None);
    connections.accept_any_tick(anhyst_launch::assemble::late_channels(scenario)?);
    let mut stage = anhyst_launch::assemble::stage(node, scenario, &mut connections)?;
    let mut measurement = Feed::open(&mut connections, &recorded.measurement)?;
    let mut truth = Feed::open(&mut connections, &recorded.truth)?;
    let mut estimate = Feed::open(&mut connections, &recorded.estimate)?;
    let mut demand = Feed::open(&mut connections, &recorded.demand)?;
    let mut field_command = Feed::open(&mut connections, &recorded.field_command)?;
    let mut safe_field = Feed::open(&mut connections, &recorded.safe_field)?;
    let mut coil_field = Feed::open(&mut connections, &recorded.coil_field)?;
    let ticks = recorded.ticks();
    for tick in 0..ticks {
        // What comes before the node in a tick is fed before its step, what comes after it afterwards: a delayed input must
        // still find the token of the tick before.
        let before = |channel: anhyst_ipc::Channel| channel.producer() < node;
        macro_rules! feed {
            ($wanted:expr; $($feed:ident: $message:ident),*) => {
                $( if before($message::CHANNEL) == $wanted && $message::CHANNEL.producer() != node { $feed.send(tick)?; } )*
            };
        }
        feed!(true; measurement: Measurement, truth: Truth, estimate: Estimate, demand: Demand, field_command: FieldCommand, safe_field: SafeField, coil_field: CoilField);
        stage.tick(tick as u64)?;
        let difference = match node {
            NodeId::Plant => measurement
                .difference(tick, &mut connections)
                .or_else(|| truth.difference(tick, &mut connections)),
            NodeId::Estimator => estimate.difference(tick, &mut connections),
            NodeId::Controller => demand.difference(tick, &mut connections),
            NodeId::Inverse => field_command.difference(tick, &mut connections),
            NodeId::Guard => safe_field.difference(tick, &mut connections),
            NodeId::Amplifier => coil_field.difference(tick, &mut connections),
            NodeId::Recorder => None,
        };
        if difference.is_some() {
            return Ok(Replayed {
                node,
                ticks: tick as u64,
                same: false,
                difference,
            });
        }
        feed!(false; measurement: Measurement, truth: Truth, estimate: Estimate, demand: Demand, field_command: FieldCommand, safe_field: SafeField, coil_field: CoilField);
    }
    Ok(Replayed {
        node,
        ticks: ticks as u64,
        same: true,
        difference: None,
    })
}
