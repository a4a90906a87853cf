//! Guards where a run finds its material: from the prepared start a model that is true must give back what was measured.

use anhyst_identify::prepared::{PrepareOptions, PreparedRun, Start, simulated};
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, ActuatorOutputs, Drive, MagneticState};

fn material() -> ActuatorModel {
    ActuatorModel {
        rod: None,
        ..ActuatorModel::terfenol_d()
    }
}

/// From one field to the next, two hundred samples each.
fn sweep(turns: &[f64]) -> Vec<f64> {
    let leg = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        (0..200)
            .map(move |k| from + (to - from) * f64::from(k) / 200.0)
            .collect::<Vec<f64>>()
    };
    let last = turns.last().copied();
    turns.windows(2).flat_map(leg).chain(last).collect()
}

/// What a true material does on `turns` after it went along `before`, seen by an instrument with a zero.
fn measured(before: &[f64], turns: &[f64], zero: f64, with_magnetization: bool) -> MeasuredRun {
    let mut model = material();
    // Strain that knows the sign of nothing tells a wrong start from a zero.
    model.material.magnetostriction = anhyst_model::Magnetostriction::Quadratic {
        saturation_magnetostriction: 1e-3,
    };
    let follow = |state: MagneticState, field: &f64| model.material.hysteresis.advance(state, *field);
    let field = sweep(turns);
    let mut state = sweep(before).iter().fold(MagneticState::default(), follow);
    let magnetization: Vec<f64> = field
        .iter()
        .map(|value| {
            state = follow(state, value);
            state.magnetization_a_per_m
        })
        .collect();
    let strain = magnetization
        .iter()
        .map(|m| model.material.magnetostriction.strain(*m, 7.65e5));
    let mut series = vec![(Quantity::Strain, strain.collect()), (Quantity::Field, field)];
    if with_magnetization {
        series.push((
            Quantity::Magnetization,
            magnetization.iter().map(|m| m + zero).collect(),
        ));
    }
    MeasuredRun::in_memory("made", None, series).unwrap()
}

/// Largest distance of the true model from what was measured, its zero taken off, as a share of the range.
fn off(run: &MeasuredRun, quantity: Quantity) -> f64 {
    let mut model = material();
    model.material.magnetostriction = anhyst_model::Magnetostriction::Quadratic {
        saturation_magnetostriction: 1e-3,
    };
    let prepared = PreparedRun::of(run, &PrepareOptions::default()).unwrap();
    let mut outputs = ActuatorOutputs::default();
    prepared.simulate(&model, &mut outputs).unwrap();
    let channel = prepared.channel(quantity).unwrap();
    assert!(channel.free_zero);
    let own = simulated(&model, &outputs, quantity).unwrap();
    let left: Vec<f64> = channel.measured.iter().zip(own).map(|(y, m)| y - m).collect();
    let zero = left.iter().sum::<f64>() / left.len() as f64;
    let (low, high) = anhyst_measured::sweep::extremes(&channel.measured);
    left.iter().fold(0.0_f64, |most, own| most.max((own - zero).abs())) / (high - low)
}

/// Review of the three former rules: M[0] less the middle of M was far off in the first quadrant, and so was the way from the far end of a
/// field that never went there.
#[test]
fn sweeps_begin_where_they_began() {
    let far = 30e3;
    let cases: [(&str, &[f64], &[f64], f64); 6] = [
        ("major loop, fluxmeter's zero", &[0.0, far], &[far, -far, far], 2e5),
        (
            "major loop from zero field, open, zero",
            &[0.0, far, -far, 0.0],
            &[0.0, far, -far, 0.0],
            -5e4,
        ),
        ("virgin curve in the first quadrant", &[0.0, 0.0], &[0.0, far], 0.0),
        (
            "from remanence, first quadrant, open",
            &[0.0, far, 0.0],
            &[0.0, far, 5e3],
            0.0,
        ),
        (
            "minor loop under bias on the way down, closed",
            &[0.0, far, 10e3, 5e3, 10e3],
            &[10e3, 5e3, 10e3],
            0.0,
        ),
        ("unipolar and closed", &[0.0, far, 0.0], &[0.0, far, 0.0], 0.0),
    ];
    for (name, before, turns, zero) in cases {
        let run = measured(before, turns, zero, true);
        for quantity in [Quantity::Magnetization, Quantity::Strain] {
            let off = off(&run, quantity);
            assert!(off < 0.01, "{name}: {} is off by {off} of its range", quantity.name());
        }
    }
    // Nothing but strain: closed, or from the far end of its own field.
    for (before, turns) in [
        ([0.0, far], vec![far, -far, far]),
        ([0.0, -far], vec![-far, far]),
        ([0.0, 0.0], vec![0.0, far]),
    ] {
        let run = measured(&before, &turns, 0.0, false);
        assert!(off(&run, Quantity::Strain) < 0.01, "{turns:?}");
    }
}

#[test]
fn runs_over_time_begin_at_rest_and_are_driven_by_what_was_computed() {
    let field: Vec<f64> = (0..400).map(|k| 1e4 * (f64::from(k) * 0.05).cos()).collect();
    let tip: Vec<f64> = field.iter().map(|value| 1e-9 * value).collect();
    let run = |series: &[(Quantity, &Vec<f64>)]| {
        let own = series
            .iter()
            .map(|(quantity, values)| (*quantity, (*values).clone()))
            .collect();
        MeasuredRun::in_memory("made", Some(1e-4), own).unwrap()
    };
    let all = run(&[
        (Quantity::FieldCommand, &field),
        (Quantity::Field, &field),
        (Quantity::Displacement, &tip),
    ]);
    let prepared = PreparedRun::of(&all, &PrepareOptions::default()).unwrap();
    assert_eq!((prepared.drive, prepared.start), (Drive::Command, Start::Undriven));
    let quantities: Vec<Quantity> = prepared.channels.iter().map(|own| own.quantity).collect();
    assert_eq!(quantities, [Quantity::Field, Quantity::Displacement]);
    assert!(prepared.channels.iter().all(|own| !own.free_zero));
    let calibrated = PrepareOptions {
        settle_s: 0.01,
        free_zero: true,
        ..PrepareOptions::default()
    };
    let probed = run(&[(Quantity::Field, &field), (Quantity::Displacement, &tip)]);
    let prepared = PreparedRun::of(&probed, &calibrated).unwrap();
    assert_eq!(
        (prepared.drive, prepared.settling_rows, prepared.channels.len()),
        (Drive::CoilField, 100, 1)
    );
    assert!(prepared.channels[0].free_zero);
    let nothing = PrepareOptions {
        settle_s: 1.0,
        ..calibrated
    };
    let refused = PreparedRun::of(&probed, &nothing).unwrap_err().to_string();
    assert!(refused.contains("leaves nothing of 0.040 s"), "{refused}");
}
