//! Guards the study of other laws by a second opinion: the rig that the witness makes of a model's law computes what the model does,
//! with the same numbers and without its code; and what is hidden in it is named.

use anhyst_model::{
    ActuatorInputs, ActuatorModel, ActuatorOutputs, BoucWen, Density, Effect, EffectKind, Hysteresis, Law, LawModel,
    Material, MaterialLaw, PlayGroup, PlaySum, ScaledDomainWall, SlowLag, TwoPole, Warp, simulate,
};
use anhyst_studies::blind::{Family, Outcome, Plan, StudyRun, Subject, study};
use anhyst_witness as witness;
use anhyst_witness::{Drive, Made, NotMade, Nuisance, Wanted};

const TICK_S: f64 = 1e-4;
/// Ticks of the model in one of the record, where an effect's own steps should not count.
const FINER: usize = 8;

/// 40 to 80 um over `extent` before a resonance at 500 Hz.
fn stage(extent: [f64; 2], laws: Vec<Law>) -> ActuatorModel {
    let law = MaterialLaw {
        input_unit: "V".into(),
        output_unit: "m".into(),
        input_extent: extent,
        model: LawModel {
            offset: 0.0,
            slope: 1e-7,
            laws,
            creep: vec![SlowLag {
                time_constant_s: 0.5,
                weight: 2e-8,
            }],
        },
    };
    let omega = std::f64::consts::TAU * 500.0;
    ActuatorModel {
        material: Material::of_law("a law", "made up", law).unwrap(),
        rod: Some(TwoPole {
            gain: omega * omega,
            damping_per_s: 2.0 * 0.1 * omega,
            stiffness_per_s2: omega * omega,
            force_gain_per_kg: 0.0,
        }),
        ..ActuatorModel::terfenol_d()
    }
}

fn group(warp: Warp, radii: &[f64], weights: &[f64]) -> PlayGroup {
    PlayGroup {
        warp,
        radii: radii.to_vec(),
        weights: weights.to_vec(),
    }
}

fn subjects() -> Vec<ActuatorModel> {
    let bent = Warp::Quadratic {
        bend: 0.1,
        middle: 50.0,
        half_span: 50.0,
    };
    let groups = vec![
        group(bent, &[0.0, 5.0, 15.0], &[2e-7, 5e-8, 5e-8]),
        group(Warp::Tanh { scale: 60.0 }, &[2.0], &[1e-7]),
    ];
    let plays = Law::Plays(PlaySum { groups });
    let density = Density::Lorentz {
        amplitude: 8e-5,
        coercivity: 0.0,
        width: 60.0,
        reach: 130.0,
        rows: 40,
    };
    let yielding = BoucWen {
        amplitude: 1e-5,
        yield_input: 30.0,
        exponent: 1.5,
        loading_share: 0.6,
        stiffens: false,
    };
    let stiffening = BoucWen {
        exponent: 1.0,
        loading_share: -0.2,
        stiffens: true,
        ..yielding
    };
    let walls = ScaledDomainWall {
        gain: 5e-11,
        hysteresis: Hysteresis {
            shape_a_per_m: 30.0,
            pinning_a_per_m: 20.0,
            coupling: 0.0,
            ..Hysteresis::terfenol_d()
        },
    };
    let preisach = Law::Preisach(density.into());
    let bare = ActuatorModel {
        rod: None,
        ..stage([-100.0, 100.0], vec![preisach.clone()])
    };
    let both = [-100.0, 100.0];
    vec![
        stage([0.0, 100.0], vec![plays]),
        stage(both, vec![preisach]),
        stage(both, vec![Law::BoucWen(yielding)]),
        stage(both, vec![Law::BoucWen(stiffening)]),
        stage(both, vec![Law::DomainWall(walls)]),
        bare,
    ]
}

/// An electromagnet: a third of a tesla by 80 A/m, eddy currents in the rod's place.
fn magnet() -> ActuatorModel {
    let groups = vec![
        group(
            Warp::Tanh { scale: 15.0 },
            &[0.0, 2.1, 3.8, 5.9, 8.6, 11.6],
            &[7.7e-3, 4.8e-4, 1.6e-3, 1.9e-3, 5.2e-3, 3.6e-3],
        ),
        group(Warp::Tanh { scale: 32.0 }, &[0.0, 18.0, 24.0], &[3.4e-3, 2.0e-3, 9e-4]),
    ];
    let law = MaterialLaw {
        input_unit: "A/m".into(),
        output_unit: "T".into(),
        input_extent: [-80.0, 80.0],
        model: LawModel {
            offset: 0.0,
            slope: 6e-4,
            laws: vec![Law::Plays(PlaySum { groups })],
            creep: Vec::new(),
        },
    };
    let omega = std::f64::consts::TAU * 2000.0;
    ActuatorModel {
        material: Material::of_law("a magnet", "made up", law).unwrap(),
        rod: Some(TwoPole {
            gain: omega * omega,
            damping_per_s: 2.0 * omega,
            stiffness_per_s2: omega * omega,
            force_gain_per_kg: 0.0,
        }),
        ..ActuatorModel::terfenol_d()
    }
}

fn drawn(subject: &Subject, effects: Vec<witness::Effect>, seed: u64) -> Result<Made, NotMade> {
    let wanted = Wanted {
        effects,
        nuisance: Nuisance::Clean,
        drive: Some(Drive::Broadband),
        gap_over_noise: Some(30.0),
        rows: 4_000,
    };
    subject.rig().draw(seed, &wanted)
}

