//! The last stage on our side: limits, watchdog, and the way to the safe field. Knows nothing of control.

mod believed;
mod coil;
mod event;
mod following;
mod guard;
mod limits;
mod monitors;
mod node;
mod response;
mod settings;
mod watch;

pub use believed::BelievedCoil;
pub use event::Event;
pub use following::{Following, GainAndShift};
pub use guard::{Guard, Rearm, State};
pub use monitors::{CoilWatching, CurrentMonitor, EstimateMonitor, Monitors, TrackingMonitor};
pub use response::{Reaction, Response, Responses, WayBack};
pub use settings::{GuardSettings, StuckSettings};
pub use watch::Beliefs;
