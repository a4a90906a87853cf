//! A run's channels for whoever listens on the network: a key a channel, and its schema for whoever asks.

use crate::error::BridgeError;
use crate::session::{configure, refused};
use crate::settings::End;
use anhyst_ipc::Channel;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};

/// The open session; nobody has to listen.
pub struct Outlet {
    publishers: Vec<(Channel, Publisher<'static>)>,
    _schemas: Vec<Queryable<()>>,
    // Last: what it has declared goes before it.
    _session: zenoh::Session,
}

impl Outlet {
    /// Keys `anhyst/RUN/live/CHANNEL`, their schemas at `…/CHANNEL/schema`.
    ///
    /// # Errors
    /// An endpoint that cannot be used, a name that no key can have.
    pub fn open(end: &End, run: &str, schema: impl Fn(Channel) -> String) -> Result<Self, BridgeError> {
        let config = configure(end)?;
        let operation = format!("open a session at {}", end.endpoint());
        let session = zenoh::open(config).wait().map_err(refused(operation))?;
        let (mut publishers, mut schemas) = (Vec::new(), Vec::new());
        for channel in Channel::ALL {
            let key = format!("anhyst/{run}/live/{channel}");
            let json = Encoding::APPLICATION_JSON.with_schema(format!("anhyst.{channel}"));
            let publisher = session
                .declare_publisher(key.clone())
                .encoding(json)
                // Who reads slowly loses messages; the run waits for nobody.
                .congestion_control(CongestionControl::Drop)
                .wait()
                .map_err(refused(format!("publish {key}")))?;
            publishers.push((channel, publisher));
            let key = KeyExpr::new(format!("{key}/schema")).map_err(refused("name a schema"))?;
            let (own, text) = (key.clone(), schema(channel));
            let answer = move |query: Query| {
                // One who has left need not be answered.
                let _ = query
                    .reply(&own, text.as_str())
                    .encoding(Encoding::APPLICATION_JSON)
                    .wait();
            };
            let asked = session.declare_queryable(key).callback(answer).wait();
            schemas.push(asked.map_err(refused("answer for a schema"))?);
        }
        Ok(Outlet {
            publishers,
            _schemas: schemas,
            _session: session,
        })
    }

    /// Sends a message of a channel.
    ///
    /// # Errors
    /// If Zenoh refuses; that nobody listens is no error.
    pub fn send(&self, channel: Channel, message: &str) -> Result<(), BridgeError> {
        let Some((_, publisher)) = self.publishers.iter().find(|(own, _)| *own == channel) else {
            return Ok(());
        };
        publisher
            .put(message)
            .wait()
            .map_err(refused(format!("send {channel}")))
    }
}
