//! Guards the estimate against a sensor's spike in the very tick in which the guard notices it, and the loop against an
//! estimator that believes its prediction more than the world.

use anhyst_ipc::{Connections, Estimate, NodeId, SafeField, Stage, Truth};
use anhyst_launch::assemble;
use anhyst_scenario::{Scenario, load, wires};
use std::path::Path;

/// The profile's displacement is near its peak, and the estimate is at work.
const FROM_TICK: u64 = 2700;
const GUARD: &str = "guard=(field_limit_a_per_m: 30e3, jump_limit_m: 3e-6, \
    reactions: {displacement_jump: (reaction: Hold, way_back: AfterHealth(for_s: 0.002))})";

fn scenario(more: &[String]) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/milling.ron");
    let base = [GUARD, "duration_s=0.4", "expect.settling_s=0.1"].map(str::to_owned);
    let settings: Vec<_> = base.iter().chain(more).map(|text| text.parse().unwrap()).collect();
    load(&path, &settings).unwrap()
}

/// Estimate, truth and safe field of every tick.
fn run(more: &[String]) -> Vec<(Estimate, Truth, SafeField)> {
    let scenario = scenario(more);
    let mut connections = Connections::new(NodeId::LOOP_ORDER, wires(), None);
    connections.accept_any_tick(assemble::late_channels(&scenario).unwrap());
    let mut stages: Vec<Box<dyn Stage>> = NodeId::SENDERS
        .into_iter()
        .map(|node| assemble::stage(node, &scenario, &mut connections).unwrap())
        .collect();
    (0..scenario.ticks())
        .map(|tick| {
            stages.iter_mut().for_each(|stage| stage.tick(tick).unwrap());
            let heard = &mut connections;
            (heard.last().unwrap(), heard.last().unwrap(), heard.last().unwrap())
        })
        .collect()
}

fn fault(kind: &str, ticks: u64) -> String {
    format!(
        "faults=[Link(from_tick: {FROM_TICK}, for_ticks: {ticks}, channel: measurement, field: \"displacement_m\", kind: {kind})]"
    )
}

/// Ticks in which a measurement was left out.
fn left_out(tokens: &[(Estimate, Truth, SafeField)]) -> Vec<u64> {
    let outliers = tokens
        .iter()
        .filter(|(estimate, ..)| estimate.status & Estimate::OUTLIER != 0);
    outliers.map(|(estimate, ..)| estimate.tick).collect()
}

/// The largest error of the estimate since the fault, A/m.
fn worst_a_per_m(tokens: &[(Estimate, Truth, SafeField)]) -> f64 {
    let since = &tokens[FROM_TICK as usize..];
    let errors = since
        .iter()
        .map(|(estimate, truth, _)| (estimate.shape_a_per_m - truth.shape_a_per_m).abs());
    errors.fold(0.0, f64::max)
}

/// 1 mm for one tick: the guard holds, the estimate stays to the bit. Without the test it goes to the edge of its range.
#[test]
fn a_spike_does_not_move_the_estimate() {
    for law in ["Folded()", "GaussNewton()", "Matrix()", "Scalar()", "Gradient()"] {
        let law = format!("estimator.law={law}");
        let tokens = run(&[law.clone(), fault("Offset(1e-3)", 1)]);
        assert_eq!(left_out(&tokens), [FROM_TICK], "{law}");
        let [before, now] = [1, 0].map(|age| tokens[FROM_TICK as usize - age].0.shape_a_per_m);
        assert_eq!(now.to_bits(), before.to_bits(), "{law}");
        assert_ne!(tokens[FROM_TICK as usize].2.status & SafeField::HOLDING, 0, "{law}");
    }
    let spiked = run(&[fault("Offset(1e-3)", 1)]);
    assert!(worst_a_per_m(&spiked) < 10.0, "{} A/m", worst_a_per_m(&spiked));
    let believed = run(&[fault("Offset(1e-3)", 1), "estimator.outlier.at_most_s=0".into()]);
    assert!(worst_a_per_m(&believed) > 500.0, "{} A/m", worst_a_per_m(&believed));
}

/// A bound that a scenario states, for a sensor that fails by less than the rod's stroke.
#[test]
fn a_stated_bound_leaves_out_less() {
    let spike = fault("Offset(2e-5)", 3);
    assert_eq!(left_out(&run(std::slice::from_ref(&spike))), Vec::<u64>::new());
    let stated = run(&[spike, "estimator.outlier.innovation_limit_m=3e-6".into()]);
    assert_eq!(left_out(&stated), [FROM_TICK, FROM_TICK + 1, FROM_TICK + 2]);
    assert!(worst_a_per_m(&stated) < 10.0, "{} A/m", worst_a_per_m(&stated));
}

/// A sensor that was moved is no outlier for ever: after the stated 0.01 s its values are taken.
#[test]
fn what_stays_is_believed() {
    let tokens = run(&[fault("Offset(1e-3)", 4000)]);
    let expected: Vec<u64> = (FROM_TICK..FROM_TICK + 200).collect();
    assert_eq!(left_out(&tokens), expected);
}

/// The test costs a healthy run nothing: no measurement is left out, and every estimate has the same bits.
#[test]
fn a_healthy_run_has_the_same_bits() {
    let (with, without) = (run(&[]), run(&["estimator.outlier.at_most_s=0".into()]));
    assert_eq!(left_out(&with), Vec::<u64>::new());
    assert!(with.iter().zip(&without).all(|(with, without)| with.0 == without.0));
}
