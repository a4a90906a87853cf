//! The two ends of a channel between processes, without the type of its tokens.

use super::context::SharedContext;
use super::iceoryx::{channel_name, refused, retry};
use super::names::{DEEPEST_BUFFER, LOOP_BUFFER, MAX_BORROWED, MAX_NODES, MAX_PUBLISHERS, MAX_SUBSCRIBERS};
use super::status::TokenWait;
use super::waker::{Awaited, Peer, notify_sleepers};
use crate::clock::monotonic_ns;
use crate::error::LinkError;
use crate::message::{Channel, Message, NodeId};
use crate::newest::Newest;
use crate::pace::Pace;
use crate::raw::RawToken;
use crate::stop::stop_requested;
use crate::with_message;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::rc::Rc;
use std::time::Duration;

/// The longest piece of a wait, and the most that one counts however long it lasted.
pub const MAX_PIECE: Duration = Duration::from_millis(100);

/// The first token may take so many times as long: a process that has just begun has its code and its memory yet to touch.
const FIRST_TOKEN_TIMES: u32 = 5;

/// A subscriber of iceoryx2, whatever its type.
pub(super) trait Subscribed {
    /// A token if one is there.
    fn poll(&self) -> Result<Option<RawToken>, LinkError>;
}

impl<M: Message> Subscribed for Subscriber<ipc::Service, M, ()> {
    fn poll(&self) -> Result<Option<RawToken>, LinkError> {
        // The sentence is made only if it is needed: this is every poll of every reader.
        let sample = self
            .receive()
            .map_err(|error| refused(format!("receive {}", M::CHANNEL))(error))?;
        Ok(sample.map(|sample| RawToken::of(&*sample)))
    }
}

/// A publisher of iceoryx2, whatever its type.
trait Published {
    fn connect(&self) -> Result<(), LinkError>;
    /// The names of those who read.
    fn readers(&self) -> Vec<String>;
    /// Says how many readers the token has reached.
    fn publish(&self, token: &RawToken) -> Result<usize, LinkError>;
}

struct Typed<M: Message> {
    publisher: Publisher<ipc::Service, M, ()>,
    service: PortFactory<ipc::Service, M, ()>,
}

impl<M: Message> Published for Typed<M> {
    fn connect(&self) -> Result<(), LinkError> {
        let connected = self.publisher.update_connections();
        connected.map_err(refused(format!("connect the readers of {}", M::CHANNEL)))
    }

    fn readers(&self) -> Vec<String> {
        let mut names = Vec::new();
        self.service.dynamic_config().list_subscribers(|subscriber| {
            names.push(subscriber.subscriber_name.to_string());
            CallbackProgression::Continue
        });
        names
    }

    fn publish(&self, token: &RawToken) -> Result<usize, LinkError> {
        let sample = self
            .publisher
            .loan_uninit()
            .map_err(|error| refused(format!("lend memory for {}", M::CHANNEL))(error))?;
        // A channel has one message type: the token is of it.
        let sent = sample.write_payload(token.typed::<M>().unwrap_or_default()).send();
        sent.map_err(|error| refused(format!("send {}", M::CHANNEL))(error))
    }
}

fn open_channel<M: Message>(node: &Node<ipc::Service>) -> Result<PortFactory<ipc::Service, M, ()>, LinkError> {
    let name = channel_name(M::CHANNEL)?;
    // While another process creates or cleans the same service, opening fails for a moment.
    retry(true, || {
        node.service_builder(&name)
            .publish_subscribe::<M>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(DEEPEST_BUFFER)
            .subscriber_max_borrowed_samples(MAX_BORROWED)
            .history_size(0)
            .max_publishers(MAX_PUBLISHERS)
            .max_subscribers(MAX_SUBSCRIBERS)
            .max_nodes(MAX_NODES)
            .open_or_create()
            .map_err(refused(format!("open the channel {}", M::CHANNEL)))
    })
}

/// A port of `reader` at `channel`, which keeps so many tokens.
pub(super) fn subscribe(
    node: &Node<ipc::Service>,
    channel: Channel,
    reader: &str,
    depth: usize,
) -> Result<Box<dyn Subscribed>, LinkError> {
    let name = PortName::new(reader).map_err(refused("name a subscriber"))?;
    with_message!(channel, M => {
        let service = open_channel::<M>(node)?;
        let created = service.subscriber_builder().name(&name).buffer_size(depth).create();
        Ok(Box::new(created.map_err(refused("create a subscriber"))?))
    })
}

fn publish(context: &SharedContext, channel: Channel) -> Result<Box<dyn Published>, LinkError> {
    with_message!(channel, M => {
        let service = open_channel::<M>(&context.node)?;
        // The only publisher of the channel may be that of a process that died: it is removed within moments.
        let publisher = retry(context.rejoins, || {
            let created = service.publisher_builder().create();
            created.map_err(refused("create a publisher"))
        })?;
        Ok(Box::new(Typed::<M> { publisher, service }))
    })
}

/// The sending end: publishes, and wakes the readers that sleep.
pub struct RawSender {
    port: Box<dyn Published>,
    channel: Channel,
    readers: Vec<Rc<Peer>>,
    expected: usize,
    /// In real time: where tokens that did not reach every reader are counted.
    pace: Option<Rc<Pace>>,
}

impl RawSender {
    pub fn open(
        context: &SharedContext,
        channel: Channel,
        readers: &[NodeId],
        pace: Option<Rc<Pace>>,
    ) -> Result<Self, LinkError> {
        Ok(Self {
            port: publish(context, channel)?,
            channel,
            readers: context.peers_of(readers),
            expected: readers.len(),
            pace,
        })
    }

