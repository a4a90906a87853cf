//! The two ends of a channel between processes.

use super::context::{Peer, SharedContext, Wait};
use super::names::{DEEPEST_BUFFER, LOOP_BUFFER, MOST_BORROWED, MOST_NODES, MOST_PUBLISHERS, MOST_SUBSCRIBERS};
use super::status::TokenWait;
use super::{channel_name, refused};
use crate::newest::Newest;
use crate::pace::Pace;
use crate::{Channel, LinkError, Message, NodeId, monotonic_ns, stop_requested};
use iceoryx2::port::listener::ListenerWaitError;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::rc::Rc;
use std::sync::atomic::{Ordering, fence};
use std::time::{Duration, Instant};

/// A sleeper looks up at least this often: for a request to stop, and should a bell be missed.
const LONGEST_NAP: Duration = Duration::from_millis(20);

/// How often a process that took the place of one that died looks for tokens.
const REJOINED_POLL: Duration = Duration::from_micros(20);

pub(super) fn open_channel<M: Message>(context: &SharedContext) -> Result<PortFactory<ipc::Service, M, ()>, LinkError> {
    let channel = M::CHANNEL;
    let name = channel_name(channel)?;
    let start = Instant::now();
    loop {
        let opened = context
            .node
            .service_builder(&name)
            .publish_subscribe::<M>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(DEEPEST_BUFFER)
            .subscriber_max_borrowed_samples(MOST_BORROWED)
            .history_size(0)
            .max_publishers(MOST_PUBLISHERS)
            .max_subscribers(MOST_SUBSCRIBERS)
            .max_nodes(MOST_NODES)
            .open_or_create();
        match opened {
            Ok(service) => return Ok(service),
            // While another process creates or cleans the same service, opening fails for a moment.
            Err(_) if start.elapsed() < Duration::from_secs(2) => std::thread::sleep(Duration::from_millis(2)),
            Err(error) => return Err(refused(format!("open the channel {channel}"))(error)),
        }
    }
}

/// The sending end: publishes, and wakes the readers that sleep.
pub struct SharedSender<M: Message> {
    publisher: Publisher<ipc::Service, M, ()>,
    service: PortFactory<ipc::Service, M, ()>,
    readers: Vec<Rc<Peer>>,
    expected: usize,
    channel: Channel,
    /// In real time: where tokens that did not reach every reader are counted.
    pace: Option<Rc<Pace>>,
}

impl<M: Message> SharedSender<M> {
    pub fn open(context: &Rc<SharedContext>, readers: &[NodeId], pace: Option<Rc<Pace>>) -> Result<Self, LinkError> {
        let service = open_channel::<M>(context)?;
        // The only publisher of the channel may be that of a process that died: it is removed within moments.
        let publisher = super::patiently(context.rejoins, || {
            let created = service.publisher_builder().create();
            created.map_err(refused("create a publisher"))
        })?;
        let mut peers: Vec<Rc<Peer>> = Vec::new();
        for peer in readers.iter().filter_map(|reader| context.peer_of(*reader)) {
            if !peers.iter().any(|known| Rc::ptr_eq(known, &peer)) {
                peers.push(peer);
            }
        }
        Ok(Self {
            publisher,
            service,
            readers: peers,
            expected: readers.len(),
            channel: M::CHANNEL,
            pace,
        })
    }

    /// Connects to whoever reads: for a process that does not know the loop's wiring. Readers bear their node's name.
    pub fn connect_to_all(&mut self, context: &SharedContext) -> Result<(), LinkError> {
        let mut names = Vec::new();
        self.service.dynamic_config().list_subscribers(|subscriber| {
            names.push(subscriber.subscriber_name.to_string());
            CallbackProgression::Continue
        });
        let nodes: Vec<NodeId> = names.iter().filter_map(|name| NodeId::named(name)).collect();
        self.expected = nodes.len();
        self.readers.clear();
        for peer in nodes.iter().filter_map(|node| context.peer_of(*node)) {
            if !self.readers.iter().any(|known| Rc::ptr_eq(known, &peer)) {
                self.readers.push(peer);
            }
        }
        self.connect()
    }

