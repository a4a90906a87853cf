//! A request to stop, set by a signal handler or the launcher, seen by every wait.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Asks the loops of this process to end at their next wait.
pub fn request_stop() {
    STOP.store(true, Ordering::Relaxed);
}

/// True once [`request_stop`] was called.
pub fn stop_requested() -> bool {
    STOP.load(Ordering::Relaxed)
}
