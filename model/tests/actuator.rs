//! Guards the chain: a step and a run are the same, samples are enough, and every input and output is what it says.

mod drive;

use anhyst_model::{
    Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs, AmplifierConstants, Drive, Effect,
    EffectKind, Hysteresis, Law, LawModel, MagneticHalf, MagneticState, Magnetostriction, Material, MaterialLaw,
    PlayGroup, PlaySum, Warp, simulate,
};

const TICK_S: f64 = 1e-4;

fn run(model: &ActuatorModel, inputs: ActuatorInputs) -> ActuatorOutputs {
    let mut outputs = ActuatorOutputs::default();
    simulate(model, TICK_S, inputs, &mut outputs).expect("a valid model");
    outputs
}

fn effect(kind: EffectKind, values: &[f64]) -> Effect {
    Effect::new(kind, values).expect("within its bounds")
}

fn rms_between(one: &[f64], other: &[f64]) -> f64 {
    let square: f64 = one
        .iter()
        .zip(other)
        .map(|(one, other)| (one - other) * (one - other))
        .sum();
    (square / one.len() as f64).sqrt()
}

/// One effect of every stage.
fn busy() -> ActuatorModel {
    let mut model = ActuatorModel::terfenol_d();
    model.effects = vec![
        effect(EffectKind::LoopDelay, &[1.37e-4]),
        effect(EffectKind::EddyCurrent, &[1.8e-4]),
        effect(EffectKind::ThermalDrift, &[5.0, 20.0, 1.0]),
        effect(EffectKind::AfterEffect, &[0.03, 0.03, 3.0]),
        effect(EffectKind::ThermalExpansion, &[1.0, 20.0, 12e-6]),
        effect(EffectKind::Friction, &[1.5e-6, 1e-3, 1e-9]),
        effect(EffectKind::SecondMode, &[0.03, 410.0, 0.03]),
        effect(EffectKind::SensorDelay, &[3.3e-4, 0.0]),
    ];
    model
}

/// A plant steps, a fitter runs: the same bits, also when the run is cut into pieces, and through a snapshot.
#[test]
fn steps_runs_and_pieces_agree_bit_for_bit() {
    let commands = drive::loops(1200);
    let mut everything = ActuatorModel::terfenol_d();
    everything.effects = EffectKind::ALL.map(Effect::typical).to_vec();
    for model in [ActuatorModel::terfenol_d(), busy(), everything] {
        let whole = run(&model, ActuatorInputs::commands(&commands));
        let mut stepped = Actuator::new(&model, TICK_S).unwrap();
        let mut cut = Actuator::new(&model, TICK_S).unwrap();
        let mut outputs = ActuatorOutputs::default();
        let mut from = 0;
        for length in [1, 2, 255, 300, 642] {
            let part = &commands[from..from + length];
            cut.run(ActuatorInputs::commands(part), &mut outputs).unwrap();
            cut = serde_json::from_str(&serde_json::to_string(&cut).unwrap()).unwrap();
            assert_eq!(outputs.displacement_m, whole.displacement_m[from..from + length]);
            for (offset, &command) in part.iter().enumerate() {
                let output = stepped.step(ActuatorInput::command(command));
                let index = from + offset;
                assert_eq!(output.field_a_per_m, whole.field_a_per_m[index]);
                assert_eq!(output.magnetization_a_per_m, whole.magnetization_a_per_m[index]);
                assert_eq!(output.strain, whole.strain[index]);
                assert_eq!(output.displacement_m, whole.displacement_m[index]);
                assert_eq!(output.temperature_k, whole.temperature_k[index]);
            }
            from += length;
        }
        assert_eq!(from, commands.len());
    }
}

