//! Ctrl-C, SIGTERM and a closed terminal ask the loop to end, so that recordings are closed and shared memory is cleaned.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

const SIGNALS: [i32; 3] = [SIGHUP, SIGINT, SIGTERM];

/// Installs the handlers.
pub fn install() {
    for signal in SIGNALS {
        // Registering fails only for signals that may not be caught; these may.
        let _ = signal_hook::flag::register(signal, anhyst_ipc::stop_flag());
    }
}

/// The same for work that looks seldom whether it is to end: a second signal ends the program at once.
pub fn install_once() {
    for signal in SIGNALS {
        let _ = signal_hook::flag::register_conditional_default(signal, anhyst_ipc::stop_flag());
    }
    install();
}
