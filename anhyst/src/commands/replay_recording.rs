//! Replays a lockstep run from its recording: every tick's tokens are those of the same tick.

use anhyst_ipc::{
    CoilField, Connections, Demand, Estimate, FieldCommand, Measurement, Message, NodeId, SafeField, Sender, Stage,
    TokenFault, Truth,
};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::realtime::Replayed;
use anhyst_recorder::{Stretch, each_stretch};
use anhyst_scenario::Scenario;

/// Every token of a stretch of a run.
struct Recorded {
    measurement: Vec<Measurement>,
    truth: Vec<Truth>,
    estimate: Vec<Estimate>,
    demand: Vec<Demand>,
    field_command: Vec<FieldCommand>,
    safe_field: Vec<SafeField>,
    coil_field: Vec<CoilField>,
}

impl Recorded {
    fn of(stretch: &Stretch, faults: &[TokenFault]) -> Self {
        Self {
            measurement: as_stamped(stretch.tokens(), faults),
            truth: as_stamped(stretch.tokens(), faults),
            estimate: as_stamped(stretch.tokens(), faults),
            demand: as_stamped(stretch.tokens(), faults),
            field_command: as_stamped(stretch.tokens(), faults),
            safe_field: as_stamped(stretch.tokens(), faults),
            coil_field: as_stamped(stretch.tokens(), faults),
        }
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

/// The token that a node sent is not the recorded one.
fn difference<M: Message>(tick: u64, recorded: &M, connections: &mut Connections) -> Option<String> {
    let sent = connections.last::<M>()?;
    let (mut now, mut then) = ([0; anhyst_ipc::MAX_FIELDS], [0; anhyst_ipc::MAX_FIELDS]);
    sent.write_words(&mut now);
    recorded.write_words(&mut then);
    let field = M::FIELDS
        .iter()
        .zip(now.iter().zip(&then))
        .find(|(_, (now, then))| now != then)?
        .0;
    Some(format!(
        "tick {tick}, {} of {}: {recorded:?} recorded, {sent:?} replayed",
        field.name,
        M::CHANNEL,
    ))
}

/// A node that runs again: the recorded tokens of the others are fed before it steps, and what it sends is compared after.
struct Again {
    node: NodeId,
    connections: Connections,
    stage: Box<dyn Stage>,
    measurement: Sender<Measurement>,
    truth: Sender<Truth>,
    estimate: Sender<Estimate>,
    demand: Sender<Demand>,
    field_command: Sender<FieldCommand>,
    safe_field: Sender<SafeField>,
    coil_field: Sender<CoilField>,
    ticks: u64,
    difference: Option<String>,
}

impl Again {
    fn new(node: NodeId, scenario: &Scenario) -> Result<Self, RunError> {
        // All producers count as local, so that the node's inputs are cells that we fill.
        let mut connections = Connections::new(NodeId::LOOP_ORDER, anhyst_scenario::wires(), None);
        connections.accept_any_tick(anhyst_launch::assemble::late_channels(scenario)?);
        Ok(Self {
            node,
            stage: anhyst_launch::assemble::stage(node, scenario, &mut connections)?,
            measurement: connections.sender()?,
            truth: connections.sender()?,
            estimate: connections.sender()?,
            demand: connections.sender()?,
            field_command: connections.sender()?,
            safe_field: connections.sender()?,
            coil_field: connections.sender()?,
            connections,
            ticks: 0,
            difference: None,
        })
    }

    /// Goes through a stretch, up to the first difference.
    fn go_on(&mut self, recorded: &Recorded) -> Result<(), RunError> {
        for at in 0..recorded.measurement.len() {
            if self.difference.is_some() {
                return Ok(());
            }
            let (node, tick) = (self.node, self.ticks);
            // What comes before the node in a tick is fed before its step, what comes after it afterwards: a delayed input must
            // still find the token of the tick before.
            macro_rules! feed {
                ($wanted:expr; $($channel:ident: $message:ident),*) => {
                    $( if ($message::CHANNEL.producer() < node) == $wanted && $message::CHANNEL.producer() != node {
                        self.$channel.send(recorded.$channel[at])?;
                    } )*
                };
            }
            feed!(true; measurement: Measurement, truth: Truth, estimate: Estimate, demand: Demand, field_command: FieldCommand, safe_field: SafeField, coil_field: CoilField);
            self.stage.tick(tick)?;
            let sent = &mut self.connections;
            self.difference = match node {
                NodeId::Plant => difference(tick, &recorded.measurement[at], sent)
                    .or_else(|| difference(tick, &recorded.truth[at], sent)),
                NodeId::Estimator => difference(tick, &recorded.estimate[at], sent),
                NodeId::Controller => difference(tick, &recorded.demand[at], sent),
                NodeId::Inverse => difference(tick, &recorded.field_command[at], sent),
                NodeId::Guard => difference(tick, &recorded.safe_field[at], sent),
                NodeId::Amplifier => difference(tick, &recorded.coil_field[at], sent),
                NodeId::Recorder => None,
            };
            if self.difference.is_none() {
                feed!(false; measurement: Measurement, truth: Truth, estimate: Estimate, demand: Demand, field_command: FieldCommand, safe_field: SafeField, coil_field: CoilField);
                self.ticks += 1;
            }
        }
        Ok(())
    }
}

/// Runs nodes again, part by part of the recording; also how many ticks it holds.
///
/// # Errors
/// If a node cannot be built, the recording cannot be read, or ticks are missing in it.
pub fn replay(nodes: &[NodeId], scenario: &Scenario, folder: &RunFolder) -> Result<(Vec<Replayed>, u64), RunError> {
    let faults = scenario.token_faults()?;
    let again = nodes.iter().map(|node| Again::new(*node, scenario));
    let mut again = again.collect::<Result<Vec<_>, _>>()?;
    let mut ticks = 0;
    each_stretch(&folder.recordings(), |stretch| {
        if stretch.first() != ticks {
            return Err(RunError::Setup(format!(
                "{}: after {ticks} ticks the recording goes on with tick {}, and a node can be run again only from tick 0 on \
                 (`recording.ring_s` keeps no more than what surrounds events)",
                folder.path().display(),
                stretch.first()
            )));
        }
        let recorded = Recorded::of(&stretch, &faults);
        ticks += recorded.measurement.len() as u64;
        again.iter_mut().try_for_each(|node| node.go_on(&recorded))
    })?;
    if ticks == 0 {
        return Err(RunError::Setup(format!(
            "{}: the recording holds no ticks",
            folder.path().display()
        )));
    }
    let replayed = again.into_iter().map(|node| Replayed {
        node: node.node,
        ticks: node.ticks,
        same: node.difference.is_none(),
        difference: node.difference,
    });
    Ok((replayed.collect(), ticks))
}
