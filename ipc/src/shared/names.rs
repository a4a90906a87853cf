//! Names and sizes of a run's iceoryx2 services: with the message types all that a foreign process must do alike.
//! iceoryx2 takes the settings of an opener as minimum requirements, so whoever comes first must create with these.

use crate::message::{Channel, NodeId};

/// Tokens that wait for the slowest reader, the recorder: 0.4 s at 20 kHz.
pub const DEEPEST_BUFFER: usize = 8192;
/// Tokens that wait for a node of the loop; in lockstep one is under way, more are room for a real-time reader.
pub const LOOP_BUFFER: usize = 512;
/// Tokens that a reader may hold at a time.
pub const MAX_BORROWED: usize = 2;
/// Senders of a channel.
pub const MAX_PUBLISHERS: usize = 1;
/// Readers of a channel.
pub const MAX_SUBSCRIBERS: usize = 8;
/// Processes at a service.
pub const MAX_NODES: usize = 32;
/// Processes that may wake one.
pub const MAX_NOTIFIERS: usize = 32;
/// Listeners of an event service.
pub const MAX_LISTENERS: usize = 2;
/// Readers of a status.
pub const MAX_STATUS_READERS: usize = 32;

/// Key of a status: phase of the start and the end.
pub const PHASE: u64 = 0;
/// Key of a status: [`ANY_TOKEN`] or more while its process sleeps until it is notified.
pub const ASLEEP: u64 = 1;
/// Asleep until a token comes on any channel; the number of a channel more: on that one.
pub const ANY_TOKEN: u64 = 1;
/// Key of a status: ticks finished.
pub const TICK: u64 = 2;
/// Key of a status: fingerprint of the scenario.
pub const AGREEMENT: u64 = 3;
/// Key of a status: in real time the moment at which tick 0 begins, in ns of the monotonic clock, as the plant's process says it.
pub const EPOCH: u64 = 4;
/// Key of a status: the token that its process waited for last, see [`super::status::TokenWait`]; foreign processes have none.
pub const WAIT: u64 = 5;

/// Phase of a process that has created its ports.
pub const PORTS: u64 = 1;
/// Phase of a process whose senders have connected: tick 0 may begin.
pub const CONNECTED: u64 = 2;
/// Phase of a process that has come to the end of its run: also one that rejoined waits for the others there.
pub const END: u64 = 3;
/// Phase of a process that has seen all the others come to the end, and looks at nobody any more.
pub const GONE: u64 = 4;

/// The agreement of a process that has not read the scenario and goes along with whatever the others run.
pub const ANY_AGREEMENT: u64 = 0;

/// Publish-subscribe service of a channel.
pub fn channel_service(channel: Channel) -> String {
    format!("loop/{channel}")
}

/// Event service that wakes a process.
pub fn bell_service(process: &str) -> String {
    format!("bell/{process}")
}

/// Request-response service of a node that takes changes of its settings.
pub fn tuning_service(node: NodeId) -> String {
    format!("tune/{node}")
}

/// Blackboard on which a process says where it is. `start` is 0 unless the process takes the place of one that died: then it
/// counts those of its name before it.
pub fn status_service(process: &str, start: u64) -> String {
    match start {
        0 => format!("status/{process}"),
        start => format!("status/{process}/{start}"),
    }
}
