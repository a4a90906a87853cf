//! A block and its wiring. `Inputs` and `Outputs` are tuples of tokens; [`Now`] reads the token of this tick, [`Previous`]
//! that of the tick before (at tick 0: the default token, all zero). The graph of the loop follows from these types alone.

use crate::change::Change;
use crate::error::LinkError;
use crate::link::{Connections, Receiver, Sender};
use crate::message::{Channel, Message, NodeId};
use crate::statistics::LinkReport;
use crate::wire::Wire;

/// A pure state machine: its own state and its inputs in, its outputs out; no clock, no I/O, no randomness of its own.
pub trait Block {
    /// Who it is in the loop.
    const NODE: NodeId;
    /// What it reads: a tuple of [`Now`] and [`Previous`].
    type Inputs: Inputs;
    /// What it sends: a tuple of messages.
    type Outputs: Outputs;
    /// Advances to tick `tick`. Ticks of outputs are stamped by the node.
    fn step(&mut self, tick: u64, inputs: Self::Inputs) -> Self::Outputs;
    /// Takes a change of one of its settings, between two ticks; false if it is none of them, or there is no room for more.
    fn change(&mut self, change: &Change) -> bool {
        let _ = change;
        false
    }
    /// A tick that the process left out because it was held up, with what the others said in it: it changes what the block
    /// remembers, and nothing is answered. Blocks whose memory does not depend on every tick do nothing.
    fn follow(&mut self, tick: u64, inputs: Self::Inputs) {
        let _ = (tick, inputs);
    }
    /// A tick in which nobody is heard any more, because the links have failed: what leads to the safe state. `None` once
    /// that is reached, and from blocks that cannot harm anything.
    fn alone(&mut self, tick: u64) -> Option<Self::Outputs> {
        let _ = tick;
        None
    }
    /// What the next run may begin with, as JSON.
    fn memory(&self) -> Option<String> {
        None
    }
}

/// The token of this tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Now<M>(pub M);

/// The token of the tick before; at tick 0 the default token.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Previous<M>(pub M);

/// One input of a block.
pub trait Edge: Copy {
    /// What travels.
    type Message: Message;
    /// By how many ticks it is late: 0 or 1.
    const DELAY: u64;
    /// Wraps the token.
    fn from_token(token: Self::Message) -> Self;
}

impl<M: Message> Edge for Now<M> {
    type Message = M;
    const DELAY: u64 = 0;
    #[inline(always)]
    fn from_token(token: M) -> Self {
        Self(token)
    }
}

impl<M: Message> Edge for Previous<M> {
    type Message = M;
    const DELAY: u64 = 1;
    #[inline(always)]
    fn from_token(token: M) -> Self {
        Self(token)
    }
}

/// Is told of a token that was taken: its tick, and what writes its fields.
pub type Note<'a> = dyn FnMut(u32, &dyn Fn(&mut [u64])) + 'a;

/// A tuple of edges.
pub trait Inputs: Sized {
    /// The opened links.
    type Receivers;
    /// Opens the links for `reader`.
    fn open(reader: NodeId, connections: &mut Connections) -> Result<Self::Receivers, LinkError>;
    /// True if all tokens of `tick` are here, within one process in lockstep.
    fn are_here(receivers: &Self::Receivers, tick: u64) -> bool;
    /// Those tokens.
    fn here(receivers: &Self::Receivers) -> Self;
    /// Takes the tokens of `tick`, waiting for them.
    fn receive(receivers: &mut Self::Receivers, tick: u64) -> Result<Self, LinkError>;
    /// The tokens of a tick that was left out, as far as they are there: nobody is waited for.
    fn receive_left_out(receivers: &mut Self::Receivers, tick: u64) -> Result<Self, LinkError>;
    /// The tokens taken last, for a log: the tick of each, and what writes its fields.
    fn taken(receivers: &Self::Receivers, note: &mut Note);
    /// What the links measured.
    fn reports(receivers: &Self::Receivers) -> Vec<LinkReport>;
    /// The arrows into `reader`.
    fn wires(reader: NodeId) -> Vec<Wire>;
}

