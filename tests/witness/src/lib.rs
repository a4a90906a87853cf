//! Rigs to judge by: an actuator of the same physics as `model/`, written apart from it, so that what judges shares no
//! code and no method with what is judged. Tests and studies only; it depends on nothing.
//!
//! `material.rs` holds the algebraic form of the hysteresis where `model/` integrates its derivative, `operator.rs` other laws by their definitions, `amplifier.rs` and `plant.rs` one
//! system of differential equations from command to tip, by Runge and Kutta's fourth order, where `model/` has a chain of exact
//! propagators, `hidden.rs` what can be hidden there, `sensor.rs` what is said of the tip, `surroundings.rs` what a rig has beside (hum,
//! 1/f noise, a wrong probe, a past), `rig.rs` a recorded run, `drive.rs` the commands. `effect.rs` and `nuisance.rs` draw what is
//! hidden and what disturbs, `drawn.rs` a whole run with its truth, `labels.rs` writes runs down. `shared.rs` finds
//! what others measured.

mod amplifier;
mod draw;
mod drawn;
mod drive;
mod effect;
mod hidden;
mod labels;
mod material;
mod noise;
mod nuisance;
mod operator;
mod plant;
mod rig;
mod sensor;
mod shared;
mod surroundings;

pub use drawn::{Made, NotMade, Part, Truth, Wanted};
pub use drive::{Drive, excitation};
pub use effect::{Effect, Value};
pub use hidden::{Constants, Hidden, Laws};
pub use labels::write_runs;
pub use material::{Curve, Material};
pub use noise::Noise;
pub use nuisance::Nuisance;
pub use operator::{Element, Law, Operator, Warp};
pub use plant::{Plant, Rod};
pub use rig::{Record, Rig};
pub use sensor::{Mode, Sensor, Shaking};
pub use shared::shared;
pub use surroundings::{Filter, Past, Surroundings, Tone};
