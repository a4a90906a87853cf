use crate::clock::CLOCKS;
use crate::message::{Channel, NodeId};
use serde::{Deserialize, Serialize};

/// Why a link could not do what the loop needs. No token is ever guessed: any of these ends the node's run.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkError {
    /// Nothing came within the receive limit.
    #[error("{reader} waited {waited_s:.3} s for {channel} of tick {tick}, but {producer} is silent", producer = channel.producer())]
    Silent {
        /// Who waited.
        reader: NodeId,
        /// For what.
        channel: Channel,
        /// Of which tick.
        tick: u64,
        /// For how long.
        waited_s: f64,
    },
    /// A token of another tick came: tokens were lost or repeated.
    #[error("{reader} expected {channel} of tick {expected}, but tick {got} came: tokens were lost or repeated")]
    Gap {
        /// Who read.
        reader: NodeId,
        /// What.
        channel: Channel,
        /// The tick that was due.
        expected: u64,
        /// The tick that came.
        got: u64,
    },
    /// A token reached fewer readers than are connected.
    #[error("{channel} of tick {tick} reached {reached} of {expected} readers")]
    Undelivered {
        /// What was sent.
        channel: Channel,
        /// Of which tick.
        tick: u64,
        /// How many got it.
        reached: usize,
        /// How many should have.
        expected: usize,
    },
    /// A process did not come to a rendezvous.
    #[error("{process} did not come within {waited_s:.1} s (phase {phase}: {what})", what = ["start", "ports", "connection", "end"].get(*phase as usize).unwrap_or(&"?"))]
    Absent {
        /// Who is missing.
        process: String,
        /// Which phase: 1 ports created, 2 connected, 3 at the end.
        phase: u64,
        /// For how long others waited.
        waited_s: f64,
    },
    /// A process that others must not leave behind does not follow.
    #[error("{process} is {ticks} ticks behind, and has not caught up within {waited_s:.1} s")]
    Behind {
        /// Who.
        process: String,
        /// How far.
        ticks: u64,
        /// For how long it was waited for.
        waited_s: f64,
    },
    /// Two processes of one run were given different scenarios.
    #[error("{process} runs another scenario than {own}: give all processes of a run the same file and the same --set")]
    Disagreement {
        /// The other one.
        process: String,
        /// This one.
        own: String,
    },
    /// The run was told to end.
    #[error("stopped on request at tick {tick}")]
    Stopped {
        /// Where.
        tick: u64,
    },
    /// iceoryx2 refused an operation.
    #[error("iceoryx2 could not {operation}: {cause}")]
    Transport {
        /// What was tried.
        operation: String,
        /// What iceoryx2 said.
        cause: String,
    },
    /// The system refused something.
    #[error("could not {operation}: {cause}")]
    System {
        /// What was tried.
        operation: String,
        /// What the system says.
        cause: String,
    },
    /// A process uses a channel that it has not opened.
    #[error("{process} uses {channel} but has not opened it{how}", how = if *sending { " for sending" } else { " for reading" })]
    NotOpened {
        /// Who.
        process: String,
        /// What.
        channel: Channel,
        /// True if it wanted to send.
        sending: bool,
    },
    /// No way to keep time.
    #[error("ANHYST_CLOCK={name} with ANHYST_TICK_S={tick_s}: known are {clocks}, with a tick of 1e-6 to 1 s", clocks = CLOCKS.join(", "))]
    UnknownClock {
        /// Its name.
        name: String,
        /// Time between two ticks.
        tick_s: f64,
    },
    /// A name is none of a process of the run.
    #[error("\"{name}\" is no process of this run; its processes are {processes}")]
    UnknownProcess {
        /// The name.
        name: String,
        /// Those that there are.
        processes: String,
    },
    /// A node reads a channel of its own process that no node of this process sends.
    #[error("{reader} reads {channel}, but nobody in its process sends it and no transport to other processes is open")]
    Unconnected {
        /// Who reads.
        reader: NodeId,
        /// What.
        channel: Channel,
    },
}
