//! A request to stop, set by a signal handler or the launcher, seen by every wait.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

static STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// The flag itself, for a signal handler.
pub fn stop_flag() -> Arc<AtomicBool> {
    STOP.clone()
}

/// Asks the loops of this process to end at their next wait.
pub fn request_stop() {
    STOP.store(true, Ordering::Relaxed);
}

/// Takes a request back: for a program that outlives the run that it asked to end.
pub fn forget_stop() {
    STOP.store(false, Ordering::Relaxed);
}

/// True once a stop was asked for.
pub fn stop_requested() -> bool {
    STOP.load(Ordering::Relaxed)
}