/// What was magnetised serves every model with the same magnetic half: the same bits as a whole run, at once or after a first sample.
#[test]
fn two_halves_are_a_run_bit_for_bit() {
    let commands = drive::loops(1200);
    let inputs = ActuatorInputs::commands(&commands);
    let mut everything = ActuatorModel::terfenol_d();
    everything.effects = EffectKind::ALL.map(Effect::typical).to_vec();
    let magnetic = [busy(), everything.clone()].map(|model| model.magnetic_half());
    assert_ne!(magnetic[0], magnetic[1]);
    for (model, magnetic) in [busy(), everything].iter().zip(&magnetic) {
        for before in [None, Some(0.0)] {
            let begun = |model: &ActuatorModel| {
                let mut actuator = Actuator::new(model, TICK_S).unwrap();
                before.map(|command| actuator.step(ActuatorInput::command(command)));
                actuator
            };
            let (mut whole, mut outputs) = (ActuatorOutputs::default(), ActuatorOutputs::default());
            begun(model).run(inputs, &mut whole).unwrap();
            let half = begun(magnetic).magnetize(inputs).unwrap();
            begun(model).run_from(&half, inputs, &mut outputs).unwrap();
            assert!(whole == outputs);
        }
    }
}

/// A drift of `a` is what setting it from stretch to stretch is; none is a run as ever.
#[test]
fn a_drift_of_the_shape_is_one() {
    let commands = drive::loops(1024);
    let inputs = ActuatorInputs::commands(&commands);
    let model = ActuatorModel::terfenol_d();
    let own_a_per_m = model.material.hysteresis.shape_a_per_m;
    let actuator = || Actuator::new(&model, TICK_S).unwrap();
    let displaced = |half: &MagneticHalf| {
        let mut outputs = ActuatorOutputs::default();
        actuator().run_from(half, inputs, &mut outputs).unwrap();
        outputs.displacement_m
    };
    let drifting = displaced(&actuator().magnetize_drifting(inputs, [-100.0, 300.0]).unwrap());
    let mut stepped = actuator();
    for (row, command) in commands.iter().enumerate() {
        // In the middle of each quarter.
        stepped.set_shape_a_per_m(own_a_per_m + [-50.0, 50.0, 150.0, 250.0][row / 256]);
        let output = stepped.step(ActuatorInput::command(*command));
        assert_eq!(output.displacement_m, drifting[row], "row {row}");
    }
    assert_eq!(
        displaced(&actuator().magnetize_drifting(inputs, [0.0; 2]).unwrap()),
        displaced(&actuator().magnetize(inputs).unwrap())
    );
}

/// By how much (m, rms) commands cut sixteen times finer, which are the same field, move the tip.
fn moved_by_finer_samples(effects: &[Effect], commands: &[f64]) -> f64 {
    let parts = 16;
    let mut model = ActuatorModel::terfenol_d();
    model.effects = effects.to_vec();
    let coarse = run(&model, ActuatorInputs::commands(commands));
    let finer = drive::finer(commands, parts);
    let mut fine = ActuatorOutputs::default();
    let tick_s = TICK_S / parts as f64;
    simulate(&model, tick_s, ActuatorInputs::commands(&finer), &mut fine).unwrap();
    let fine: Vec<f64> = fine.displacement_m.iter().step_by(parts).copied().collect();
    rms_between(&coarse.displacement_m, &fine)
}

