//! Ctrl-C, SIGTERM and a closed terminal ask the loop to end, so that recordings are closed and shared memory is cleaned.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Installs the handlers.
pub fn install() {
    for signal in [SIGHUP, SIGINT, SIGTERM] {
        // Registering fails only for signals that may not be caught; these may.
        let _ = signal_hook::flag::register(signal, anhyst_ipc::stop_flag());
    }
}