    pub fn connect(&mut self) -> Result<(), LinkError> {
        self.publisher
            .update_connections()
            .map_err(refused(format!("connect the readers of {}", self.channel)))
    }

    pub fn send(&mut self, token: M) -> Result<(), LinkError> {
        let tick = token.tick();
        let sample = self
            .publisher
            .loan_uninit()
            .map_err(refused(format!("lend memory for {}", self.channel)))?;
        let reached = sample
            .write_payload(token)
            .send()
            .map_err(refused(format!("send {}", self.channel)))?;
        if let Some(pace) = &self.pace {
            if reached < self.expected {
                pace.note_undelivered();
            }
        } else if reached < self.expected {
            return Err(LinkError::Undelivered {
                channel: self.channel,
                tick,
                reached,
                expected: self.expected,
            });
        }
        // Pairs with the fence in `SharedReceiver::sleep`.
        fence(Ordering::SeqCst);
        for reader in self.readers.iter().filter(|reader| reader.status.asleep()) {
            let rung = reader.bell.notify().map_err(refused("ring a bell"));
            // In real time a bell may belong to a process that has just died.
            if self.pace.is_none() {
                rung?;
            }
        }
        Ok(())
    }
}

/// The reading end: waits for the token of a tick.
pub struct SharedReceiver<M: Message> {
    subscriber: Subscriber<ipc::Service, M, ()>,
    context: Rc<SharedContext>,
    reader: NodeId,
}

impl<M: Message> SharedReceiver<M> {
    pub fn open(context: &Rc<SharedContext>, reader: NodeId) -> Result<Self, LinkError> {
        let depth = if reader == NodeId::Recorder {
            DEEPEST_BUFFER
        } else {
            LOOP_BUFFER
        };
        let subscriber = open_channel::<M>(context)?
            .subscriber_builder()
            .name(&PortName::new(reader.name()).map_err(refused("name a subscriber"))?)
            .buffer_size(depth)
            .create()
            .map_err(refused("create a subscriber"))?;
        Ok(Self {
            subscriber,
            context: context.clone(),
            reader,
        })
    }

    /// A token if one is there.
    pub fn poll(&self) -> Result<Option<M>, LinkError> {
        let sample = self
            .subscriber
            .receive()
            .map_err(refused(format!("receive {}", M::CHANNEL)))?;
        Ok(sample.map(|sample| *sample))
    }

    /// The next token, which must be that of `tick`; the caller checks.
    pub fn receive(&mut self, tick: u64) -> Result<M, LinkError> {
        let yields = match self.context.settings.wait {
            Wait::Bell { yields } => yields,
            Wait::Poll { .. } => 0,
        };
        for _ in 0..=yields {
            if let Some(token) = self.poll()? {
                return Ok(token);
            }
            std::thread::yield_now();
        }
        self.sleep(tick)
    }

    /// Brings `newest` to `due`, waiting until `until_ns` of the monotonic clock for its token.
    pub fn receive_newest(&mut self, newest: &mut Newest<M>, due: u64, until_ns: u64) -> Result<(), LinkError> {
        if let Some(limit) = self.context.last_wait.get() {
            return self.receive_last(newest, due, limit);
        }
        let mut polls = 0;
        loop {
            if newest.advance(due, || self.poll())? {
                return Ok(());
            }
            let now_ns = monotonic_ns();
            if now_ns >= until_ns {
                return Ok(());
            }
            if stop_requested() {
                return Err(LinkError::Stopped { tick: due });
            }
            match self.context.settings.wait {
                Wait::Bell { yields } if polls < yields => {
                    polls += 1;
                    std::thread::yield_now();
                }
                // Senders look at the status of the process that died: nobody rings this one.
                Wait::Bell { .. } if self.context.rejoins => {
                    std::thread::sleep(REJOINED_POLL.min(Duration::from_nanos(until_ns - now_ns)));
                }
                Wait::Bell { .. } => self.wait_for_bell(newest, due, Duration::from_nanos(until_ns - now_ns))?,
                Wait::Poll { period } => std::thread::sleep(period.min(Duration::from_nanos(until_ns - now_ns))),
            }
        }
    }

