//! A rig: an actuator, its sensors, what is around them, and the record of a run with a known command.

use crate::hidden::Hidden;
use crate::material::Material;
use crate::noise::Noise;
use crate::operator::Law;
use crate::plant::{Plant, Rod};
use crate::sensor::Sensor;
use crate::surroundings::Surroundings;

/// Everything that a run depends on beside its command.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    pub material: Material,
    /// In the place of the material's curves.
    pub law: Option<Law>,
    pub rod: Rod,
    pub hidden: Hidden,
    pub sensor: Sensor,
    pub surroundings: Surroundings,
    /// Of the field probe, rms, A/m.
    pub field_noise_a_per_m: f64,
    /// Step of the measured field, A/m; 0 is none.
    pub field_resolution_a_per_m: f64,
    /// Steps of integration a tick, at least.
    pub substeps: usize,
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
        law: None,
        rod: Rod::PRINTED,
        hidden: Hidden::NOTHING,
        sensor: Sensor::GOOD,
        surroundings: Surroundings::NOTHING,
        field_noise_a_per_m: 1.0,
        field_resolution_a_per_m: 0.0,
        substeps: 16,
        seed: 1,
    };

    /// A run; the command begins at 0.
    pub fn record(&self, tick_s: f64, command_a_per_m: Vec<f64>) -> Record {
        self.read(tick_s, &self.answer(tick_s, command_a_per_m))
    }

    /// What is written down of an answer.
    pub(crate) fn read(&self, tick_s: f64, answer: &Record) -> Record {
        let noise_m = self.noise_m(tick_s, answer.displacement_m.len());
        let mut of_field = Noise::new(!self.seed);
        let time_s = |row: usize| row as f64 * tick_s;
        let displacement_m = answer.displacement_m.iter().zip(&noise_m).enumerate();
        let displacement_m = displacement_m
            .map(|(row, (y, noise))| {
                let read = y + noise + self.surroundings.added_m(time_s(row));
                stepped(read, self.sensor.resolution_m)
            })
            .collect();
        let field_a_per_m = answer.field_a_per_m.iter().enumerate();
        let field_a_per_m = field_a_per_m
            .map(|(row, field)| {
                let read = self.surroundings.probed(*field, time_s(row)) + self.field_noise_a_per_m * of_field.normal();
                stepped(read, self.field_resolution_a_per_m)
            })
            .collect();
        Record {
            command_a_per_m: answer.command_a_per_m.clone(),
            field_a_per_m,
            displacement_m,
        }
    }

    /// The same without noise, lines, drift and steps; the coil's true field.
    pub fn answer(&self, tick_s: f64, command_a_per_m: Vec<f64>) -> Record {
        let shape = self.material.shape_a_per_m;
        let mut plant = self.plant(tick_s);
        for command in self.surroundings.before(tick_s, self.is_one_sided()) {
            plant.advance(self.surroundings.commanded(command), shape, &mut |_| ());
        }
        let (points, h) = (plant.substeps(), plant.substep_s());
        let (mut way, mut fields) = (vec![plant.sensed_m()], vec![plant.coil_field_a_per_m()]);
        for command in command_a_per_m.iter().skip(1) {
            plant.advance(self.surroundings.commanded(*command), shape, &mut |plant| {
                way.push(plant.sensed_m());
                fields.push(plant.coil_field_a_per_m());
            });
        }
        let mut seen = self.sensor.look(way, h, self.hidden.laws);
        if let Some(filter) = &self.surroundings.filter {
            filter.pass(&mut seen, h);
            if filter.field_too {
                filter.pass(&mut fields, h);
            }
        }
        Record {
            command_a_per_m,
            field_a_per_m: fields.into_iter().step_by(points).collect(),
            displacement_m: seen.into_iter().step_by(points).collect(),
        }
    }

    /// Noise of the displacement, lines and drift apart, m.
    pub fn noise_m(&self, tick_s: f64, rows: usize) -> Vec<f64> {
        let mut noise = Noise::new(self.seed);
        let Some(filter) = &self.surroundings.filter else {
            return self
                .surroundings
                .noise_m(self.sensor.noise_m, rows, 1, tick_s, &mut noise);
        };
        let (points, h) = (self.substeps, tick_s / self.substeps as f64);
        let mut path = self
            .surroundings
            .noise_m(self.sensor.noise_m, rows, points, h, &mut noise);
        filter.pass(&mut path, h);
        path.into_iter().step_by(points).collect()
    }

    pub(crate) fn plant(&self, tick_s: f64) -> Plant {
        Plant::new(self.material, self.rod, self.hidden, tick_s)
            .with_law(self.law.clone())
            .with_substeps(self.substeps)
    }

    /// Whether it is driven from 0 upwards only.
    pub(crate) fn is_one_sided(&self) -> bool {
        self.law.as_ref().is_some_and(|law| law.one_sided)
    }
}

fn stepped(value: f64, step: f64) -> f64 {
    if step > 0.0 {
        (value / step).round() * step
    } else {
        value
    }
}
