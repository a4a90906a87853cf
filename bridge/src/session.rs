//! The Zenoh session between two bridges: one key a channel, and a few for what the bridges tell each other.
//!
//! Explicit endpoints, no scouting; reliable, blocking, of the highest priority, never batched (`express`): a token leaves at
//! once and none is dropped. What comes is handed over in the order in which Zenoh delivers it.

use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::heartbeat::Heartbeat;
use crate::partition::Partition;
use crate::round_trip::BYTES;
use crate::round_trip::RoundTrips;
use crate::settings::{BridgeSettings, End};
use anhyst_ipc::{Channel, MAX_BYTES, RawToken, monotonic_ns};
use serde::de::DeserializeOwned;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;
use zenoh::Wait;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;

/// What the other bridge says.
#[derive(Debug)]
pub enum Incoming {
    /// A token.
    Token(RawToken),
    /// Where its processes stand.
    Heartbeat(Heartbeat),
    /// Its introduction.
    Handshake(Box<Handshake>),
    /// What it measured.
    Measured(RoundTrips),
    /// A ping of the connecting bridge, or its echo.
    Echo,
    /// Something that cannot be read.
    Malformed {
        /// On which key.
        key: String,
        /// How many bytes.
        bytes: usize,
    },
}

/// The next message of the other bridge: polls and yields so often, then sleeps until it comes.
///
/// # Errors
/// If none comes for `limit`.
pub fn next(incoming: &Receiver<Incoming>, yields: u32, limit: Duration) -> Result<Incoming, RecvTimeoutError> {
    for _ in 0..yields {
        // Waking a thread takes as long as the way through the network card: one that is awake is told at once.
        if let Ok(message) = incoming.try_recv() {
            return Ok(message);
        }
        std::thread::yield_now();
    }
    incoming.recv_timeout(limit)
}

/// The open session.
pub struct Session {
    tokens: Vec<(Channel, Publisher<'static>)>,
    handshake: Publisher<'static>,
    heartbeat: Publisher<'static>,
    measured: Publisher<'static>,
    echo: Publisher<'static>,
    heard_ns: Arc<AtomicU64>,
    _subscribers: Vec<Subscriber<()>>,
    // Last: publishers and subscribers go before their session.
    _session: zenoh::Session,
}

pub fn refused<E: std::fmt::Display>(operation: impl Into<String>) -> impl FnOnce(E) -> BridgeError {
    let operation = operation.into();
    move |error| BridgeError::Zenoh {
        operation,
        cause: without_places(&error.to_string()),
    }
}

/// What Zenoh says without where in its source it says so (` at /…/file.rs:12.`).
fn without_places(said: &str) -> String {
    let mut kept = said.to_owned();
    while let Some(start) = kept.find(" at /") {
        let Some(name) = kept[start..].find(".rs:") else { break };
        let line = start + name + ".rs:".len();
        let digits = kept[line..].find(|letter: char| !letter.is_ascii_digit() && letter != '.');
        kept.replace_range(start..digits.map_or(kept.len(), |digits| line + digits), "");
    }
    kept
}

/// A session of this end only: nothing is looked for, and the other end may start later.
pub fn configure(end: &End) -> Result<zenoh::Config, BridgeError> {
    let endpoint = serde_json::json!([end.endpoint()]).to_string();
    let (listen, connect) = match end {
        End::Listen(_) => (endpoint.as_str(), "[]"),
        End::Connect(_) => ("[]", endpoint.as_str()),
    };
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"peer\""),
        ("listen/endpoints", listen),
        ("connect/endpoints", connect),
        // The session tries again in the background, the bridge has its own time limit.
        ("connect/timeout_ms", "-1"),
        ("connect/exit_on_failure", "false"),
        ("connect/retry", r#"{"period_init_ms": 100, "period_max_ms": 500}"#),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
    ];
    set(&mut config, &settings)?;
    Ok(config)
}

fn set(config: &mut zenoh::Config, settings: &[(&str, &str)]) -> Result<(), BridgeError> {
    for (key, value) in settings {
        config
            .insert_json5(key, value)
            .map_err(refused(format!("set {key} to {value}")))?;
    }
    Ok(())
}

/// Opens keys of one run.
struct Keys<'a> {
    session: &'a zenoh::Session,
    run: &'a str,
    heard_ns: &'a Arc<AtomicU64>,
}

impl Keys<'_> {
    fn publisher(&self, name: &str) -> Result<Publisher<'static>, BridgeError> {
        let key = format!("anhyst/{}/{name}", self.run);
        self.session
            .declare_publisher(key.clone())
            .congestion_control(CongestionControl::Block)
            .priority(Priority::RealTime)
            .express(true)
            .wait()
            .map_err(refused(format!("publish {key}")))
    }

    fn subscriber(
        &self,
        name: &str,
        hear: impl Fn(&[u8]) -> Option<Incoming> + Send + Sync + 'static,
        sender: &Sender<Incoming>,
    ) -> Result<Subscriber<()>, BridgeError> {
        let key = format!("anhyst/{}/{name}", self.run);
        let (sender, heard_ns, own_key) = (sender.clone(), self.heard_ns.clone(), key.clone());
        let callback = move |sample: Sample| {
            heard_ns.store(monotonic_ns(), Ordering::Relaxed);
            let bytes = sample.payload().to_bytes();
            let incoming = hear(&bytes).unwrap_or_else(|| Incoming::Malformed {
                key: own_key.clone(),
                bytes: bytes.len(),
            });
            // Nobody listens any more when the bridge ends.
            let _ = sender.send(incoming);
        };
        self.session
            .declare_subscriber(key.clone())
            .callback(callback)
            .wait()
            .map_err(refused(format!("subscribe to {key}")))
    }
}

fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    serde_json::from_slice(bytes).ok()
}

impl Session {
    /// Opens the session; the other bridge need not be there yet.
    ///
    /// # Errors
    /// If Zenoh cannot listen at the endpoint, or refuses a key.
    pub fn open(settings: &BridgeSettings, partition: &Partition) -> Result<(Self, Receiver<Incoming>), BridgeError> {
        let endpoint = settings.end.endpoint();
        let mut config = configure(&settings.end)?;
        // No queue and no second thread between a token and its socket.
        let at_once = [
            ("transport/unicast/qos/enabled", "false"),
            ("transport/unicast/lowlatency", "true"),
        ];
        set(&mut config, &at_once)?;
        let session = zenoh::open(config)
            .wait()
            .map_err(refused(format!("open {endpoint}")))?;
        let heard_ns = Arc::new(AtomicU64::new(monotonic_ns()));
        let keys = Keys {
            session: &session,
            run: &settings.run,
            heard_ns: &heard_ns,
        };
        let (sender, receiver) = channel();
        let (own, other) = (settings.end.name(), settings.end.other_name());
        let mut subscribers = vec![
            keys.subscriber(
                &format!("hello/{other}"),
                |bytes| parse(bytes).map(Incoming::Handshake),
                &sender,
            )?,
            keys.subscriber(
                &format!("beat/{other}"),
                |bytes| parse(bytes).map(Incoming::Heartbeat),
                &sender,
            )?,
            keys.subscriber("measured", |bytes| parse(bytes).map(Incoming::Measured), &sender)?,
        ];
        let (echo_out, echo_in) = match settings.end {
            End::Listen(_) => ("pong", "ping"),
            End::Connect(_) => ("ping", "pong"),
        };
        subscribers.push(keys.subscriber(echo_in, |_| Some(Incoming::Echo), &sender)?);
        for channel in partition.coming.iter().copied() {
            let hear = move |bytes: &[u8]| RawToken::from_bytes(channel, bytes).map(Incoming::Token);
            subscribers.push(keys.subscriber(channel.name(), hear, &sender)?);
        }
        let token = |channel: &Channel| Ok((*channel, keys.publisher(channel.name())?));
        let link = Self {
            tokens: partition
                .leaving
                .iter()
                .map(token)
                .collect::<Result<_, BridgeError>>()?,
            handshake: keys.publisher(&format!("hello/{own}"))?,
            heartbeat: keys.publisher(&format!("beat/{own}"))?,
            measured: keys.publisher("measured")?,
            echo: keys.publisher(echo_out)?,
            heard_ns,
            _subscribers: subscribers,
            _session: session,
        };
        Ok((link, receiver))
    }

    /// When the other bridge was last heard, by the monotonic clock in ns.
    pub fn heard_ns(&self) -> u64 {
        self.heard_ns.load(Ordering::Relaxed)
    }

    /// Sends a token.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn token(&self, token: &RawToken) -> Result<(), BridgeError> {
        let Some((channel, publisher)) = self.tokens.iter().find(|(channel, _)| *channel == token.channel()) else {
            return Ok(());
        };
        let mut buffer = [0; MAX_BYTES];
        let used = token.write_bytes(&mut buffer);
        publisher
            .put(buffer.get(..used).unwrap_or_default())
            .wait()
            .map_err(refused(format!("send {channel}")))
    }

    fn json(publisher: &Publisher<'_>, value: &impl serde::Serialize) -> Result<(), BridgeError> {
        let text = serde_json::to_vec(value).map_err(refused("write JSON"))?;
        publisher
            .put(text)
            .wait()
            .map_err(refused(format!("send {}", publisher.key_expr())))
    }

    /// Introduces this bridge.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn handshake(&self, handshake: &Handshake) -> Result<(), BridgeError> {
        Self::json(&self.handshake, handshake)
    }

    /// Says where this side stands.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn heartbeat(&self, heartbeat: &Heartbeat) -> Result<(), BridgeError> {
        Self::json(&self.heartbeat, heartbeat)
    }

    /// Says what was measured.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn measured(&self, round_trips: &RoundTrips) -> Result<(), BridgeError> {
        Self::json(&self.measured, round_trips)
    }

    /// Sends a ping (connecting side) or its echo (listening side).
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn echo(&self) -> Result<(), BridgeError> {
        let bytes: &[u8] = &[0; BYTES];
        self.echo.put(bytes).wait().map_err(refused("send a ping"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards a sentence from paths of the machine that built this.
    #[test]
    fn places_in_the_source_are_left_out() {
        for (said, kept) in [
            (
                "no listener: [1.2.3.4:1: no such address (os error 99) at /a/b/tcp.rs:61.] at /a/unicast.rs:338.",
                "no listener: [1.2.3.4:1: no such address (os error 99)]",
            ),
            ("looked at /etc/hosts", "looked at /etc/hosts"),
            ("closed", "closed"),
        ] {
            assert_eq!(without_places(said), kept);
        }
    }
}
