//! The rig that is not there: a simulated amplifier and a simulated plant (coil, rod, tool, heat, sensors).
//!
//! Field → hysteresis at the true a(t) → magnetization → free strain (+ thermal expansion) → rod ← cutting force; coil loss
//! and cutting heat → rod's temperature → a and expansion. Sensors add noise and resolution. All of it in [`Plant`];
//! [`PlantNode`] and [`AmplifierNode`] put it into the loop. The same seed gives the same bits.

mod chain;
mod cutting;
mod error;
mod milling;
mod node;
mod plant;
mod rod;
mod settings;
mod shape;
mod watchdog;

pub use cutting::CuttingProcess;
pub use error::PlantError;
pub use milling::{Contact, Cut, Milling};
pub use node::{AmplifierNode, PlantNode};
pub use plant::{Plant, PlantState, Readings};
pub use rod::{PlantRod, TWO_POLE_ELEMENTS};
pub use settings::{Heating, PlantSettings, Sensors, TemperatureSensor, validate_amplifier};
pub use shape::ShapeCourse;
pub use watchdog::WatchdogSettings;
