//! Estimator, inverse, controller and guard of a scenario in this process, around its own plant or around the witness, and what
//! came of the cut.

#![allow(dead_code, reason = "every test file uses a part of it")]

pub mod rough;

use anhyst_ipc::{
    Block, CoilField, Connections, Demand, Estimate, Measurement, Node, NodeId, Now, Previous, SafeField, Stage, Truth,
};
use anhyst_launch::assemble;
use anhyst_scenario::Scenario;
use anhyst_witness::{Noise, Plant, Shaking};
use std::collections::VecDeque;

/// What is commanded in tick k is in the coil at t_k+2, and a straight line joins what was said. One that is late takes more ticks.
#[derive(Default)]
struct IdealAmplifier {
    on_the_way: VecDeque<f64>,
}

impl IdealAmplifier {
    fn late(ticks: usize) -> Self {
        IdealAmplifier {
            on_the_way: vec![0.0; 1 + ticks].into(),
        }
    }
}

impl Block for IdealAmplifier {
    const NODE: NodeId = NodeId::Amplifier;
    type Inputs = (Now<SafeField>,);
    type Outputs = (CoilField,);

    fn step(&mut self, _tick: u64, (Now(safe),): Self::Inputs) -> Self::Outputs {
        self.on_the_way.push_back(safe.field_a_per_m);
        let field_a_per_m = self.on_the_way.pop_front().unwrap_or_default();
        (CoilField {
            field_a_per_m,
            ..CoilField::default()
        },)
    }
}

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

/// A cut and all that was said in it.
pub struct Cut {
    /// The first tick in which the guard acted.
    pub guarded: Option<u64>,
    pub measured: Vec<Measurement>,
    pub safe: Vec<SafeField>,
    /// Over the judged ticks.
    pub rms_m: f64,
    pub max_m: f64,
    pub shape_rms_a_per_m: f64,
}

impl std::fmt::Debug for Cut {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let nm = |value: f64| 1e9 * value;
        write!(
            formatter,
            "rms {:.1} nm, max {:.1} nm, a off by {:.1} A/m rms",
            nm(self.rms_m),
            nm(self.max_m),
            self.shape_rms_a_per_m
        )
    }
}

/// Runs the scenario, with the witness in the place of plant and amplifier where there is one; the guard must have nothing to do.
pub fn cut(scenario: &Scenario, witness: Option<Witness>) -> Cut {
    let cut = guarded_cut(scenario, witness);
    assert_eq!(cut.guarded, None, "the guard acts: {cut:?}");
    cut
}

/// The same where the guard may have something to do.
pub fn guarded_cut(scenario: &Scenario, witness: Option<Witness>) -> Cut {
    let (tick_s, ticks) = (scenario.tick_s, scenario.ticks());
    let mut connections = Connections::new(NodeId::LOOP_ORDER, Vec::new(), None);
    let mut stages: Vec<Box<dyn Stage>> = Vec::new();
    let foreign = witness.as_ref().map(|witness| witness.late_ticks);
    match witness {
        Some(witness) => stages.push(Box::new(Node::open(witness, &mut connections, ticks).unwrap())),
        None => stages.push(assemble::stage(NodeId::Plant, scenario, &mut connections).unwrap()),
    }
    for node in [NodeId::Estimator, NodeId::Controller, NodeId::Inverse, NodeId::Guard] {
        stages.push(assemble::stage(node, scenario, &mut connections).unwrap());
    }
    stages.push(match foreign {
        Some(late) => Box::new(Node::open(IdealAmplifier::late(late), &mut connections, ticks).unwrap()),
        None => assemble::stage(NodeId::Amplifier, scenario, &mut connections).unwrap(),
    });
    let mut guarded = None;
    let (mut measured, mut asked) = (Vec::new(), Vec::new());
    let (mut square, mut max_m, mut of_shape, mut judged) = (0.0, 0.0_f64, 0.0, 0);
    for tick in 0..ticks {
        stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
        let truth: Truth = connections.last().unwrap();
        let (demand, estimate): (Demand, Estimate) = (connections.last().unwrap(), connections.last().unwrap());
        let safe: SafeField = connections.last().unwrap();
        if safe.event != 0 {
            guarded.get_or_insert(tick);
        }
        measured.push(connections.last().unwrap());
        asked.push(safe);
        if (tick as f64 * tick_s) < scenario.expect.settling_s {
            continue;
        }
        let error_m = demand.reference_m - truth.displacement_m;
        square += error_m * error_m;
        max_m = max_m.max(error_m.abs());
        of_shape += (estimate.shape_a_per_m - truth.shape_a_per_m).powi(2);
        judged += 1;
    }
    let rms = |square: f64| (square / f64::from(judged)).sqrt();
    Cut {
        guarded,
        measured,
        safe: asked,
        rms_m: rms(square),
        max_m,
        shape_rms_a_per_m: rms(of_shape),
    }
}