/// A tuple of messages.
pub trait Outputs {
    /// The opened links.
    type Senders;
    /// Opens the links.
    fn open(connections: &mut Connections) -> Result<Self::Senders, LinkError>;
    /// Stamps and sends every token; each is shown to `seen` first.
    fn send(self, senders: &mut Self::Senders, tick: u64, seen: &mut impl Seen) -> Result<(), LinkError>;
    /// Shows every token as [`Outputs::send`] does, and sends none.
    fn show(self, tick: u64, seen: &mut impl Seen);
    /// Connects to the readers that have appeared.
    fn connect(senders: &mut Self::Senders) -> Result<(), LinkError>;
    /// The channels sent.
    fn channels() -> Vec<Channel>;
}

/// Sees every token before it is sent: the digest, and injected faults.
pub trait Seen {
    /// Stamps the token of `tick`; may change its fields, and its stamp.
    fn see<M: Message>(&mut self, tick: u64, token: &mut M);
}

/// The arrows into a block.
pub fn wiring<B: Block>() -> Vec<Wire> {
    B::Inputs::wires(B::NODE)
}

macro_rules! tuples {
    ($($edge:ident $receiver:ident),*) => {
        impl<$($edge: Edge),*> Inputs for ($($edge,)*) {
            type Receivers = ($(Receiver<$edge::Message>,)*);
            fn open(reader: NodeId, connections: &mut Connections) -> Result<Self::Receivers, LinkError> {
                Ok(($(connections.receiver::<$edge::Message>(reader, $edge::DELAY)?,)*))
            }
            #[inline(always)]
            fn are_here(($($receiver,)*): &Self::Receivers, tick: u64) -> bool {
                $($receiver.is_here(tick))&&*
            }
            #[inline(always)]
            fn here(($($receiver,)*): &Self::Receivers) -> Self {
                ($($edge::from_token($receiver.here()),)*)
            }
            fn receive(($($receiver,)*): &mut Self::Receivers, tick: u64) -> Result<Self, LinkError> {
                Ok(($($edge::from_token($receiver.receive(tick)?),)*))
            }
            fn receive_left_out(($($receiver,)*): &mut Self::Receivers, tick: u64) -> Result<Self, LinkError> {
                Ok(($($edge::from_token($receiver.receive_left_out(tick)?),)*))
            }
            fn taken(($($receiver,)*): &Self::Receivers, note: &mut Note) {
                $(note($receiver.taken(), &|words| $receiver.write_taken(words));)*
            }
            fn reports(($($receiver,)*): &Self::Receivers) -> Vec<LinkReport> {
                vec![$($receiver.report()),*]
            }
            fn wires(reader: NodeId) -> Vec<Wire> {
                vec![$(Wire { channel: $edge::Message::CHANNEL, reader, delay: $edge::DELAY }),*]
            }
        }
    };
}
tuples!(A a);
tuples!(A a, B b);
tuples!(A a, B b, C c);
tuples!(A a, B b, C c, D d);
tuples!(A a, B b, C c, D d, E e, F f, G g);

macro_rules! output_tuples {
    ($($message:ident $sender:ident $token:ident),*) => {
        impl<$($message: Message),*> Outputs for ($($message,)*) {
            type Senders = ($(Sender<$message>,)*);
            #[allow(unused_variables, reason = "the empty tuple sends nothing")]
            fn open(connections: &mut Connections) -> Result<Self::Senders, LinkError> {
                Ok(($(connections.sender::<$message>()?,)*))
            }
            #[inline(always)]
            #[allow(unused_variables, reason = "the empty tuple sends nothing")]
            fn send(self, ($($sender,)*): &mut Self::Senders, tick: u64, seen: &mut impl Seen) -> Result<(), LinkError> {
                let ($(mut $token,)*) = self;
                #[allow(unused_mut, reason = "the empty tuple sends nothing")]
                let mut outcome = Ok(());
                $(
                    seen.see(tick, &mut $token);
                    // All are sent even if one fails: at the end of a run some readers may be gone before others.
                    if let Err(refused) = $sender.send($token) {
                        outcome = outcome.and(Err(refused));
                    }
                )*
                outcome
            }
            #[allow(unused_variables, reason = "the empty tuple shows nothing")]
            fn show(self, tick: u64, seen: &mut impl Seen) {
                let ($(mut $token,)*) = self;
                $(seen.see(tick, &mut $token);)*
            }
            fn connect(($($sender,)*): &mut Self::Senders) -> Result<(), LinkError> {
                $($sender.connect()?;)*
                Ok(())
            }
            fn channels() -> Vec<Channel> {
                vec![$($message::CHANNEL),*]
            }
        }
    };
}
output_tuples!();
output_tuples!(A sa a);
output_tuples!(A sa a, B sb b);