/// Guards what happens between samples: finer samples of the same field move the tip by less than a fraction of a
/// sensor's noise. It caught a rod that took M as a straight line (10 nm), turning points of a lag that fell between
/// samples (20 nm), a friction that rang, and one whose search for the force ended anywhere (166 nm).
#[test]
fn samples_are_enough() {
    let commands = drive::loops(6000);
    let cases: [(&[Effect], f64); 15] = [
        (&[], 0.1e-9),
        (&[effect(EffectKind::EddyCurrent, &[1.8e-4])], 0.1e-9),
        (&[effect(EffectKind::LoopDelay, &[1.37e-4])], 0.5e-9),
        (&[effect(EffectKind::AmplifierBandwidth, &[8e-5])], 0.2e-9),
        (&[effect(EffectKind::AmplifierSaturation, &[8e3, 1e3])], 0.5e-9),
        (
            &[
                effect(EffectKind::LoopDelay, &[1.37e-4]),
                effect(EffectKind::AmplifierBandwidth, &[8e-5]),
                effect(EffectKind::EddyCurrent, &[1.8e-4]),
            ],
            0.2e-9,
        ),
        (&[effect(EffectKind::ExcessLoss, &[0.1, 0.5])], 0.2e-9),
        (&[effect(EffectKind::Prestress, &[1e-13])], 0.1e-9),
        (&[effect(EffectKind::Accommodation, &[0.1])], 1e-9),
        (&[effect(EffectKind::ThermalDrift, &[10.0, 20.0, 1.0])], 0.1e-9),
        (&[effect(EffectKind::QuadraticMagnetostriction, &[1.0])], 0.5e-9),
        (&[effect(EffectKind::DeltaE, &[0.5])], 0.3e-9),
        (&[effect(EffectKind::Stiffening, &[1e8])], 1e-9),
        (&[effect(EffectKind::Friction, &[1.5e-6, 1e-3, 1e-9])], 1.5e-9),
        // Dry as this, the tip stops within a substep.
        (&[effect(EffectKind::Friction, &[1e-5, 1e-4, 1e-9])], 15e-9),
    ];
    for (effects, most_m) in cases {
        let rms = moved_by_finer_samples(effects, &commands);
        println!("{effects:?}: {rms:e} m");
        assert!(rms < most_m, "{effects:?}: {rms:e} m");
    }
}

/// Guards the same where the field jumps within a tick, for what once needed a smooth drive: friction is as good there,
/// and walls that relax along the way of a jump, not after it (255 nm). Second order in parts of 0.05 k, for ρ = 0.1, that leaves 1 nm.
#[test]
fn samples_are_enough_for_jumps() {
    let commands = drive::jumping(6000);
    for (effects, most_m) in [
        (effect(EffectKind::Friction, &[1e-5, 1e-4, 1e-9]), 15e-9),
        (effect(EffectKind::Accommodation, &[0.1]), 1e-9),
    ] {
        let rms = moved_by_finer_samples(&[effects], &commands);
        println!("{effects:?}: {rms:e} m");
        assert!(rms < most_m, "{effects:?}: {rms:e} m");
    }
}

/// Guards the sweep without time: the hysteresis model itself, the strain law, the static gain.
#[test]
fn a_sweep_without_time_is_the_material_itself() {
    let mut model = ActuatorModel::terfenol_d();
    model.amplifier.bandwidth_hz = Some(10.0);
    model.amplifier.field_limit_a_per_m = Some(9e3);
    model.effects = vec![effect(EffectKind::Backlash, &[0.0, 0.0])];
    let mut actuator = Actuator::quasi_static(&model).unwrap();
    let hysteresis = model.material.hysteresis;
    let saturation = hysteresis.saturation_magnetization_a_per_m;
    let mut state = MagneticState::default();
    for command in drive::loops(500) {
        let output = actuator.step(ActuatorInput::command(command));
        assert_eq!(output.field_a_per_m, command.clamp(-9e3, 9e3));
        state = hysteresis.advance(state, output.field_a_per_m);
        let m = output.magnetization_a_per_m;
        assert!((m - state.magnetization_a_per_m).abs() < 1e-7 * saturation);
        assert!((output.strain - model.material.magnetostriction.strain(m, saturation)).abs() < 1e-18);
        let expected = model.rod.unwrap().dc_gain() * m;
        assert!((output.displacement_m - expected).abs() < 1e-15);
    }
}

/// Guards the model without a rod, for measured strains: the sensor's effects act on the strain.
#[test]
fn without_a_rod_the_strain_is_what_is_measured() {
    let mut model = ActuatorModel::terfenol_d().with_effect(effect(EffectKind::SensorGain, &[0.25]));
    model.rod = None;
    let outputs = run(&model, ActuatorInputs::commands(&drive::loops(300)));
    for (displacement, strain) in outputs.displacement_m.iter().zip(&outputs.strain) {
        assert!((displacement - 1.25 * strain).abs() <= 1e-18);
    }
}

