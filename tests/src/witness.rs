//! A plant that shares no code with `model/`: the witness with sensors, as a block of the loop.

use anhyst_ipc::{Block, CoilField, Measurement, NodeId, Previous, Truth};
use anhyst_witness::{Noise, Plant, Shaking};

/// Of a mode in a tick.
const SUBSTEPS: f64 = 4.0;

/// The witness with sensors: 10 nm and 1 A/m of white noise, and what `faults` adds to both.
pub struct Witness {
    pub plant: Plant,
    pub tick_s: f64,
    /// a at a time.
    pub shape_a_per_m: Box<dyn Fn(f64) -> f64>,
    /// Between the tip and the sensor, which is then where the cut is judged.
    pub mode: Option<Shaking>,
    /// What a load does to the tip, from the time, m.
    pub pushed_m: Box<dyn Fn(f64) -> f64>,
    /// More ticks than one from command to coil.
    pub late_ticks: usize,
    /// The sensor's end in the tick before.
    pub before_m: f64,
    pub of_displacement: Noise,
    pub of_field: Noise,
    pub faults: Option<SensorFaults>,
}

/// What sensors say wrongly.
pub struct SensorFaults {
    /// From the time to what is added to the displacement, m.
    pub added_m: Box<dyn FnMut(f64) -> f64>,
    pub field_gain: f64,
    pub field_zero_a_per_m: f64,
}

impl Block for Witness {
    const NODE: NodeId = NodeId::Plant;
    type Inputs = (Previous<CoilField>,);
    type Outputs = (Measurement, Truth);

    fn step(&mut self, tick: u64, (Previous(coil),): Self::Inputs) -> Self::Outputs {
        let time_s = tick as f64 * self.tick_s;
        let shape_a_per_m = (self.shape_a_per_m)(time_s);
        if tick > 0 {
            self.plant.advance(coil.field_a_per_m, shape_a_per_m, &mut |_| {});
        }
        let (end_m, h) = (self.plant.sensed_m() + (self.pushed_m)(time_s), self.tick_s);
        let sensed_m = self.mode.as_mut().map_or(end_m, |mode| {
            // Straight within a tick, in parts that follow a mode of some kilohertz.
            let (from_m, h) = (self.before_m, h / SUBSTEPS);
            let parts = (1..=SUBSTEPS as u32).map(|part| from_m + f64::from(part) / SUBSTEPS * (end_m - from_m));
            parts.fold(end_m, |_, to_m| mode.step(to_m, h))
        });
        self.before_m = end_m;
        let truth = Truth {
            displacement_m: if self.mode.is_some() {
                sensed_m
            } else {
                self.plant.tip_m() + (self.pushed_m)(time_s)
            },
            coil_field_a_per_m: self.plant.coil_field_a_per_m(),
            magnetization_a_per_m: self.plant.magnetization_a_per_m(),
            shape_a_per_m,
            ..Truth::default()
        };
        let (added_m, gain, zero) = match &mut self.faults {
            Some(own) => ((own.added_m)(time_s), own.field_gain, own.field_zero_a_per_m),
            None => (0.0, 1.0, 0.0),
        };
        let measurement = Measurement {
            displacement_m: sensed_m + added_m + 10e-9 * self.of_displacement.normal(),
            coil_field_a_per_m: gain * truth.coil_field_a_per_m + zero + self.of_field.normal(),
            ..Measurement::default()
        };
        (measurement, truth)
    }
}
