//! How a foreign process is told to keep time.

use crate::clock::CLOCKS;
use crate::error::LinkError;
use std::time::Duration;

/// Shortest and longest time between two ticks that an external node keeps time with.
const TICK_S: std::ops::RangeInclusive<f64> = 1e-6..=1.0;

/// How time passes in an external node's run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalClock {
    /// Every token is waited for, and none may be lost.
    Lockstep,
    /// A late token is not waited for, and the newest counts.
    Realtime {
        /// Time between two ticks.
        tick: Duration,
    },
}

impl ExternalClock {
    /// The clock that `ANHYST_CLOCK` names, one of [`CLOCKS`], with `ANHYST_TICK_S`.
    ///
    /// # Errors
    /// [`LinkError::UnknownClock`] for another name, or a tick outside of [1e-6, 1] s.
    pub fn told(clock: &str, tick_s: f64) -> Result<Self, LinkError> {
        match CLOCKS.iter().position(|name| *name == clock) {
            Some(0) => Ok(Self::Lockstep),
            Some(_) if TICK_S.contains(&tick_s) => Ok(Self::Realtime {
                tick: Duration::from_secs_f64(tick_s),
            }),
            _ => Err(LinkError::UnknownClock {
                name: clock.into(),
                tick_s,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards what a driver is told: a name that this build does not know is refused, not taken for lockstep.
    #[test]
    fn clocks_have_names() {
        let tick = Duration::from_millis(1);
        let told = CLOCKS.map(|name| ExternalClock::told(name, 1e-3));
        let timed = Ok(ExternalClock::Realtime { tick });
        assert_eq!(told, [Ok(ExternalClock::Lockstep), timed.clone(), timed]);
        for (name, tick_s) in [("Lockstep", 1e-3), ("free_running", f64::NAN), ("free_running", 0.0)] {
            let refused = ExternalClock::told(name, tick_s).unwrap_err().to_string();
            assert!(refused.contains(&format!("ANHYST_CLOCK={name}")), "{refused}");
        }
    }
}
