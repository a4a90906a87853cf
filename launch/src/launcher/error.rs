//! Why a run of processes did not reach its end.

/// Why a run of processes did not reach its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LaunchError {
    /// Nothing was started.
    #[error("{0}")]
    SharedMemory(String),
    /// A process could not be started.
    #[error("{process} could not be started: {cause}")]
    Spawn {
        /// Which.
        process: String,
        /// What the system says.
        cause: String,
    },
    /// A process died.
    #[error("{process} {how} {when} tick {tick} of {ticks}{detail}")]
    Died {
        /// Which.
        process: String,
        /// Exit status in words.
        how: String,
        /// "at" the tick in which it failed, or if that is not known exactly "after" the one that the plant had come to.
        when: &'static str,
        /// Which.
        tick: u64,
        /// How far it should have come.
        ticks: u64,
        /// What the process said last, with a colon before it, or nothing.
        detail: String,
    },
    /// Nobody started an external process.
    #[error(
        "{process} is external, and nobody came within {limit_s} s: start its driver with ANHYST_SERVICE_PREFIX={prefix} ANHYST_ROOT={root}, or give --external-command or a longer --start-limit-s"
    )]
    NobodyCame {
        /// Which.
        process: String,
        /// How long it was waited for.
        limit_s: f64,
        /// Where it was waited for.
        prefix: String,
        /// The same.
        root: String,
    },
    /// The user asked to stop.
    #[error("stopped on request at tick {tick} of {ticks}")]
    Interrupted {
        /// How far the plant had come.
        tick: u64,
        /// How far it should have come.
        ticks: u64,
    },
    /// A process ended well but left no report.
    #[error("{process} left no readable report: {cause}")]
    NoReport {
        /// Which.
        process: String,
        /// Why.
        cause: String,
    },
    /// The run's files in shared memory could not be removed.
    #[error("the run's shared memory could not be removed: {cause}")]
    Cleanup {
        /// What the system says.
        cause: String,
    },
}
