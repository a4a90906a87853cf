//! What a commissioned rig has shown, and what is believed of it afterwards.

use crate::commands::save;
use anhyst_ipc::{Estimate, Measurement, Message, SafeField};
use anhyst_launch::folder::RunFolder;
use anhyst_launch::measured_table::measured_table;
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_model::{ActuatorModel, HysteresisParameter, NominalParameter};
use anhyst_plant_sim::PlantRod;
use anhyst_recorder::Recording;
use anhyst_scenario::{MaterialSource, Scenario};
use std::path::Path;

/// Half the range in which `a` is sought, in standard deviations of what is known of it.
const KNOWN_DEVIATIONS: f64 = 3.0;

pub(super) fn told(error: impl std::fmt::Display) -> miette::Report {
    miette::miette!("{error}")
}

/// What was said on a channel in a step.
pub(super) fn tokens<M: Message>(folder: &Path) -> miette::Result<Vec<M>> {
    let recording = Recording::of_parts(&RunFolder::open(folder).recordings()).map_err(told)?;
    recording.tokens().map_err(told)
}

/// What a step has measured, written beside it.
pub(super) fn measured_run(scenario: &Scenario, folder: &Path) -> miette::Result<MeasuredRun> {
    let (measured, asked) = (tokens::<Measurement>(folder)?, tokens::<SafeField>(folder)?);
    let table = measured_table(&measured, &asked, scenario.tick_s, &scenario.units());
    save(folder, "run.csv", &table.csv())?;
    MeasuredRun::read(&folder.join("run.csv"), &RunReadOptions::default()).map_err(told)
}

/// The model with what the loop made of `a` in a cut, its mean, and the range of the loop's law as what is known of it; standard deviation of its drift
/// over the cut (A/m). Held where it is believed to be, other constants would explain what the loop follows. A law that does not adapt changes nothing.
pub(super) fn following(
    mut model: ActuatorModel,
    scenario: &Scenario,
    estimates: &[Estimate],
) -> (ActuatorModel, Option<f64>) {
    let (lower, upper) = scenario.estimator.law.range_a_per_m();
    let mean_a_per_m = estimates.iter().map(|own| own.shape_a_per_m).sum::<f64>() / estimates.len().max(1) as f64;
    if lower >= upper || !(lower..=upper).contains(&mean_a_per_m) {
        return (model, None);
    }
    let shape = NominalParameter::Hysteresis(HysteresisParameter::Shape);
    shape.set(&mut model, mean_a_per_m);
    let known = (upper - lower) / (2.0 * KNOWN_DEVIATIONS);
    let name = shape.name(&model).to_owned();
    model.tolerances.insert(name, known / mean_a_per_m);
    (model, Some(2.0 * known))
}

/// The scenario with another model on the controller's side; the plant stays what it is.
pub(super) fn believing(scenario: &Scenario, model: &ActuatorModel) -> Scenario {
    let mut own = scenario.clone();
    own.material = MaterialSource::Inline(Box::new(model.material.clone()));
    // A plant of elements would be made of the two poles that others believe in.
    if own.plant.rod == PlantRod::TwoPole {
        own.rod.two_pole = model.rod.or(own.rod.two_pole);
    }
    own.effects.clone_from(&model.effects);
    own
}
