use anhyst_ipc::{Channel, LinkError};

/// Why a bridge could not start or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BridgeError {
    /// A setting that cannot be used.
    #[error("{0}")]
    Setting(String),
    /// The two sides were told different things.
    #[error("the other side has {what} {other}, this side {own}: {remedy}")]
    Unlike {
        /// What is not alike.
        what: &'static str,
        /// Of this side.
        own: String,
        /// Of the other one.
        other: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The sides together are not the run.
    #[error("{node} runs on {sides} side{s}: name every node in the --here of exactly one side", s = if *sides == "neither" { "" } else { "s" })]
    Sides {
        /// The node's name.
        node: &'static str,
        /// `both` or `neither`.
        sides: &'static str,
    },
    /// No other bridge came.
    #[error("no other bridge answered at {endpoint} within {waited_s:.1} s")]
    NoBridge {
        /// Where.
        endpoint: String,
        /// For how long.
        waited_s: f64,
    },
    /// The link is too slow.
    #[error(
        "1 of 100 round trips to the other side took more than {p99_us:.0} µs, the budget is {budget_us:.0} µs: \
         this link cannot close the loop"
    )]
    Budget {
        /// The 99th percentile that was measured.
        p99_us: f64,
        /// What it may be.
        budget_us: f64,
    },
    /// The other bridge says nothing any more.
    #[error("nothing was heard for {waited_s:.3} s (limit {limit_s} s): the bridge of {processes} is silent")]
    Silent {
        /// The processes that it carried.
        processes: String,
        /// For how long.
        waited_s: f64,
        /// The receive limit.
        limit_s: f64,
    },
    /// The other bridge has ended and says why.
    #[error("the bridge of {processes} has ended: {words}")]
    Left {
        /// The processes that it carried.
        processes: String,
        /// What it said.
        words: String,
    },
    /// A process of this side has died.
    #[error("{process} has died")]
    Died {
        /// Which.
        process: String,
    },
    /// The other bridge was started anew.
    #[error("the bridge of {processes} was started anew: start the whole run again")]
    Restarted {
        /// The processes that it carries.
        processes: String,
    },
    /// A channel stands still.
    #[error("the bridge waited {waited_s:.3} s for {channel} of tick {tick}, but {producer} is silent", producer = channel.producer())]
    Stalled {
        /// The first token that is missing.
        channel: Channel,
        /// Its tick.
        tick: u64,
        /// For how long nothing crossed.
        waited_s: f64,
    },
    /// A token of another tick came.
    #[error("the bridge expected {channel} of tick {expected}, but tick {got} came: tokens were lost")]
    Gap {
        /// What.
        channel: Channel,
        /// The tick that was due.
        expected: u64,
        /// The tick that came.
        got: u64,
    },
    /// The run ended before a channel's last tick had crossed.
    #[error("the run ended, but only {got} of {ticks} tokens of {channel} have crossed")]
    Lost {
        /// What.
        channel: Channel,
        /// How many crossed.
        got: u64,
        /// How many should have.
        ticks: u64,
    },
    /// What came is no token of its channel.
    #[error("{bytes} bytes came on {key}, which are none of its messages")]
    Malformed {
        /// On which key.
        key: String,
        /// How many.
        bytes: usize,
    },
    /// The user asked to stop.
    #[error("stopped on request")]
    Stopped,
    /// A link of this host failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Zenoh refused an operation.
    #[error("Zenoh could not {operation}: {cause}")]
    Zenoh {
        /// What was tried.
        operation: String,
        /// What Zenoh said.
        cause: String,
    },
    /// The plain TCP connection beside Zenoh failed.
    #[error("the plain TCP connection that the link is compared with could not be used: {cause}")]
    Tcp {
        /// What the system says.
        cause: String,
    },
    /// A thread of the bridge ended in a panic.
    #[error("a thread of the bridge ended unexpectedly")]
    Thread,
}
