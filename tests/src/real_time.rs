//! What a run in real time must be on any machine, also on one that is so busy that hardly a tick is in time.

use crate::Finished;
use serde_json::Value;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many tokens at the least must have gone from one process to another: more is a matter of the machine.
pub const A_FEW: usize = 10;

/// The summary of a run that came to its end. Where most ticks went unjudged, it must not say that the run held.
pub fn summary_as_judged(finished: &Finished) -> Value {
    let summary: Value = serde_json::from_str(&finished.out)
        .unwrap_or_else(|error| panic!("{error}: {}\n{}", finished.out, finished.err));
    let ticks = |which: &str| summary[which].as_u64().unwrap();
    let mostly_judged = ticks("judged_ticks") > 0 && ticks("judged_ticks") >= ticks("unjudged_ticks");
    let code = if mostly_judged { 0 } else { 1 };
    assert_eq!(finished.code, Some(code), "{}\n{}", summary["failures"], finished.err);
    summary
}

/// One real-time run at a time: with priority, several would leave a process that has yet to start no time on two cores.
pub fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}
