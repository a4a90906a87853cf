//! From a file to a material or a model of an actuator.

use super::ScenarioError;
use super::source;
use super::text::{SCENARIO, expect_kind, instead, is_built_in, misread, options, parse, place_of, read};
use anhyst_identify::laws::{LawFile, Reaction};
use anhyst_measured::Quantity;
use anhyst_model::{
    ActuatorModel, AmplifierConstants, Effect, EffectKind, Hysteresis, Magnetostriction, Material, MaterialLaw,
    ModelError,
};
use ron::error::SpannedError;
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;
use std::path::Path;

/// A model as we write scenarios, or as plain RON, `Some((gain: …))`, as `anhyst diagnose` writes it.
fn parse_model(path: &Path, text: &str) -> Result<ActuatorModel, ScenarioError> {
    let plain = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let error = match (options().from_str(text), plain.from_str(text)) {
        (Ok(model), _) | (_, Ok(model)) => return Ok(model),
        // What was read further was read rightly.
        (Err(one), Err(other)) => {
            let place = |error: &SpannedError| (error.span.start.line, error.span.start.col);
            if place(&one) >= place(&other) { one } else { other }
        }
    };
    Err(misread(path, text, &error))
}

/// A file of a material, or of an actuator's model.
pub(crate) fn load_material(
    file: &Path,
    at: &str,
    scenario: &Path,
    text: &str,
    amplifier: AmplifierConstants,
) -> Result<ActuatorModel, ScenarioError> {
    if !file.is_file() && !is_built_in(file) {
        let what = match file.is_dir() {
            true => "is a folder".to_owned(),
            false => format!("does not exist{}", instead(file)),
        };
        let sentence = format!("the material file {} {what}", file.display());
        return Err(ScenarioError::at(scenario, text, place_of(text, at), sentence));
    }
    let mut model = load_model(file)?;
    // What was beside a fitted law is the rig's that it was measured on; a scenario says its own amplifier and rod.
    if load_with::<LawFile>(file, "input_extent")?.is_some() {
        model.effects.clear();
    }
    // An amended model of a run has the amplifier of that run's scenario.
    if model.amplifier != AmplifierConstants::default() && model.amplifier != amplifier {
        let sentence = format!(
            "the model in {} has an amplifier of its own, which a scenario does not take from there: say it in the \
             scenario's amplifier, and leave it out of the model",
            file.display()
        );
        return Err(ScenarioError::at(scenario, text, place_of(text, at), sentence));
    }
    Ok(model)
}

/// Reads another file of ours, which is told by a field of its own; none if it has not that field.
///
/// # Errors
/// The first thing that is wrong, with file, line and column.
pub fn load_with<T: DeserializeOwned>(path: &Path, field: &str) -> Result<Option<T>, ScenarioError> {
    let text = read(path)?;
    let is_one = source::read(&text).is_some_and(|place| place.has_field(field));
    is_one.then(|| parse(path, &text)).transpose()
}

/// Reads a model of an actuator; a file of a material alone is one without amplifier and rod, for sweeps, and one of a hysteresis
/// alone, as `anhyst fit` writes it where no strain was measured, one without a strain law too, for sweeps of magnetization. The lag and
/// the delay that were fitted beside a law are effects of its model.
///
/// # Errors
/// The first thing that is wrong, with file, line and column.
pub fn load_model(path: &Path) -> Result<ActuatorModel, ScenarioError> {
    let text = read(path)?;
    expect_kind(path, &text, "model or a material", |kind| kind != SCENARIO)?;
    let has = |field: &str| source::read(&text).is_some_and(|place| place.has_field(field));
    let model = if has("input_extent") {
        let file: LawFile = parse(path, &text)?;
        if file.even.is_some() {
            let sentence = "a strain over a law is for `predict`; a loop takes the law of the magnetization or of the displacement".into();
            return Err(ScenarioError::at(path, &text, place_of(&text, "even"), sentence));
        }
        if file.falls {
            let sentence = "a law whose output falls is for `predict`; for a loop give the output's column a factor below 0 and fit again".into();
            return Err(ScenarioError::at(path, &text, place_of(&text, "falls"), sentence));
        }
        of_law(file, path)
            .map_err(|error| ScenarioError::at(path, &text, place_of(&text, "model"), error.to_string()))?
    } else if has("material") {
        parse_model(path, &text)?
    } else if has("anhysteretic") {
        alone(hysteresis_alone(parse(path, &text)?, path))
    } else {
        let material: Material = parse(path, &text)?;
        let refuse =
            |at: &str, error: ModelError| ScenarioError::at(path, &text, place_of(&text, at), error.to_string());
        material
            .hysteresis
            .validate()
            .map_err(|error| refuse("hysteresis", error))?;
        material
            .magnetostriction
            .validate()
            .map_err(|error| refuse("magnetostriction", error))?;
        alone(material)
    };
    model
        .validate()
        .map_err(|error| ScenarioError::at(path, &text, place_of(&text, ""), error.to_string()))?;
    Ok(model)
}

/// A hysteresis law as `anhyst fit --law` writes it, as a material that has it.
fn of_law(file: LawFile, path: &Path) -> Result<ActuatorModel, ModelError> {
    let [low, high] = file.input_extent;
    let law = MaterialLaw {
        input_unit: file.input.unit().to_owned(),
        output_unit: file.output.unit().to_owned(),
        input_extent: [low.min(0.0), high.max(0.0)],
        model: file.model,
    };
    // A lag before the law, whatever it is of; with nothing behind the law the delay of its output is that of its input.
    let Reaction { delay_s, lag_s } = file.reaction;
    let reaction = [(EffectKind::EddyCurrent, lag_s), (EffectKind::SensorDelay, delay_s)];
    let told = reaction.into_iter().filter(|(_, own_s)| *own_s > 0.0);
    let effects = told.map(|(kind, own_s)| {
        let of = &kind.parameters()[0];
        Effect::identity(kind).with(of.name, own_s.min(of.upper))
    });
    let effects = effects.collect::<Result<_, _>>()?;
    let name = path.file_stem().map_or("law".into(), |stem| stem.to_string_lossy());
    let material = Material::of_law(&name, &path.display().to_string(), law)?;
    Ok(ActuatorModel {
        coil: matches!(file.input, Quantity::FieldCommand | Quantity::Field | Quantity::Current),
        effects,
        ..alone(material)
    })
}

/// A material and nothing around it.
fn alone(material: Material) -> ActuatorModel {
    ActuatorModel {
        name: material.name.clone(),
        source: material.source.clone(),
        amplifier: AmplifierConstants::default(),
        material,
        rod: None,
        coil: true,
        effects: Vec::new(),
        ambient_temperature_k: ROOM_TEMPERATURE_K,
        tolerances: Default::default(),
    }
}

/// What a fit to loops without strain knows of a material.
fn hysteresis_alone(hysteresis: Hysteresis, path: &Path) -> Material {
    Material {
        name: format!("hysteresis in {}", path.display()),
        source: "fitted to loops without strain".to_owned(),
        hysteresis,
        magnetostriction: Magnetostriction::Unmeasured,
        law: None,
    }
}

/// A material's numbers belong to this temperature unless a model says otherwise.
const ROOM_TEMPERATURE_K: f64 = 293.0;
