//! One clock for time stamps across processes. It feeds statistics only: no block ever sees it.

use rustix::time::{ClockId, clock_gettime};

/// `CLOCK_MONOTONIC` in ns, the same in every process of one machine.
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