/// Rms of model minus witness, m, and that of the witness; with so many ticks of the model in one of the record.
fn apart(model: &ActuatorModel, subject: &Subject, made: Made, finer: usize) -> [f64; 2] {
    let answer = made.rig.answer(TICK_S, made.record.command_a_per_m.clone());
    let made = subject.in_its_units(Made { record: answer, ..made });
    let mut outputs = ActuatorOutputs::default();
    // Straight between the samples.
    let command = &made.record.command_a_per_m;
    let between = |at: usize, part: usize| {
        let next = command.get(at + 1).unwrap_or(&command[at]);
        command[at] + (next - command[at]) * part as f64 / finer as f64
    };
    let fine: Vec<f64> = (0..command.len() * finer)
        .map(|row| between(row / finer, row % finer))
        .collect();
    let inputs = ActuatorInputs::commands(&fine);
    simulate(model, TICK_S / finer as f64, inputs, &mut outputs).unwrap();
    outputs.displacement_m = outputs.displacement_m.into_iter().step_by(finer).collect();
    let rms = |values: &mut dyn Iterator<Item = f64>| {
        let (mut sum, mut count) = (0.0, 0.0);
        values.for_each(|value| (sum, count) = (sum + value * value, count + 1.0));
        f64::sqrt(sum / count)
    };
    let seen = &made.record.displacement_m;
    let mut both = outputs.displacement_m.iter().zip(seen).map(|(one, other)| one - other);
    [rms(&mut both), rms(&mut seen.iter().copied())]
}

#[test]
fn a_law_is_the_one_of_the_library_and_so_is_what_hides_beside_it() {
    for (place, model) in subjects().into_iter().enumerate() {
        let subject = Subject::of(model.clone()).unwrap();
        let [bare_m, size_m] = apart(&model, &subject, drawn(&subject, Vec::new(), 1).unwrap(), 1);
        println!("law {place}: {:.3} nm of {:.1} um", 1e9 * bare_m, 1e6 * size_m);
        assert!(bare_m < 6e-5 * size_m, "law {place}");
        let mut compared = 0;
        for effect in subject.effects(&witness::Effect::LISTED) {
            let kind = EffectKind::ALL.into_iter().find(|kind| kind.name() == effect.name());
            let mut hidden = Effect::typical(kind.unwrap());
            let Ok(made) = drawn(&subject, vec![effect], 100 + place as u64) else {
                println!("  {}: cannot show", effect.name());
                continue;
            };
            compared += 1;
            let truth = subject.in_its_units(made.clone()).truth;
            for value in &truth.parts[0].values {
                hidden = hidden.with(value.name, value.value).unwrap();
            }
            let [apart_m, _] = apart(&model.clone().with_effect(hidden), &subject, made, FINER);
            let part = truth.parts[0].contribution_m.iter();
            let gap_m = (part.map(|own| own * own).sum::<f64>() / truth.parts[0].contribution_m.len() as f64).sqrt();
            println!("  {}: {:.2} nm of {:.0} nm", effect.name(), 1e9 * apart_m, 1e9 * gap_m);
            // The reading of an answer is not rounded.
            if effect != witness::Effect::Quantisation {
                assert!(apart_m < 0.005 * gap_m + 1.5 * bare_m, "law {place}, {}", effect.name());
            }
        }
        assert!(compared >= 12, "law {place}: {compared} effects");
    }
}

/// A broadband run of a second, with an effect of twenty noises or nothing.
fn run(model: ActuatorModel, nuisance: Nuisance, effect: Option<witness::Effect>) -> StudyRun {
    let plan = Plan {
        none: 1,
        singles: 1,
        pairs: 0,
        unlisted: 0,
        limits: 0,
        first_seed: 31_000_000,
        rows: 10_000,
    };
    let subject = Subject::of(model).unwrap();
    let family = effect.map_or(Family::None, |_| Family::Single);
    let mut cases = plan.cases(&subject).into_iter();
    let mut case = cases
        .find(|case| case.family == family && case.nuisance == nuisance)
        .unwrap();
    case.wanted.effects = effect.into_iter().collect();
    case.wanted.gap_over_noise = effect.map(|_| 20.0);
    case.wanted.drive = Some(Drive::Broadband);
    let run = study(&case, &subject);
    println!("{} under {}: {}", run.truth(), run.nuisance, run.answer());
    run
}

/// Guards the diagnosis of other laws, whose past is no one magnetization.
#[test]
fn what_hides_beside_a_law_is_named() {
    for (nuisance, effect) in [
        (Nuisance::Clean, Some(witness::Effect::Friction)),
        (Nuisance::History, Some(witness::Effect::AmplifierBandwidth)),
        (Nuisance::All, Some(witness::Effect::SensorSaturation)),
        (Nuisance::History, None),
    ] {
        let run = run(subjects().swap_remove(0), nuisance, effect);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards the diagnosis of a magnet: a loop so steep that it is no straight line within a tick, and turns before the run and a zero of the drive that
/// show; an output in tesla, in which every size is another.
#[test]
fn what_hides_beside_a_magnet_is_named() {
    for (nuisance, effect) in [
        (Nuisance::Clean, None),
        (Nuisance::History, None),
        (Nuisance::Readback, None),
        (Nuisance::Clean, Some(witness::Effect::Quantisation)),
        (Nuisance::Hum, Some(witness::Effect::Friction)),
        (Nuisance::History, Some(witness::Effect::Stiffening)),
    ] {
        let run = run(magnet(), nuisance, effect);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}
