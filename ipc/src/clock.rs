//! One clock for time stamps across processes, which no block ever sees, and the names of the ways to keep time.

use rustix::time::{ClockId, clock_gettime};

/// The names of the three ways to keep time, as foreign processes are told them.
pub const CLOCKS: [&str; 3] = ["lockstep", "free_running", "paced_by_measurement"];

/// `CLOCK_MONOTONIC` in ns, the same in every process of one machine.
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
