//! Real-time runs: what the system is asked for, the loop that does not wait for what is late, and what is counted.

mod empty;
mod looping;
mod machine;
mod replay;
mod report;
mod summary;

pub use empty::empty_stage;
pub use looping::{Timed, cpu_s, pace};
pub use machine::{Attempt, ask, take_short_turns};
pub use replay::{Logs, replay};
pub use report::{Distribution, RealtimeReport, Restart};
pub use summary::{ForeignCount, RealtimeSummary};
