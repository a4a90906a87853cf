//! What the integrator does while the plant does not get what was asked for.
//!
//! I the integrator (m), e the error (m), T the tick (s), w the demand and a what was applied of it (m of p, tick before):
//!
//! - `None`:            I ← I + T·ki·e, whatever happens.
//! - `Clamping`:        I ← I while (w − a)·ki·e > 0, that is, while integrating would ask for more of what is not to be had.
//! - `BackCalculation`: I ← I + T·(ki·e + (a − w)/Tt): the integrator returns to what is possible with the time constant Tt.
//!
//! Where only the side of a limit is known and not a (the guard cut the field), BackCalculation does as Clamping does.
//! While the loop is open (the guard at or on its way to the safe field) all but `None` leave I alone.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Strategy against integrator windup: the equations stand at the head of this file's documentation.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum AntiWindup {
    /// I ← I + T·ki·e always; for comparison.
    None,
    /// I ← I while integrating would ask for more of what is not to be had (conditional integration).
    #[default]
    Clamping,
    /// I ← I + T·(ki·e + (a − w)/Tt).
    BackCalculation {
        /// Tt in s. Short empties the integrator at once, long lets it wind up: kp/ki is a usual first choice.
        tracking_time_s: f64,
    },
}

/// What became of the demand of the tick before.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Applied {
    /// All of it.
    #[default]
    Fully,
    /// Off by w − a (m of quasi-static displacement), signed: positive if more was wanted than was to be had.
    Short {
        /// w − a.
        excess_m: f64,
    },
    /// Cut by an unknown amount; positive if more was wanted than was to be had.
    Cut {
        /// Sign of w − a; only the sign counts.
        side: f64,
    },
    /// Nothing: the guard goes its own way.
    Open,
}

impl Applied {
    /// True if anything was missing.
    pub fn limited(&self) -> bool {
        *self != Self::Fully
    }
}

impl AntiWindup {
    /// The integrator's change in one tick and whether integration was stopped or bent. `growth_m` is T·ki·e.
    pub(crate) fn change_m(&self, growth_m: f64, applied: Applied, tick_s: f64) -> (f64, bool) {
        match (self, applied) {
            (Self::None, _) | (_, Applied::Fully) => (growth_m, false),
            (_, Applied::Open) => (0.0, true),
            (Self::BackCalculation { tracking_time_s }, Applied::Short { excess_m }) => {
                (growth_m - tick_s / tracking_time_s * excess_m, true)
            }
            (_, Applied::Short { excess_m: side } | Applied::Cut { side }) => {
                let worse = side * growth_m > 0.0;
                (if worse { 0.0 } else { growth_m }, worse)
            }
        }
    }

    /// Refuses a tracking time below a tick, and a strategy for an integrator that does not integrate.
    pub(crate) fn validate(&self, ki_per_s: f64, tick_s: f64) -> Result<(), Invalid> {
        let Self::BackCalculation { tracking_time_s } = self else {
            return Ok(());
        };
        let path = "anti_windup.tracking_time_s";
        Invalid::unless_positive(path, *tracking_time_s, "s")?;
        if *tracking_time_s < tick_s {
            let sentence = format!(
                "{tracking_time_s} s is below one tick of {tick_s} s: the integrator would overshoot its way back"
            );
            return Err(Invalid::new(path, sentence));
        }
        if ki_per_s == 0.0 {
            return Err(Invalid::new(
                "anti_windup",
                "ki_per_s is 0 1/s, so there is no integrator that could wind up",
            ));
        }
        Ok(())
    }
}
