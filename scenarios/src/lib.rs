//! A scenario is the whole run: seed, tick, placement, material, plant, estimator, inverse, controller, guard, injected
//! faults, recording, and what must hold.

mod belief;
mod blocks;
mod changes;
mod clock;
mod derive;
mod error;
mod external;
mod faults;
mod foresight;
mod injection;
mod load;
mod margins;
mod material;
mod misread;
mod scenario;
mod source;
mod stepped;
mod text;
mod units;
mod validate;
mod warnings;
mod wiring;

pub use belief::Late;
pub use blocks::InverseBlock;
pub use clock::{Clock, Pacing, Realtime};
pub use error::ScenarioError;
pub use faults::{Fault, LinkFault, ProcessFault, ProcessKind};
pub use foresight::{Foresight, gives_m};
pub use load::{ScenarioText, Setting, load, load_changed};
pub use material::{load_model, load_with};
pub use scenario::{Expect, MaterialSource, Placement, Recording, Resonance, Rod, Scenario};
pub use source::items;
pub use stepped::{Control, Rig, SteppedLoop};
pub use text::{BUILT_IN_AMPLIFIER, parse, to_ron};
pub use units::Units;
pub use wiring::wires;
