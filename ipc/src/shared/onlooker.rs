//! Hearing a run's tokens from outside, without taking part: nobody waits for an onlooker.
//!
//! Its ports overflow: what it does not fetch in time is overwritten, and its sender never knows. The first token after it came costs the
//! sender the mapping of one more queue.

use super::iceoryx::create_node;
use super::names::DEEPEST_BUFFER;
use super::ports::{Subscribed, subscribe};
use crate::error::LinkError;
use crate::message::Channel;
use crate::raw::RawToken;
use iceoryx2::prelude::{Node, ipc};
use std::path::Path;

/// No node's name, so that no sender counts it among its readers.
const NAME: &str = "onlooker";

/// Hears all channels of a run.
pub struct Onlooker {
    ports: Vec<Box<dyn Subscribed>>,
    // Last: the ports go before their node.
    _node: Node<ipc::Service>,
}

impl Onlooker {
    /// Joins the run with this prefix and root.
    ///
    /// # Errors
    /// If iceoryx2 refuses: a channel has room for a few readers only.
    pub fn open(prefix: &str, root: &Path) -> Result<Self, LinkError> {
        let node = create_node(prefix, root, NAME)?;
        let port = |channel: Channel| subscribe(&node, channel, NAME, DEEPEST_BUFFER);
        let ports = Channel::ALL.into_iter().map(port).collect::<Result<_, _>>()?;
        Ok(Self { ports, _node: node })
    }

    /// Hands over what has come since it was asked last, channel by channel in the order of ticks; how many tokens.
    ///
    /// # Errors
    /// If iceoryx2 refuses.
    pub fn hear(&self, mut hand_over: impl FnMut(RawToken)) -> Result<usize, LinkError> {
        let mut heard = 0;
        for port in &self.ports {
            while let Some(token) = port.poll()? {
                hand_over(token);
                heard += 1;
            }
        }
        Ok(heard)
    }
}
