//! What a judge hears of a tick.

/// One instant: reference and true displacement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    pub time_s: f64,
    pub reference_m: f64,
    pub displacement_m: f64,
}
