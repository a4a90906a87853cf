//! A run's channels for whoever looks on: one key a channel, a message in JSON a token. Nobody waits for them: what a subscriber cannot
//! take is dropped.

use crate::error::BridgeError;
use crate::settings::End;
use anhyst_ipc::Channel;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

/// The open keys `anhyst/live/RUN/CHANNEL`.
pub struct LiveKeys {
    publishers: Vec<(Channel, Publisher<'static>)>,
    // Last: publishers go before their session.
    _session: zenoh::Session,
}

fn refused<E: std::fmt::Display>(operation: &str) -> impl FnOnce(E) -> BridgeError {
    let operation = operation.to_owned();
    move |error| BridgeError::Zenoh {
        operation,
        cause: error.to_string(),
    }
}

impl LiveKeys {
    /// Listens for subscribers, or connects to a router.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn open(end: &End, run: &str) -> Result<Self, BridgeError> {
        let endpoint = serde_json::json!([end.endpoint()]).to_string();
        let key = match end {
            End::Listen(_) => "listen/endpoints",
            End::Connect(_) => "connect/endpoints",
        };
        let mut config = zenoh::Config::default();
        for (key, value) in [
            ("mode", "\"peer\""),
            ("listen/endpoints", "[]"),
            (key, endpoint.as_str()),
            ("scouting/multicast/enabled", "false"),
        ] {
            config
                .insert_json5(key, value)
                .map_err(refused(&format!("set {key} to {value}")))?;
        }
        let session = zenoh::open(config).wait().map_err(refused("open the live keys"))?;
        let publisher = |channel: Channel| {
            let key = format!("anhyst/live/{run}/{channel}");
            let publisher = session
                .declare_publisher(key.clone())
                .encoding(Encoding::APPLICATION_JSON)
                .congestion_control(CongestionControl::Drop)
                .wait();
            Ok((channel, publisher.map_err(refused(&format!("publish {key}")))?))
        };
        Ok(Self {
            publishers: Channel::ALL
                .into_iter()
                .map(publisher)
                .collect::<Result<_, BridgeError>>()?,
            _session: session,
        })
    }

    /// A token of a channel, in JSON.
    ///
    /// # Errors
    /// If Zenoh refuses.
    pub fn put(&self, channel: Channel, json: &str) -> Result<(), BridgeError> {
        let (_, publisher) = &self.publishers[channel.number()];
        publisher
            .put(json)
            .wait()
            .map_err(refused(&format!("publish a token of {channel}")))
    }
}
