//! A rig to judge by: an actuator of the same physics as `model/`, written apart from it, so that what judges shares no
//! code and no method with what is judged. Tests only; it depends on nothing.
//!
//! `material.rs` holds the algebraic form of the hysteresis where `model/` integrates its derivative, `plant.rs` one system
//! of differential equations from command to tip, by Runge and Kutta's fourth order, where `model/` has a chain of exact
//! propagators, `sensor.rs` what is said of the tip, `rig.rs` a recorded run, `drive.rs` the commands.
//! What a rig has beside (hum, 1/f noise, a wrong probe, a history) belongs into the file of its place in that chain.

mod drive;
mod material;
mod noise;
mod plant;
mod rig;
mod sensor;

pub use drive::excitation;
pub use material::{Curve, Material};
pub use noise::Noise;
pub use plant::{Hidden, Plant, Rod};
pub use rig::{Record, Rig};
pub use sensor::Sensor;
