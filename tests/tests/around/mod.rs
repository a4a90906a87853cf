//! Estimator, inverse, controller and guard of a scenario in this process, around its own plant or around the witness, and what
//! came of the cut.

use anhyst_ipc::{
    Block, CoilField, Connections, Demand, Estimate, Measurement, Node, NodeId, Now, Previous, SafeField, Stage, Truth,
};
use anhyst_launch::assemble;
use anhyst_scenario::Scenario;
use anhyst_witness::{Noise, Plant};

/// What is commanded in tick k is in the coil at t_k+2, and a straight line joins what was said.
#[derive(Default)]
struct IdealAmplifier {
    command_a_per_m: f64,
}

impl Block for IdealAmplifier {
    const NODE: NodeId = NodeId::Amplifier;
    type Inputs = (Now<SafeField>,);
    type Outputs = (CoilField,);

    fn step(&mut self, _tick: u64, (Now(safe),): Self::Inputs) -> Self::Outputs {
        let field_a_per_m = std::mem::replace(&mut self.command_a_per_m, safe.field_a_per_m);
        (CoilField {
            field_a_per_m,
            ..CoilField::default()
        },)
    }
}

/// The witness with sensors: 10 nm and 1 A/m of white noise, and what `faults` adds to both.
pub struct Witness {
    pub plant: Plant,
    pub tick_s: f64,
    /// a at a time.
    pub shape_a_per_m: fn(f64) -> f64,
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
        let truth = Truth {
            displacement_m: self.plant.tip_m(),
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
            displacement_m: self.plant.sensed_m() + added_m + 10e-9 * self.of_displacement.normal(),
            coil_field_a_per_m: gain * truth.coil_field_a_per_m + zero + self.of_field.normal(),
            ..Measurement::default()
        };
        (measurement, truth)
    }
}

/// A cut and all that was said in it.
#[allow(dead_code, reason = "not every test that has this module exports its cut")]
pub struct Cut {
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

/// Runs the scenario, with the witness in the place of plant and amplifier where there is one.
pub fn cut(scenario: &Scenario, witness: Option<Witness>) -> Cut {
    let (tick_s, ticks) = (scenario.tick_s, scenario.ticks());
    let mut connections = Connections::new(NodeId::LOOP_ORDER, Vec::new(), None);
    let mut stages: Vec<Box<dyn Stage>> = Vec::new();
    let foreign = witness.is_some();
    match witness {
        Some(witness) => stages.push(Box::new(Node::open(witness, &mut connections, ticks).unwrap())),
        None => stages.push(assemble::stage(NodeId::Plant, scenario, &mut connections).unwrap()),
    }
    for node in [NodeId::Estimator, NodeId::Controller, NodeId::Inverse, NodeId::Guard] {
        stages.push(assemble::stage(node, scenario, &mut connections).unwrap());
    }
    stages.push(if foreign {
        Box::new(Node::open(IdealAmplifier::default(), &mut connections, ticks).unwrap())
    } else {
        assemble::stage(NodeId::Amplifier, scenario, &mut connections).unwrap()
    });
    let (mut measured, mut asked) = (Vec::new(), Vec::new());
    let (mut square, mut max_m, mut of_shape, mut judged) = (0.0, 0.0_f64, 0.0, 0);
    for tick in 0..ticks {
        stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
        let truth: Truth = connections.last().unwrap();
        let (demand, estimate): (Demand, Estimate) = (connections.last().unwrap(), connections.last().unwrap());
        let safe: SafeField = connections.last().unwrap();
        assert_eq!(safe.event, 0, "the guard acts in tick {tick}");
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
        measured,
        safe: asked,
        rms_m: rms(square),
        max_m,
        shape_rms_a_per_m: rms(of_shape),
    }
}
