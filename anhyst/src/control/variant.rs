//! One cut of the comparison as a scenario: a plant that is the one model, a controller's side that believes another.
//!
//! The scenario gives trajectory, feedback, guard, noise and the estimator's law; material, rod, amplifier and effects
//! come from the models. The plant's `a` stays where its model has it.

use anhyst_estimator::LawSettings;
use anhyst_launch::error::RunError;
use anhyst_model::ActuatorModel;
use anhyst_plant_sim::{PlantRod, ShapeCourse};
use anhyst_scenario::{MaterialSource, Placement, Scenario};

/// The cut with this truth and this belief. Without `feedback` the feedforward and the estimator act alone.
///
/// # Errors
/// A cut that the models cannot make, in a sentence.
pub fn variant(
    base: &Scenario,
    name: &str,
    truth: &ActuatorModel,
    belief: &ActuatorModel,
    feedback: bool,
) -> Result<Scenario, RunError> {
    let mut scenario = base.clone();
    name.clone_into(&mut scenario.name);
    scenario.placement = Placement::Embedded;
    scenario.recording.on = false;
    scenario.material = MaterialSource::Inline(Box::new(belief.material.clone()));
    scenario.rod.two_pole = belief.rod.or(base.rod.two_pole);
    scenario.amplifier = belief.amplifier;
    scenario.effects.clone_from(&belief.effects);
    let plant = &mut scenario.plant;
    plant.material = Some(truth.material.clone());
    plant.two_pole = truth.rod.or(base.rod.two_pole);
    plant.effects = Some(truth.effects.clone());
    plant.rod = PlantRod::TwoPole;
    plant.expansion = None;
    plant.heating = None;
    plant.start_temperature_k = truth.ambient_temperature_k;
    let (true_a, believed_a) = (shape_of(truth), shape_of(belief));
    plant.shape = ShapeCourse::Constant { a_per_m: true_a };
    scenario.estimator.law = starting_at(scenario.estimator.law, believed_a, true_a);
    if !feedback {
        scenario.controller.feedback = None;
        scenario.controller.learning = None;
    }
    scenario.validate()?;
    Ok(scenario)
}

fn shape_of(model: &ActuatorModel) -> f64 {
    model.material.hysteresis.shape_a_per_m
}

/// What of the scenario the models stand in for, in sentences.
pub fn replaced(base: &Scenario, truth: &ActuatorModel) -> Vec<String> {
    let mut sentences = vec![format!(
        "Of the scenario \"{}\" trajectory, feedback, guard, noise and estimator are used; material, amplifier and effects are those of \
         \"{}\", and the plant's `a` is constant at {} A/m",
        base.name,
        truth.name,
        shape_of(truth)
    )];
    sentences.push(match truth.rod {
        Some(_) => "The rod is the two poles of the model".to_owned(),
        None => "The model has no rod: the scenario's stands in for it".to_owned(),
    });
    if base.plant.heating.is_some() || base.plant.expansion.is_some() {
        sentences.push("Heating and expansion of the scenario's plant are left out".to_owned());
    }
    let law = base.estimator.law;
    if law != starting_at(law, shape_of(truth), shape_of(truth)) && !reaches(law, shape_of(truth)) {
        sentences.push(format!(
            "The estimator's range does not hold {} A/m: `a` is fixed at what each model says",
            shape_of(truth)
        ));
    }
    sentences
}

fn reaches(law: LawSettings, shape_a_per_m: f64) -> bool {
    let (lower, upper) = law.range_a_per_m();
    lower < upper && (lower..=upper).contains(&shape_a_per_m)
}

/// The law with its start where the model is believed to be; fixed there where its range does not hold both values.
fn starting_at(law: LawSettings, believed: f64, truth: f64) -> LawSettings {
    if !reaches(law, believed) || !reaches(law, truth) {
        return LawSettings::FixedShape {
            shape_a_per_m: believed,
        };
    }
    law.starting_at(believed)
}
