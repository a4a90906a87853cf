//! A rig: an actuator, its sensors, and the record of a run with a known command.

use crate::material::Material;
use crate::noise::Noise;
use crate::plant::{Hidden, Plant, Rod};
use crate::sensor::Sensor;
use std::collections::VecDeque;

/// Everything that a run depends on beside its command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    pub material: Material,
    pub rod: Rod,
    pub hidden: Hidden,
    pub sensor: Sensor,
    /// Of the field probe, rms, A/m.
    pub field_noise_a_per_m: f64,
    pub seed: u64,
}

/// What was commanded and measured, sample by sample from t = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub command_a_per_m: Vec<f64>,
    pub field_a_per_m: Vec<f64>,
    pub displacement_m: Vec<f64>,
}

impl Rig {
    /// Nothing hidden: the paper's material and rod, good sensors.
    pub const NOMINAL: Rig = Rig {
        material: Material::TERFENOL_D,
        rod: Rod::PRINTED,
        hidden: Hidden {
            amplifier_lag_s: 0.0,
            eddy_current_s: 0.0,
            creep: 0.0,
            friction_m: 0.0,
            backlash_m: 0.0,
            ripple: 0.0,
        },
        sensor: Sensor::GOOD,
        field_noise_a_per_m: 1.0,
        seed: 1,
    };

    /// A run; the command begins at 0.
    pub fn record(&self, tick_s: f64, command_a_per_m: Vec<f64>) -> Record {
        let mut plant = Plant::new(self.material, self.rod, self.hidden, tick_s);
        let (mut of_displacement, mut of_field) = (Noise::new(self.seed), Noise::new(!self.seed));
        let (substep_s, memory) = (plant.substep_s(), self.sensor.memory(plant.substep_s()));
        let mut way = VecDeque::from([0.0]);
        let (mut field_a_per_m, mut displacement_m) = (Vec::new(), Vec::new());
        for (sample, &command) in command_a_per_m.iter().enumerate() {
            if sample > 0 {
                plant.advance(command, self.material.shape_a_per_m, &mut |seen| {
                    way.push_back(seen);
                    if way.len() > memory {
                        way.pop_front();
                    }
                });
            }
            field_a_per_m.push(plant.coil_field_a_per_m() + self.field_noise_a_per_m * of_field.normal());
            displacement_m.push(self.sensor.measure(&way, substep_s, &mut of_displacement));
        }
        Record {
            command_a_per_m,
            field_a_per_m,
            displacement_m,
        }
    }
}
