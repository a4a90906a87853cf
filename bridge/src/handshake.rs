//! What the two bridges tell each other before anything crosses, and what must be alike.

use crate::error::BridgeError;
use crate::partition::Partition;
use crate::settings::BridgeSettings;
use anhyst_ipc::{NodeId, layouts, monotonic_ns};
use serde::{Deserialize, Serialize};

/// Raised when keys, payloads or the order of the start change.
const PROTOCOL: u32 = 1;

/// A bridge's introduction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Handshake {
    /// Version of what the bridges say to each other.
    pub protocol: u32,
    /// Version of the program.
    pub version: String,
    /// Hash of the layouts of all messages.
    pub layouts: u64,
    /// Fingerprint of the scenario.
    pub agreement: u64,
    /// Time between two ticks.
    pub tick_s: f64,
    /// Length of the run.
    pub ticks: u64,
    /// The nodes of the bridge's side.
    pub here: Vec<NodeId>,
    /// The longest round trip that the side accepts.
    pub budget_us: f64,
    /// Tells a bridge that was started anew from the one before.
    pub instance: u64,
    /// Where the listening side echoes plain TCP; 0 on the connecting side.
    pub echo_port: u16,
    /// True once the other bridge's introduction has come.
    pub heard: bool,
}

impl Handshake {
    /// The introduction of a bridge with these settings.
    pub fn new(settings: &BridgeSettings, partition: &Partition, echo_port: u16) -> Self {
        Self {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION").into(),
            layouts: layouts(),
            agreement: settings.agreement,
            tick_s: settings.tick_s,
            ticks: settings.ticks,
            here: partition.here.iter().flat_map(|(_, nodes)| nodes.clone()).collect(),
            budget_us: settings.budget.as_secs_f64() * 1e6,
            instance: monotonic_ns() ^ (u64::from(std::process::id()) << 40),
            echo_port,
            heard: false,
        }
    }

    /// Compares it with the other side's.
    ///
    /// # Errors
    /// The first thing that is not alike, or a node that runs on both sides or on neither.
    pub fn compare(&self, other: &Handshake) -> Result<(), BridgeError> {
        let program = "install the same version on both hosts";
        let scenario = "give both sides the same scenario and the same --set";
        let hex = |number: u64| format!("{number:016x}");
        let seconds = |tick_s: f64| format!("{tick_s:e} s");
        let protocol = |handshake: &Handshake| format!("{} (anhyst {})", handshake.protocol, handshake.version);
        let alike: [(&'static str, String, String, &'static str); 5] = [
            ("bridge protocol", protocol(self), protocol(other), program),
            ("message layouts", hex(self.layouts), hex(other.layouts), program),
            ("a tick of", seconds(self.tick_s), seconds(other.tick_s), scenario),
            (
                "a length in ticks of",
                self.ticks.to_string(),
                other.ticks.to_string(),
                scenario,
            ),
            ("the scenario", hex(self.agreement), hex(other.agreement), scenario),
        ];
        for (what, own, other, remedy) in alike {
            if own != other {
                return Err(BridgeError::Unlike {
                    what,
                    own,
                    other,
                    remedy,
                });
            }
        }
        for node in NodeId::LOOP_ORDER {
            let sides = match (self.here.contains(&node), other.here.contains(&node)) {
                (true, true) => "both",
                (false, false) => "neither",
                _ => continue,
            };
            return Err(BridgeError::Sides {
                node: node.name(),
                sides,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn handshake(here: &[NodeId]) -> Handshake {
        Handshake {
            protocol: PROTOCOL,
            version: "1.2.3".into(),
            layouts: layouts(),
            agreement: 7,
            tick_s: 5e-5,
            ticks: 20_000,
            here: here.to_vec(),
            budget_us: 1e6,
            instance: 1,
            echo_port: 0,
            heard: false,
        }
    }

    // Guards that two sides of one run accept each other, also after the way through JSON.
    #[test]
    fn two_sides_of_one_run_are_alike() {
        let (one, other) = NodeId::LOOP_ORDER.split_at(3);
        let text = serde_json::to_string(&handshake(other)).unwrap();
        handshake(one).compare(&serde_json::from_str(&text).unwrap()).unwrap();
    }

    // Guards that nothing crosses between programs or scenarios that differ, and that the sentence says in what.
    #[test]
    fn what_is_not_alike_is_refused_by_name() {
        let (one, other) = NodeId::LOOP_ORDER.split_at(3);
        type Change = fn(&mut Handshake);
        let change: [(&str, Change); 5] = [
            ("message layouts", |handshake| handshake.layouts ^= 1),
            ("the scenario", |handshake| handshake.agreement ^= 1),
            ("a tick of", |handshake| handshake.tick_s *= 2.0),
            ("a length in ticks", |handshake| handshake.ticks += 1),
            ("bridge protocol", |handshake| handshake.protocol += 1),
        ];
        for (what, change) in change {
            let mut changed = handshake(other);
            change(&mut changed);
            let sentence = handshake(one).compare(&changed).unwrap_err().to_string();
            assert!(sentence.contains(what), "{what}: {sentence}");
        }
    }

    // Guards that every node runs exactly once: a second guard, or none, must not go unnoticed.
    #[test]
    fn a_node_on_both_sides_or_on_neither_is_refused() {
        let (one, other) = NodeId::LOOP_ORDER.split_at(3);
        let twice = handshake(one)
            .compare(&handshake(&NodeId::LOOP_ORDER[2..]))
            .unwrap_err();
        assert!(
            twice.to_string().starts_with("controller runs on both sides"),
            "{twice}"
        );
        let missing = handshake(one).compare(&handshake(&other[1..])).unwrap_err();
        assert!(
            missing.to_string().starts_with("inverse runs on neither side"),
            "{missing}"
        );
    }
}
