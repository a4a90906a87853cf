//! Replays a lockstep run from its recording: every tick's tokens are those of the same tick.

use anhyst_ipc::{Channel, Discipline, Message, NodeId, TokenFault};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::run_again::{NodeAgain, Replayed, Tokens};
use anhyst_recorder::{Stretch, each_stretch};
use anhyst_scenario::Scenario;

/// One tick of a stretch.
struct Recorded<'a> {
    stretch: &'a Stretch,
    at: usize,
    faults: &'a [TokenFault],
}

impl Tokens for Recorded<'_> {
    /// With the tick that it was sent with: a recording has it in the tick in which it was heard.
    fn token<M: Message>(&self) -> Result<M, RunError> {
        let mut token: M = self.stretch.token(self.at);
        let mine = self.faults.iter().filter(|fault| fault.channel == M::CHANNEL);
        token.stamp(mine.fold(token.tick(), |tick, fault| fault.stamp(tick)), 0);
        Ok(token)
    }
}

/// A node that goes through the recording, up to the first difference.
struct Again {
    node: NodeId,
    again: NodeAgain,
    /// What comes before the node in a tick is fed before its step, what comes after it afterwards: a delayed input must still find the token
    /// of the tick before.
    inputs: [Vec<Channel>; 2],
    ticks: u64,
    difference: Option<String>,
}

impl Again {
    fn new(node: NodeId, scenario: &Scenario) -> Result<Self, RunError> {
        let mut inputs = anhyst_scenario::wires();
        inputs.retain(|wire| wire.reader == node);
        let inputs = inputs.into_iter().map(|wire| wire.channel);
        let (before, after) = inputs.partition(|channel| channel.producer() < node);
        Ok(Self {
            node,
            again: NodeAgain::new(node, scenario, Discipline::Lockstep)?,
            inputs: [before, after],
            ticks: 0,
            difference: None,
        })
    }

    fn go_on(&mut self, stretch: &Stretch, faults: &[TokenFault]) -> Result<(), RunError> {
        let [before, after] = &self.inputs;
        for at in 0..stretch.ticks() {
            if self.difference.is_some() {
                return Ok(());
            }
            let recorded = Recorded { stretch, at, faults };
            before.iter().try_for_each(|own| self.again.feed(*own, &recorded))?;
            self.again.stage.tick(self.ticks)?;
            for channel in Channel::ALL.into_iter().filter(|own| own.producer() == self.node) {
                let found = self.again.difference(channel, self.ticks, &recorded)?;
                self.difference = self.difference.take().or(found);
            }
            after.iter().try_for_each(|own| self.again.feed(*own, &recorded))?;
            self.ticks += u64::from(self.difference.is_none());
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
        ticks += stretch.ticks() as u64;
        again.iter_mut().try_for_each(|node| node.go_on(&stretch, &faults))
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
