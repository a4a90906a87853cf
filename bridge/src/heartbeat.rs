//! What a bridge tells the other one all the time: that it lives, where the processes of its side stand, and why it ends.

use anhyst_ipc::Progress;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How often.
pub const PERIOD: Duration = Duration::from_millis(5);

/// One of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// The processes of the bridge's side. What they had sent when this was noted has been sent before this.
    pub here: Vec<Progress>,
    /// True when all processes of both sides have come to the end.
    pub done: bool,
    /// Why the bridge ends before that.
    pub farewell: Option<String>,
}
