//! The rig that is not there: a simulated amplifier and a simulated plant (coil, rod, tool, heat, sensors).
//!
//! The plant is the [`anhyst_model::Actuator`] with a(t), heat, a cut at its tip and noisy sensors around it: [`Plant`];
//! [`PlantNode`] and [`AmplifierNode`] put plant and amplifier into the loop. The same seed gives the same bits.

mod cutting;
mod error;
mod heating;
mod milling;
mod node;
mod plant;
mod settings;
mod shape;
mod watchdog;

pub use cutting::CuttingProcess;
pub use error::PlantError;
pub use heating::{CoilLoss, ExpansionSettings, Heating, ThermalCircuit};
pub use milling::{Contact, Cut, Milling};
pub use node::{AmplifierNode, PlantNode};
pub use plant::{Plant, PlantState, Readings, TWO_POLE_ELEMENTS};
pub use settings::{PlantRod, PlantSettings, SensorFaults, Sensors, TemperatureSensor, validate_amplifier};
pub use shape::ShapeCourse;
pub use watchdog::WatchdogSettings;
