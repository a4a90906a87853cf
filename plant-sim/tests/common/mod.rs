//! A plant to start from: at rest and cold, without a cut or noise.
#![allow(dead_code, reason = "each test file uses its own part of this")]

use anhyst_model::{Material, RodConstants};
use anhyst_plant_sim::{
    CoilLoss, Cut, ExpansionSettings, Plant, PlantRod, PlantSettings, Sensors, ShapeCourse, ThermalCircuit,
};

pub const TICK_S: f64 = 5e-5;

pub fn quiet() -> PlantSettings {
    PlantSettings {
        shape: ShapeCourse::Constant { a_per_m: 7012.0 },
        rod: PlantRod::TwoPole,
        sensors: Sensors::default(),
        start_temperature_k: 293.0,
        heating: None,
        expansion: None,
        cut: Cut::Off,
        contact: Default::default(),
        effects: None,
        material: None,
        material_file: None,
        two_pole: None,
    }
}

pub fn plant_of(settings: &PlantSettings, tick_s: f64, seed: u64) -> Plant {
    Plant::new(settings, &Material::terfenol_d(), &RodConstants::paper(), tick_s, seed).unwrap()
}

pub fn circuit() -> ThermalCircuit {
    ThermalCircuit {
        ambient_k: 293.0,
        heat_capacity_j_per_k: 50.0,
        resistance_k_per_w: 2.0,
    }
}

/// Of copper.
pub fn copper_coil() -> CoilLoss {
    CoilLoss {
        resistance_ohm: 3.0,
        field_per_ampere: 1e4,
        copper_temperature_coefficient_per_k: 0.0039,
        reference_temperature_k: 293.0,
    }
}

pub fn expansion() -> ExpansionSettings {
    ExpansionSettings {
        coefficient_per_k: 12e-6,
        reference_temperature_k: 293.0,
    }
}
