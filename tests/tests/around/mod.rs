//! Estimator, inverse, controller and guard of a scenario in this process, around its own plant or around the witness, and what
//! came of the cut.

#![allow(dead_code, reason = "every test file uses a part of it")]

use anhyst_ipc::{
    Block, CoilField, Connections, Demand, Estimate, Measurement, Node, NodeId, Now, SafeField, Stage, Truth,
};
use anhyst_launch::assemble;
use anhyst_scenario::Scenario;
use anhyst_tests::Witness;
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
