//! What goes on inside a simulated run, by sample: what probes, curves and places of a gap are counted over.

use anhyst_model::ActuatorOutputs;

use crate::plant::Plant;

/// What went on inside a run, by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    /// What drives the model, A/m.
    pub drive: Vec<f64>,
    pub field: Vec<f64>,
    pub magnetization: Vec<f64>,
    pub output: Vec<f64>,
    /// None for a sweep without time.
    pub tick_s: Option<f64>,
    pub temperature: Option<Vec<f64>>,
}

impl Signals {
    /// Some of the rows.
    pub fn part(&self, rows: std::ops::Range<usize>) -> Signals {
        Signals {
            drive: self.drive[rows.clone()].to_vec(),
            field: self.field[rows.clone()].to_vec(),
            magnetization: self.magnetization[rows.clone()].to_vec(),
            output: self.output[rows.clone()].to_vec(),
            tick_s: self.tick_s,
            temperature: self.temperature.as_ref().map(|own| own[rows].to_vec()),
        }
    }
}

/// Of every run.
pub(crate) fn signals(plant: &Plant, outputs: &[ActuatorOutputs]) -> Vec<Signals> {
    let runs = outputs.iter().zip(&plant.runs);
    runs.map(|(outputs, run)| Signals {
        drive: run.drive_a_per_m.clone(),
        field: outputs.field_a_per_m.clone(),
        magnetization: outputs.magnetization_a_per_m.clone(),
        output: if plant.magnetic() {
            &outputs.magnetization_a_per_m
        } else {
            &outputs.displacement_m
        }
        .clone(),
        tick_s: run.tick_s,
        temperature: run.temperature_k.as_ref().map(|_| outputs.temperature_k.clone()),
    })
    .collect()
}
