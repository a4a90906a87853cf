//! What the guard holds a coil's field against.

use serde::{Deserialize, Serialize};

/// What is believed of the amplifier, beside a gain of 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BelievedCoil {
    /// More ticks from command to coil than the two of computing and hold.
    pub delay_ticks: u32,
    /// Time constant; 0: none.
    pub lag_s: f64,
    /// Whether late and early are events: not where ticks may be missed.
    pub timing: bool,
}