/// Guards runs driven by a measured field: nothing of the amplifier acts, everything behind it does.
#[test]
fn a_coil_field_passes_the_amplifier_by() {
    let fields = drive::loops(800);
    let mut model = busy();
    model.amplifier = AmplifierConstants {
        bandwidth_hz: Some(300.0),
        slew_limit_a_per_m_s: Some(1e6),
        field_limit_a_per_m: Some(5e3),
        delay_ticks: 3,
    };
    let measured = run(&model, ActuatorInputs::coil_fields(&fields));
    assert_eq!(measured.field_a_per_m, fields);
    let mut behind = busy();
    behind.effects.retain(|effect| effect.kind() != EffectKind::LoopDelay);
    let commanded = run(&behind, ActuatorInputs::commands(&fields));
    assert_eq!(measured.displacement_m, commanded.displacement_m);
    assert_ne!(run(&model, ActuatorInputs::commands(&fields)).field_a_per_m, fields);
}

/// Guards the nominal amplifier: its delay is whole ticks, its limits hold, its lag is that of the same effect.
#[test]
fn the_nominal_amplifier_is_in_the_chain() {
    let commands = drive::loops(800);
    let field = |amplifier: AmplifierConstants| {
        let mut model = ActuatorModel::terfenol_d();
        model.amplifier = amplifier;
        run(&model, ActuatorInputs::commands(&commands)).field_a_per_m
    };
    let base = AmplifierConstants::default();
    assert_eq!(field(base), commands);
    let delayed = field(AmplifierConstants { delay_ticks: 5, ..base });
    assert_eq!(delayed[5..], commands[..795]);
    let limited = field(AmplifierConstants {
        slew_limit_a_per_m_s: Some(2e6),
        field_limit_a_per_m: Some(4e3),
        ..base
    });
    let fastest = limited
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f64::max);
    assert!((fastest - 200.0).abs() < 1e-6, "{fastest}");
    assert_eq!(limited.iter().copied().fold(0.0, f64::max), 4e3);
    let lagging = field(AmplifierConstants {
        bandwidth_hz: Some(1e3),
        ..base
    });
    let lag = effect(EffectKind::AmplifierBandwidth, &[1e-3 / (2.0 * std::f64::consts::PI)]);
    let same = run(
        &ActuatorModel::terfenol_d().with_effect(lag),
        ActuatorInputs::commands(&commands),
    );
    for (one, other) in lagging.iter().zip(&same.field_a_per_m) {
        assert!((one - other).abs() < 1e-9);
    }
}

/// Guards the first sample: all but the magnetic history is settled there, from a given state or demagnetised.
#[test]
fn a_run_may_begin_anywhere() {
    let model = busy();
    let hysteresis = Hysteresis::terfenol_d();
    let state = hysteresis.advance(hysteresis.advance(MagneticState::default(), 2e4), 3e3);
    let mut actuator = Actuator::new(&model, TICK_S).unwrap().starting_at(state);
    let first = actuator.step(ActuatorInput::command(3e3));
    let creeping = 1.03 * state.magnetization_a_per_m;
    assert!((first.magnetization_a_per_m - creeping).abs() < 1e-9 * creeping);
    for _ in 0..200 {
        let output = actuator.step(ActuatorInput::command(3e3));
        // Only heat is still moving.
        assert!((output.displacement_m - first.displacement_m).abs() < 1e-3 * first.displacement_m);
    }
    assert_eq!(actuator.magnetic_state(), state);
    let empty = run(&model, ActuatorInputs::commands(&[]));
    assert!(empty.displacement_m.is_empty());
}

