//! A(t)·r(t): how many times the stated trajectory, A from one value to the next by the blend S, as `tuning.rs` has it.

use super::blend::Blend;
use super::jet::Jet;
use serde::{Deserialize, Serialize};

/// Factors and the times from which on they are approached.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Amplitude {
    /// Seconds, in order; no unit.
    changes: Vec<(f64, f64)>,
    over_s: f64,
}

impl Amplitude {
    /// From `from_s` on, over `over_s`.
    pub fn change(&mut self, from_s: f64, over_s: f64, factor: f64) {
        self.changes.push((from_s, factor));
        self.over_s = over_s;
    }

    /// A and its derivatives; none where it was never changed before this time.
    pub fn at(&self, time_s: f64) -> Option<Jet> {
        let begun = self.changes.iter().take_while(|(from_s, _)| *from_s < time_s);
        begun.fold(None, |before: Option<Jet>, (from_s, factor)| {
            if time_s >= from_s + self.over_s {
                return Some(Jet::constant(*factor));
            }
            let before = before.unwrap_or(Jet::constant(1.0));
            let blend = Blend {
                from_s: *from_s,
                length_s: self.over_s,
            };
            let missing = Jet::constant(*factor).plus(before.scaled(-1.0));
            Some(before.plus(blend.at(time_s).times(missing)))
        })
    }
}