    pub fn channel(&self) -> Channel {
        self.channel
    }

    /// Connects to whoever reads: for a process that does not know the loop's wiring. Readers bear their node's name.
    pub fn connect_to_all(&mut self, context: &SharedContext) -> Result<(), LinkError> {
        let names = self.port.readers();
        let readers: Vec<NodeId> = names.iter().filter_map(|name| NodeId::named(name)).collect();
        self.readers = context.peers_of(&readers);
        self.expected = readers.len();
        self.connect()
    }

    pub fn connect(&self) -> Result<(), LinkError> {
        self.port.connect()
    }

    pub fn send(&self, token: &RawToken) -> Result<(), LinkError> {
        let reached = self.port.publish(token)?;
        let Some(pace) = &self.pace else {
            if reached < self.expected {
                return Err(LinkError::Undelivered {
                    channel: self.channel,
                    tick: token.tick(),
                    reached,
                    expected: self.expected,
                });
            }
            return notify_sleepers(&self.readers, self.channel);
        };
        if reached < self.expected {
            pace.note_undelivered();
        }
        // A process that cannot be notified may have died just now: in real time that is no error of its sender.
        let _ = notify_sleepers(&self.readers, self.channel);
        Ok(())
    }
}

/// The reading end: waits for tokens.
pub struct RawReceiver {
    port: Box<dyn Subscribed>,
    channel: Channel,
    reader: NodeId,
    sender: Option<Rc<Peer>>,
    context: Rc<SharedContext>,
}

impl RawReceiver {
    pub fn open(context: &Rc<SharedContext>, channel: Channel, reader: NodeId) -> Result<Self, LinkError> {
        let depth = if reader == NodeId::Recorder {
            DEEPEST_BUFFER
        } else {
            LOOP_BUFFER
        };
        Ok(Self {
            port: subscribe(&context.node, channel, reader.name(), depth)?,
            channel,
            reader,
            sender: context.peer_of(channel.producer()).cloned(),
            context: context.clone(),
        })
    }

    /// A token if one is there.
    pub fn poll(&self) -> Result<Option<RawToken>, LinkError> {
        self.port.poll()
    }

    /// The next token, which must be that of `tick`; the caller checks.
    pub fn receive(&self, tick: u64) -> Result<RawToken, LinkError> {
        if let Some(token) = self.poll()? {
            return Ok(token);
        }
        // Whoever looks on can follow who waits for whom, also when the one that all wait for can say nothing any more.
        self.context.tell_wait(TokenWait {
            reader: self.reader,
            channel: self.channel,
            tick,
        });
        let start_ns = monotonic_ns();
        let times = if tick == 0 { FIRST_TOKEN_TIMES } else { 1 };
        let limit = times * self.context.receive_limit();
        let mut left = self.context.last_wait().unwrap_or(limit);
        let awaited = Awaited {
            late_is_lost: true,
            ..self.awaited(Some(tick))
        };
        // Piece by piece, none of which counts for longer than it was to last: while the machine stands still nobody can send.
        while !left.is_zero() {
            let piece = left.min(MAX_PIECE);
            let now_ns = monotonic_ns();
            let span = (now_ns, after(now_ns, piece));
            if let Some(token) = self.context.wait(span, &awaited, || self.poll())? {
                return Ok(token);
            }
            left -= piece;
        }
        Err(self.given_up(tick, start_ns))
    }

    /// Brings `newest` to `due`, waiting until `until_ns` of the monotonic clock for its token. On the way to the safe field
    /// time no longer decides, and silence is told, not borne.
    pub fn receive_newest(&self, newest: &mut Newest, due: u64, until_ns: u64) -> Result<(), LinkError> {
        let mut look = || Ok(newest.advance(due, monotonic_ns(), || self.poll())?.then_some(()));
        if look()?.is_some() {
            return Ok(());
        }
        let start_ns = monotonic_ns();
        let last_wait = self.context.last_wait();
        let until_ns = last_wait.map_or(until_ns, |limit| after(start_ns, limit));
        let settled = self
            .context
            .wait((start_ns, until_ns), &self.awaited(Some(due)), look)?
            .is_some();
        if settled || last_wait.is_none() && !stop_requested() {
            return Ok(());
        }
        Err(self.given_up(due, start_ns))
    }

    /// What `look` finds on this channel, or none within `limit`.
    pub fn wait<T>(
        &self,
        limit: Duration,
        mut look: impl FnMut() -> Result<Option<T>, LinkError>,
    ) -> Result<Option<T>, LinkError> {
        if let Some(found) = look()? {
            return Ok(Some(found));
        }
        let now_ns = monotonic_ns();
        self.context
            .wait((now_ns, after(now_ns, limit)), &self.awaited(None), look)
    }

    fn awaited(&self, tick: Option<u64>) -> Awaited {
        Awaited {
            channel: self.channel,
            sender: self.sender.clone(),
            tick,
            late_is_lost: false,
        }
    }

    #[cold]
    fn given_up(&self, tick: u64, start_ns: u64) -> LinkError {
        if self.context.last_wait().is_none() && stop_requested() {
            return LinkError::Stopped { tick };
        }
        LinkError::Silent {
            reader: self.reader,
            channel: self.channel,
            tick,
            waited_s: Duration::from_nanos(monotonic_ns() - start_ns).as_secs_f64(),
        }
    }
}

/// That moment of the monotonic clock, ns.
fn after(start_ns: u64, limit: Duration) -> u64 {
    start_ns.saturating_add(u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX))
}