/// Guards the process that runs a plant: a command that is not a number makes outputs that are none either, and no panic.
#[test]
fn no_number_in_gives_no_number_out() {
    for kind in EffectKind::ALL {
        let mut actuator =
            Actuator::new(&ActuatorModel::terfenol_d().with_effect(Effect::typical(kind)), TICK_S).unwrap();
        let mut last = 0.0;
        for command in [0.0, 500.0, f64::NAN, 700.0, 200.0, f64::INFINITY, 100.0] {
            for _ in 0..20 {
                last = actuator.step(ActuatorInput::command(command)).displacement_m;
            }
        }
        assert!(last.is_nan(), "{}: {last}", kind.name());
    }
}

/// Guards measured temperatures: they replace what the effects reckon.
#[test]
fn a_measured_temperature_is_believed() {
    let commands = drive::loops(400);
    let mut model = ActuatorModel::terfenol_d();
    model.effects = vec![
        effect(EffectKind::ThermalDrift, &[50.0, 20.0, 1.0]),
        effect(EffectKind::ThermalExpansion, &[50.0, 20.0, 12e-6]),
    ];
    let reckoned = run(&model, ActuatorInputs::commands(&commands));
    assert!(reckoned.temperature_k[399] > 293.1);
    let warm = vec![303.0; 400];
    let inputs = ActuatorInputs {
        temperature_k: Some(&warm),
        ..ActuatorInputs::commands(&commands)
    };
    let measured = run(&model, inputs);
    assert_eq!(measured.temperature_k, warm);
    let mut by_hand = ActuatorModel::terfenol_d();
    by_hand.material.hysteresis.shape_a_per_m *= 303.0 / 293.0;
    let expected = run(&by_hand, ActuatorInputs::commands(&commands));
    let longer = 12e-5 * model.rod.unwrap().dc_gain() / model.material.strain_per_magnetization();
    for (own, expected) in measured.displacement_m.iter().zip(&expected.displacement_m) {
        assert!((own - expected - longer).abs() < 1e-9 * longer);
    }
    let short = ActuatorInputs {
        temperature_k: Some(&warm[1..]),
        ..ActuatorInputs::commands(&commands)
    };
    let refusal = Actuator::new(&model, TICK_S)
        .unwrap()
        .run(short, &mut ActuatorOutputs::default());
    assert_eq!(
        refusal.unwrap_err().to_string(),
        "399 samples of the temperature were given for 400 samples of the drive; they must be as many"
    );
}

/// Guards what a warming does to M while the field stands: M = c Man + (1 − c) Mirr with the walls where they were (paper eq. (5)).
#[test]
fn the_reversible_part_may_follow_the_shape() {
    let model = ActuatorModel::terfenol_d().with_effect(effect(EffectKind::ThermalDrift, &[0.0, 20.0, 1.0, 0.0, 1.0]));
    let hysteresis = model.material.hysteresis;
    let mut actuator = Actuator::new(&model, TICK_S).unwrap();
    let step = |actuator: &mut Actuator, drive_a_per_m: f64, rise_k: f64| {
        actuator.step(ActuatorInput {
            temperature_k: Some(model.ambient_temperature_k + rise_k),
            ..ActuatorInput::command(drive_a_per_m)
        });
        actuator.magnetic_state()
    };
    let mut before = MagneticState::default();
    for command in drive::loops(410).into_iter().chain([4e3]) {
        before = step(&mut actuator, command, 0.0);
    }
    let mut after = before;
    for tick in 1..=1000 {
        after = step(&mut actuator, 4e3, 0.02 * f64::from(tick));
    }
    let warm = Hysteresis {
        shape_a_per_m: hysteresis.shape_a_per_m * (1.0 + 20.0 / model.ambient_temperature_k),
        ..hysteresis
    };
    let saturation = hysteresis.saturation_magnetization_a_per_m;
    let moved = after.magnetization_a_per_m - before.magnetization_a_per_m;
    assert!(moved.abs() > 1e-3 * saturation, "{moved}");
    let walls = warm.irreversible(after) - hysteresis.irreversible(before);
    assert!(walls.abs() < 1e-8 * saturation, "{walls}");
}

