//! What a bridge must be told.

use anhyst_ipc::{NodeId, Wire};
use std::path::PathBuf;
use std::time::Duration;

/// Which end of the link a bridge is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// Waits at this Zenoh endpoint, `tcp/10.0.0.1:7447`.
    Listen(String),
    /// Goes to this one.
    Connect(String),
}

impl End {
    /// The endpoint.
    pub fn endpoint(&self) -> &str {
        match self {
            End::Listen(endpoint) | End::Connect(endpoint) => endpoint,
        }
    }

    /// The name of this end in keys.
    pub fn name(&self) -> &'static str {
        match self {
            End::Listen(_) => "listening",
            End::Connect(_) => "connecting",
        }
    }

    /// The name of the other end in keys.
    pub fn other_name(&self) -> &'static str {
        match self {
            End::Listen(_) => "connecting",
            End::Connect(_) => "listening",
        }
    }

    /// The host in the endpoint, for the plain TCP connection beside Zenoh; `None` unless it reads `tcp/HOST:PORT`.
    pub fn host(&self) -> Option<&str> {
        let (host, port) = self.endpoint().strip_prefix("tcp/")?.rsplit_once(':')?;
        let host = host.trim_start_matches('[').trim_end_matches(']');
        (!host.is_empty() && port.parse::<u16>().is_ok()).then_some(host)
    }
}

/// Settings of one bridge.
#[derive(Debug, Clone, PartialEq)]
pub struct BridgeSettings {
    /// Which end it is.
    pub end: End,
    /// Name of the run in the keys `anhyst/RUN/CHANNEL`; the same on both sides.
    pub run: String,
    /// Prefix of the iceoryx2 resources of this side.
    pub prefix: String,
    /// Directory of iceoryx2's files of this side.
    pub root: PathBuf,
    /// Where a launcher writes which process of this side died, before it ends the others.
    pub died: Option<PathBuf>,
    /// All processes of the run and the nodes in each.
    pub processes: Vec<(String, Vec<NodeId>)>,
    /// The nodes of this side.
    pub here: Vec<NodeId>,
    /// Every arrow of the loop.
    pub wires: Vec<Wire>,
    /// Fingerprint of the scenario.
    pub agreement: u64,
    /// Time between two ticks.
    pub tick_s: f64,
    /// Length of the run.
    pub ticks: u64,
    /// Polls before the bridge sleeps.
    pub yields: u32,
    /// The longest silence of the other side, or of a channel.
    pub receive_limit: Duration,
    /// How long the other bridge and the processes of this side may take to appear.
    pub start_limit: Duration,
    /// The longest round trip between the bridges (99 of 100).
    pub budget: Duration,
}

#[cfg(test)]
mod tests {
    use super::End;

    // Guards the reading of endpoints: the host of the plain TCP measurement comes from it.
    #[test]
    fn endpoints_have_hosts() {
        let host = |endpoint: &str| End::Listen(endpoint.into()).host().map(str::to_owned);
        assert_eq!(host("tcp/10.0.0.1:7447").as_deref(), Some("10.0.0.1"));
        assert_eq!(host("tcp/[fe80::1]:7447").as_deref(), Some("fe80::1"));
        assert_eq!(host("tcp/rig:7447").as_deref(), Some("rig"));
        for bad in [
            "10.0.0.1:7447",
            "udp/10.0.0.1:7447",
            "tcp/10.0.0.1",
            "tcp/:7447",
            "tcp/x:99999",
        ] {
            assert_eq!(host(bad), None, "{bad}");
        }
    }
}
