//! Guards what a diagnosis is for: on a plant that has an effect the loop that knows it tracks at least five times
//! better than the loop that does not, with the same feedback and without any. The figures of docs/control.md: `--
//! --nocapture`. Plant and loop have the effect from one piece of code here, as `diagnose --control` has; on a plant that
//! shares none: `tests/tests/known_effects.rs`.

use anhyst::control::{Compensation, Control, Cut, Models, control};
use anhyst_model::{ActuatorModel, Effect, EffectKind};
use anhyst_scenario::{Scenario, Setting, load, to_ron};
use ron::ser::PrettyConfig;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

fn scenario(settings: &[(&str, &str)]) -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/diagnosed.ron");
    let settings: Vec<Setting> = settings
        .iter()
        .map(|(path, value)| Setting {
            path: (*path).to_owned(),
            value: (*value).to_owned(),
        })
        .collect();
    load(&file, &settings).expect("the scenario is good")
}

/// Its own for every call: tests run side by side.
fn folder(name: &str) -> PathBuf {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("anhyst-control-{}-{call}-{name}", std::process::id()))
}

fn compared(effect: Effect, rival: Option<Effect>, scenario: &Scenario) -> Control {
    let old = ActuatorModel::terfenol_d();
    let amended = old.clone().with_effect(effect);
    let believed = rival.map(|rival| old.clone().with_effect(rival));
    let models = Models {
        old: &old,
        amended: &amended,
        runner_up: rival.map(|rival| rival.kind().name()).zip(believed.as_ref()),
    };
    let out = folder(effect.kind().name());
    let compared = control(scenario, models, &out, 2, &|_| {}).expect("the cuts can be made");
    std::fs::remove_dir_all(&out).expect("the folders were there");
    println!("{}\n{}", effect.kind().name(), compared.table().terminal());
    compared
}

fn cut<'a>(compared: &'a Control, believes: &str, feedback: bool) -> &'a Cut {
    let mut cuts = compared.cuts.iter();
    let found = cuts.find(|cut| cut.believes == believes && cut.feedback == feedback);
    found.expect("every cut is in the table")
}

fn effect(kind: EffectKind, values: &[f64]) -> Effect {
    Effect::new(kind, values).expect("within its bounds")
}

/// Sizes of the runs with which the diagnosis was developed; the quadratic part is a tenth of the full law's.
fn named() -> [Effect; 4] {
    [
        effect(EffectKind::EddyCurrent, &[1.8e-4]),
        effect(EffectKind::SensorDelay, &[5.352e-4, 0.0]),
        effect(EffectKind::AfterEffect, &[0.0325, 0.03, 3.0]),
        effect(EffectKind::QuadraticMagnetostriction, &[0.1]),
    ]
}

#[test]
fn the_loop_that_knows_the_effect_tracks_five_times_better() {
    let scenario = scenario(&[]);
    for effect in named() {
        let compared = compared(effect, None, &scenario);
        for feedback in [true, false] {
            let ratio = cut(&compared, "amended", feedback).ratio.expect("both cuts were made");
            assert!(ratio <= 0.2, "{}, feedback {feedback}: {ratio}", effect.kind().name());
        }
    }
}

// Guards the table of compensations: what it says is made up for is, and nothing it says so of is left out here.
#[test]
fn what_is_said_to_be_made_up_for_is() {
    let others = [
        effect(EffectKind::LoopDelay, &[2.5e-4]),
        effect(EffectKind::AmplifierBandwidth, &[1e-4]),
        effect(EffectKind::CoilHeating, &[5.0, 100.0]),
        effect(EffectKind::BiasShift, &[500.0]),
        effect(EffectKind::ExcessLoss, &[0.1, 0.5]),
        effect(EffectKind::Prestress, &[5e-14]),
        effect(EffectKind::ThermalExpansion, &[1.0, 20.0, 12e-6]),
        effect(EffectKind::LoadChange, &[0.1, 0.1]),
        effect(EffectKind::DeltaE, &[0.5]),
        effect(EffectKind::Stiffening, &[1e7]),
        effect(EffectKind::Friction, &[1e-6, 1e-3, 1e-9]),
        effect(EffectKind::PeriodicDisturbance, &[5e-7, 0.0, 80.0]),
        effect(EffectKind::Backlash, &[1.81e-6, 0.0]),
        effect(EffectKind::SecondMode, &[0.0328, 414.7, 0.03]),
        effect(EffectKind::SensorGain, &[0.05]),
        effect(EffectKind::SensorDrift, &[1e-6, 1e-6]),
    ];
    let all: Vec<EffectKind> = named().iter().chain(&others).map(Effect::kind).collect();
    for kind in EffectKind::ALL {
        let full = matches!(Compensation::of(kind), Compensation::Full(_));
        assert_eq!(full, all.contains(&kind), "{}", kind.name());
    }
    let short = scenario(&[("duration_s", "2.0")]);
    for effect in others {
        let compared = compared(effect, None, &short);
        let ratio = cut(&compared, "amended", true).ratio.expect("both cuts were made");
        assert!(ratio <= 0.2, "{}: {ratio}", effect.kind().name());
    }
}

// Guards the control: an effect that is not there must not help, or the comparison would prove nothing.
#[test]
fn the_runner_up_does_not_help() {
    let [eddy, delay, ..] = named();
    let short = scenario(&[("duration_s", "2.0")]);
    let compared = compared(eddy, Some(delay), &short);
    for feedback in [true, false] {
        let ratio = cut(&compared, "sensor_delay", feedback)
            .ratio
            .expect("both cuts were made");
        assert!(ratio > 0.5, "feedback {feedback}: {ratio}");
    }
}

// Guards against silence: a model that a scenario cannot work with is told in the table's place, with the reason.
#[test]
fn a_cut_that_cannot_be_made_says_why() {
    let [_, delay, ..] = named();
    let matrix = scenario(&[("duration_s", "1.0"), ("estimator.law", "Matrix()")]);
    let compared = compared(delay, None, &matrix);
    let refused = cut(&compared, "amended", true).refused.as_deref().unwrap_or_default();
    assert!(refused.contains("Matrix"), "{refused}");
    assert!(compared.sentences().iter().any(|sentence| sentence.contains(refused)));
}

// Guards the way on: what `anhyst diagnose` writes is a material's file to a scenario, effects, rod and all.
#[test]
fn a_scenario_takes_an_amended_model() {
    let folder = folder("amended");
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let file = folder.join("amended.ron");
    let [eddy, ..] = named();
    let amended = ActuatorModel::terfenol_d().with_effect(eddy);
    let as_diagnose_does = ron::ser::to_string_pretty(&amended, PrettyConfig::new().struct_names(false));
    for text in [to_ron(&amended), as_diagnose_does] {
        std::fs::write(&file, text.expect("a text")).expect("a file");
        let taken = scenario(&[("material", &format!("File(\"{}\")", file.display()))]);
        assert_eq!(taken.effects, [eddy]);
        assert_eq!(taken.plant.effects.as_deref(), Some(&[eddy][..]));
        assert_eq!(taken.rod.two_pole, amended.rod);
    }
    let told = scenario(&[
        ("material", &format!("File(\"{}\")", file.display())),
        ("plant.effects", "[]"),
    ]);
    assert_eq!(told.plant.effects.as_deref(), Some(&[][..]));
    std::fs::remove_dir_all(&folder).expect("the folder was there");
}
