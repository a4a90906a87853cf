//! Guards the loop against knowing its plant by heart: estimator, inverse, controller and guard of milling.ron around an
//! amplifier, a plant and sensors that share no code with the model that they believe in.

use anhyst_ipc::{
    Block, CoilField, Connections, Demand, Estimate, Measurement, Node, NodeId, Now, Previous, SafeField, Stage, Truth,
};
use anhyst_launch::assemble;
use anhyst_scenario::load;
use anhyst_tests::repository;
use anhyst_witness::{Hidden, Material, Noise, Plant, Rod};

/// 1.5 times what is reached.
const RMS_M: f64 = 5e-9;
const MAX_M: f64 = 21.6e-9;
/// Errors count from here, as in the scenario.
const SETTLING_S: f64 = 0.5;

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

/// The witness with the sensors and the drift of milling.ron.
struct Witness {
    plant: Plant,
    tick_s: f64,
    of_displacement: Noise,
    of_field: Noise,
}

impl Block for Witness {
    const NODE: NodeId = NodeId::Plant;
    type Inputs = (Previous<CoilField>,);
    type Outputs = (Measurement, Truth);

    fn step(&mut self, tick: u64, (Previous(coil),): Self::Inputs) -> Self::Outputs {
        let shape_a_per_m = (6400.0 + 200.0 * tick as f64 * self.tick_s).min(7200.0);
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
        let measurement = Measurement {
            displacement_m: truth.displacement_m + 10e-9 * self.of_displacement.normal(),
            coil_field_a_per_m: truth.coil_field_a_per_m + self.of_field.normal(),
            ..Measurement::default()
        };
        (measurement, truth)
    }
}

/// What the cut came to after settling.
#[derive(Debug)]
struct Cut {
    rms_m: f64,
    max_m: f64,
    shape_rms_a_per_m: f64,
}

fn cut(hidden: Hidden, settings: &[&str]) -> Cut {
    let rod = Rod::PRINTED;
    let believed = format!(
        "rod.two_pole=(gain: {}, damping_per_s: {:?}, stiffness_per_s2: {:?})",
        rod.gain, rod.damping_per_s, rod.stiffness_per_s2
    );
    let settings: Vec<_> = [believed.as_str(), "placement=Embedded"]
        .iter()
        .chain(settings)
        .map(|setting| setting.parse().unwrap())
        .collect();
    let scenario = load(&repository().join("scenarios/milling.ron"), &settings).unwrap();
    let (tick_s, ticks) = (scenario.tick_s, scenario.ticks());
    let material = Material {
        shape_a_per_m: 6400.0,
        ..Material::TERFENOL_D
    };
    let witness = Witness {
        plant: Plant::new(material, rod, hidden, tick_s),
        tick_s,
        of_displacement: Noise::new(1),
        of_field: Noise::new(2),
    };
    let mut connections = Connections::new(NodeId::LOOP_ORDER, Vec::new(), None);
    let mut stages: Vec<Box<dyn Stage>> = vec![Box::new(Node::open(witness, &mut connections, ticks).unwrap())];
    for node in [NodeId::Estimator, NodeId::Controller, NodeId::Inverse, NodeId::Guard] {
        stages.push(assemble::stage(node, &scenario, &mut connections).unwrap());
    }
    let amplifier = Node::open(IdealAmplifier::default(), &mut connections, ticks).unwrap();
    stages.push(Box::new(amplifier));
    let (mut square, mut max_m, mut of_shape, mut judged) = (0.0, 0.0_f64, 0.0, 0);
    for tick in 0..ticks {
        stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
        let truth: Truth = connections.last().unwrap();
        let (demand, estimate): (Demand, Estimate) = (connections.last().unwrap(), connections.last().unwrap());
        let safe: SafeField = connections.last().unwrap();
        assert_eq!(safe.event, 0, "the guard acts in tick {tick}");
        if tick as f64 * tick_s < SETTLING_S {
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
        rms_m: rms(square),
        max_m,
        shape_rms_a_per_m: rms(of_shape),
    }
}

#[test]
fn a_plant_of_somebody_elses_making_is_cut_as_well() {
    let cut = cut(Hidden::default(), &[]);
    println!("{cut:?}");
    assert!(cut.rms_m <= RMS_M && cut.max_m <= MAX_M, "{cut:?}");
    assert!(cut.shape_rms_a_per_m < 5.0, "{cut:?}");
}

/// The other half of the proof: the same cut with an estimate that stays where it is, and on a plant with a lag that nobody knows.
#[test]
fn the_bound_is_one_that_can_be_missed() {
    let lag = Hidden {
        eddy_current_s: 2e-5,
        ..Hidden::default()
    };
    let fixed = "estimator.law=FixedShape(shape_a_per_m: 6800.0)";
    for (hidden, settings) in [(Hidden::default(), &[fixed][..]), (lag, &[])] {
        let cut = cut(hidden, &[&["duration_s=1.0"], settings].concat());
        println!("{hidden:?} {settings:?}: {cut:?}");
        assert!(
            cut.rms_m > RMS_M && cut.max_m > MAX_M,
            "{hidden:?} {settings:?}: {cut:?}"
        );
    }
}