    /// As [`Self::receive_newest`] on the way to the safe field: time no longer decides, and silence is told, not borne.
    #[cold]
    fn receive_last(&self, newest: &mut Newest<M>, due: u64, limit: Duration) -> Result<(), LinkError> {
        let start = Instant::now();
        while !newest.advance(due, || self.poll())? {
            if start.elapsed() > limit {
                return Err(LinkError::Silent {
                    reader: self.reader,
                    channel: M::CHANNEL,
                    tick: due,
                    waited_s: start.elapsed().as_secs_f64(),
                });
            }
            std::thread::sleep(REJOINED_POLL);
        }
        Ok(())
    }

    /// Sleeps until rung, at most `limit`; not at all if the token of `due` has come meanwhile.
    fn wait_for_bell(&self, newest: &mut Newest<M>, due: u64, limit: Duration) -> Result<(), LinkError> {
        self.context.status.set_asleep(true);
        // Pairs with the fence in `SharedSender::send`, as in `sleep`.
        fence(Ordering::SeqCst);
        let settled = newest.advance(due, || self.poll());
        if matches!(settled, Ok(false)) {
            self.context.wait_for_bell(limit);
        }
        self.context.status.set_asleep(false);
        settled.map(|_| ())
    }

    /// Sleeps once until rung, at most `longest`, and looks at the channel again.
    fn nap(&self, longest: Duration) -> Result<Option<M>, LinkError> {
        match self.context.settings.wait {
            Wait::Bell { .. } => {
                self.context.status.set_asleep(true);
                // Pairs with the fence in `SharedSender::send`: the flag is out before the channel is looked at again.
                fence(Ordering::SeqCst);
                let token = self.poll()?;
                let waited = match token {
                    Some(_) => Ok(0),
                    None => self.context.bell.timed_wait(|_| {}, longest),
                };
                self.context.status.set_asleep(false);
                match waited {
                    // Any signal ends the wait, also a harmless one (SIGCONT); the caller looks at requests to stop.
                    Ok(_) | Err(ListenerWaitError::InterruptSignal) => {}
                    Err(error) => return Err(refused("wait for a bell")(error)),
                }
                if token.is_some() {
                    return Ok(token);
                }
            }
            Wait::Poll { period } => std::thread::sleep(period),
        }
        self.poll()
    }

    /// The next token, or none if none comes within `limit`.
    pub fn receive_within(&self, limit: Duration) -> Result<Option<M>, LinkError> {
        let start = Instant::now();
        let yields = match self.context.settings.wait {
            Wait::Bell { yields } => yields,
            Wait::Poll { .. } => 0,
        };
        for _ in 0..=yields {
            if let Some(token) = self.poll()? {
                return Ok(Some(token));
            }
            std::thread::yield_now();
        }
        while let Some(left) = limit.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) {
            if let Some(token) = self.nap(left.min(LONGEST_NAP))? {
                return Ok(Some(token));
            }
        }
        Ok(None)
    }

    #[cold]
    fn sleep(&self, tick: u64) -> Result<M, LinkError> {
        let start = Instant::now();
        let ending = self.context.last_wait.get();
        let limit = ending.unwrap_or(self.context.settings.receive_limit);
        // Whoever looks on can follow who waits for whom, also when the one that all wait for can say nothing any more.
        self.context.status.set_wait(TokenWait {
            reader: self.reader,
            channel: M::CHANNEL,
            tick,
        });
        loop {
            if let Some(token) = self.nap(LONGEST_NAP)? {
                return Ok(token);
            }
            if ending.is_none() && stop_requested() {
                return Err(LinkError::Stopped { tick });
            }
            if start.elapsed() > limit {
                let waited_s = start.elapsed().as_secs_f64();
                return Err(LinkError::Silent {
                    reader: self.reader,
                    channel: M::CHANNEL,
                    tick,
                    waited_s,
                });
            }
        }
    }
}
