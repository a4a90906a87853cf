//! What the guard does about a fault, and how it comes back: one [`Response`] an event.
//!
//! | reaction     | what leaves the guard                                  | reached after                          |
//! |--------------|--------------------------------------------------------|----------------------------------------|
//! | `Hold`       | the field of the tick before                           | 1 tick                                 |
//! | `FallBack`   | that field once more, then the nominal inverse's       | 1 tick, and the inverse's blend        |
//! | `RampToSafe` | a ramp to the safe field, then the safe field          | [`crate::GuardSettings::most_ramp_ticks`] |
//!
//! A field that is held for `hold_at_most_s` goes on to the safe field. Every way back walks: nothing steps.

use crate::Event;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is done about a fault, weakest first: a stronger one replaces a weaker one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Reaction {
    /// The inverse is told to leave the estimate alone and to use the material's nominal `a` and its own memory.
    FallBack,
    /// The field stays where it is.
    Hold,
    /// The field goes to the safe field.
    RampToSafe,
}

/// How the guard comes back when the cause has gone.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum WayBack {
    /// Only when somebody asks: [`crate::Guard::rearm`], or an instant of `monitors.reset_at_s`.
    #[default]
    Reset,
    /// By itself, after so much time without any fault.
    AfterHealth {
        /// That time.
        for_s: f64,
    },
}

/// Reaction to a fault and the way back from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// What is done.
    pub reaction: Reaction,
    /// When it ends.
    #[serde(default)]
    pub way_back: WayBack,
}

/// Responses that differ from [`Event::usual_response`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Responses(pub BTreeMap<Event, Response>);

impl Responses {
    /// What is done about a fault.
    pub fn to(&self, event: Event) -> Response {
        self.0.get(&event).copied().unwrap_or_else(|| event.usual_response())
    }
}

/// Usual time of health after which a broken estimate is trusted again.
const ESTIMATE_HEALTH_S: f64 = 0.1;

impl Event {
    /// What is done about the event where the settings say nothing: the safe field and a reset, but for the estimate, which
    /// the loop can do without.
    pub fn usual_response(self) -> Response {
        match self {
            Event::EstimateNotFinite | Event::EstimateStale | Event::EstimateOutside | Event::EstimateUninformed => {
                Response {
                    reaction: Reaction::FallBack,
                    way_back: WayBack::AfterHealth {
                        for_s: ESTIMATE_HEALTH_S,
                    },
                }
            }
            _ => Response {
                reaction: Reaction::RampToSafe,
                way_back: WayBack::Reset,
            },
        }
    }
}
