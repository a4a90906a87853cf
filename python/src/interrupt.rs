//! Ctrl-C in long work: Python hears signals on its own thread only, so the work is done on another one.

use anhyst_identify::parallel::{GivenUp, give_up, go_on};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::thread;
use std::time::Duration;

/// Between two looks at signals.
const LOOK: Duration = Duration::from_millis(5);

/// Does a work; on Ctrl-C gives it up and raises what Python has for it.
pub fn interruptible<Done: Send>(py: Python<'_>, work: impl FnOnce() -> Done + Send) -> PyResult<Done> {
    thread::scope(|scope| {
        let worker = scope.spawn(work);
        let mut raised = None;
        while raised.is_none() && !worker.is_finished() {
            py.detach(|| thread::sleep(LOOK));
            raised = py.check_signals().err();
        }
        if raised.is_some() {
            give_up();
        }
        let done = py.detach(|| worker.join());
        go_on();
        match (done, raised) {
            (_, Some(raised)) => Err(raised),
            (Ok(done), None) => Ok(done),
            // Another thread of this program was interrupted.
            (Err(payload), None) if payload.is::<GivenUp>() => Err(PyKeyboardInterrupt::new_err(())),
            (Err(payload), None) => resume_unwind(payload),
        }
    })
}