/// Guards the force at the tip: statically it is f/ĉ.
#[test]
fn a_force_moves_the_tip() {
    let mut model = ActuatorModel::terfenol_d();
    if let Some(rod) = &mut model.rod {
        rod.force_gain_per_kg = 2.0;
    }
    let mut actuator = Actuator::new(&model, TICK_S).unwrap();
    let mut input = ActuatorInput::coil_field(0.0);
    assert_eq!(input.drive, Drive::CoilField);
    actuator.step(input);
    input.force_n = 100.0;
    for _ in 0..300 {
        actuator.step(input);
    }
    assert!((actuator.tip().displacement_m / (200.0 / 6.4251e7) - 1.0).abs() < 1e-9);
    assert!(actuator.tip().velocity_m_per_s.abs() < 1e-12);
}

/// Guards the strain laws of measured materials: the rod's gain belongs to the slope at Ms/2 where the law is even.
#[test]
fn an_even_strain_law_drives_the_rod() {
    let commands = drive::loops(400);
    let mut model = ActuatorModel::terfenol_d();
    model.material.magnetostriction = Magnetostriction::Quadratic {
        saturation_magnetostriction: 1.005e-3,
    };
    let mut actuator = Actuator::quasi_static(&model).unwrap();
    let saturation = model.material.hysteresis.saturation_magnetization_a_per_m;
    for command in commands {
        let output = actuator.step(ActuatorInput::command(command));
        let m = output.magnetization_a_per_m;
        let expected = model.rod.unwrap().dc_gain() * m * m / saturation;
        assert!((output.displacement_m - expected).abs() < 1e-15);
    }
}

/// Guards a run's unknown past under another law: what an extreme left at the first sample is found again from its magnetization
/// alone, and what no past can have left becomes what is nearest to it.
#[test]
fn a_law_starts_where_an_extreme_left_it() {
    let plays = PlaySum {
        groups: vec![PlayGroup {
            warp: Warp::Straight,
            radii: vec![0.0, 5.0, 15.0, 40.0],
            weights: vec![2e-7, 1e-7, 5e-8, 5e-8],
        }],
    };
    let law = MaterialLaw {
        input_unit: "V".into(),
        output_unit: "m".into(),
        input_extent: [-100.0, 100.0],
        model: LawModel {
            laws: vec![Law::Plays(plays)],
            ..LawModel::default()
        },
    };
    let model = ActuatorModel {
        material: Material::of_law("plays", "made up", law).unwrap(),
        rod: None,
        ..ActuatorModel::terfenol_d()
    };
    let end = |actuator: &mut Actuator, inputs: &[f64]| {
        for input in inputs {
            actuator.step(ActuatorInput::command(*input));
        }
        actuator.magnetic_state()
    };
    for (extreme, first) in [(70.0, 0.0), (-25.0, 10.0), (90.0, 60.0)] {
        let mut lived = Actuator::quasi_static(&model).unwrap();
        let left = end(&mut lived, &[extreme, first]);
        let mut told = Actuator::quasi_static(&model).unwrap().starting_at(left);
        assert!(
            rms_between(
                &[told.magnetic_state().magnetization_a_per_m],
                &[left.magnetization_a_per_m]
            ) < 1e-15
        );
        for after in [[20.0, -5.0, 30.0], [-30.0, 35.0, 0.0]] {
            let (one, other) = (end(&mut lived, &after), end(&mut told, &after));
            assert!(
                (one.magnetization_a_per_m - other.magnetization_a_per_m).abs() < 1e-15,
                "{extreme} {after:?}"
            );
        }
    }
    let impossible = MagneticState {
        field_a_per_m: 0.0,
        magnetization_a_per_m: 1.0,
    };
    let told = Actuator::quasi_static(&model).unwrap().starting_at(impossible);
    let most = end(&mut Actuator::quasi_static(&model).unwrap(), &[100.0, 0.0]);
    assert!((told.magnetic_state().magnetization_a_per_m - most.magnetization_a_per_m).abs() < 1e-15);
}
