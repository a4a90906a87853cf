//! From a file to a checked scenario.

use super::derive::{Derived, is_derived};
use super::material::load_material;
use super::text::{SCENARIO, expect_kind, is_built_in, parse, place_of, read};
use super::{MaterialSource, Scenario, ScenarioError, source};
use anhyst_estimator::LawSettings;
use anhyst_ipc::Invalid;
use anhyst_plant_sim::ShapeCourse;
use std::path::{Path, PathBuf};

/// One `--set path=value`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Field names joined by dots.
    pub path: String,
    /// The value as RON.
    pub value: String,
}

impl std::str::FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (path, value) = text
            .split_once('=')
            .ok_or_else(|| format!("{text} has no '='; write path=value"))?;
        if path.split('.').any(|name| name.trim().is_empty()) {
            return Err(format!(
                "{text} has no name before '=', or an empty one; write path=value"
            ));
        }
        Ok(Self {
            path: path.trim().into(),
            value: value.trim().into(),
        })
    }
}

/// Reads, edits and checks a scenario. Relative files in it are relative to it.
///
/// # Errors
/// The first thing that is wrong, with file, line and column.
pub fn load(path: &Path, settings: &[Setting]) -> Result<Scenario, ScenarioError> {
    load_changed(path, settings, |_| ())
}

/// The same, with what the command line says of the run worked in before anything is checked.
///
/// # Errors
/// The first thing that is wrong, with file, line and column.
pub fn load_changed(
    path: &Path,
    settings: &[Setting],
    change: impl FnOnce(&mut Scenario),
) -> Result<Scenario, ScenarioError> {
    ScenarioText::read(path, settings)?.checked(change)
}

/// A scenario's text with what it is based on and `--set` worked in: read once, for scenarios that differ in a few values.
#[derive(Debug, Clone)]
pub struct ScenarioText {
    /// The file that its lines belong to.
    file: PathBuf,
    /// Who else has changed the text.
    changed_by: Vec<String>,
    text: String,
}

impl ScenarioText {
    /// Reads and edits it.
    ///
    /// # Errors
    /// A file that cannot be read, or a setting that cannot be done.
    pub fn read(path: &Path, settings: &[Setting]) -> Result<Self, ScenarioError> {
        let by = (!settings.is_empty()).then(|| "--set".to_owned());
        resolve(path, settings, by.into_iter().collect(), 0)
    }

    /// A text that shall stand in this file, and need not yet.
    pub fn of(file: &Path, text: String) -> Self {
        Self {
            file: file.to_owned(),
            changed_by: Vec::new(),
            text,
        }
    }

    /// The same text with more changes; `by` says whose they are.
    ///
    /// # Errors
    /// A setting that cannot be done.
    pub fn changed(&self, settings: &[Setting], by: &str) -> Result<Self, ScenarioError> {
        let mut changed_by = self.changed_by.clone();
        changed_by.push(by.to_owned());
        let text = edit(&self.text, settings)?;
        Ok(Self {
            file: self.file.clone(),
            changed_by,
            text,
        })
    }

    /// The scenario, with `change` worked in before it is checked. Relative files in it are relative to its own.
    ///
    /// # Errors
    /// The first thing that is wrong, with file, line and column.
    pub fn checked(&self, change: impl FnOnce(&mut Scenario)) -> Result<Scenario, ScenarioError> {
        let (shown, text) = (self.shown(), &self.text);
        let mut scenario: Scenario = parse(&shown, text)?;
        let folder = self.file.parent().unwrap_or(Path::new("."));
        if let MaterialSource::File(material) = &scenario.material {
            let found = load_material(&beside(folder, material), "material", &shown, text, scenario.amplifier)?;
            // A model of an actuator: what the scenario says of itself goes before what the model says.
            if scenario.effects.is_empty() {
                scenario.effects = found.effects;
            }
            scenario.rod.two_pole = scenario.rod.two_pole.or(found.rod);
            scenario.material = MaterialSource::Inline(Box::new(found.material));
        }
        if let Some(material) = scenario.plant.material_file.take() {
            let at = "plant.material_file";
            scenario.plant.material =
                Some(load_material(&beside(folder, &material), at, &shown, text, scenario.amplifier)?.material);
        }
        if let Some(resonance) = scenario.rod.resonance.take() {
            let checked = resonance.validate().map(|()| resonance.two_pole());
            let two_pole = checked.map_err(|invalid| refuse(&shown, text, &invalid.within("rod.resonance")))?;
            scenario.rod.two_pole = Some(two_pole);
        }
        follow_material(&mut scenario, text);
        scenario.complete_plant();
        scenario.anchor(folder);
        change(&mut scenario);
        scenario.validate().map_err(|invalid| {
            let sentence = scenario.units().reworded(&invalid.sentence);
            refuse(&shown, text, &Invalid { sentence, ..invalid })
        })?;
        Ok(scenario)
    }

    /// The file in words for refusals: who has changed the text is part of it.
    fn shown(&self) -> PathBuf {
        match &self.changed_by[..] {
            [] => self.file.clone(),
            by => format!("{} (as changed by {})", self.file.display(), by.join(" and ")).into(),
        }
    }
}

/// The `a` for which the laws' default range and start are.
const DEFAULTS_ARE_FOR_A_PER_M: f64 = 7012.0;

/// What the text does not say of the estimator's range and start follows the material's `a`, in proportion.
fn follow_material(scenario: &mut Scenario, text: &str) {
    let Ok(material) = scenario.material() else {
        return;
    };
    let shape_a_per_m = material.hysteresis.shape_a_per_m;
    let has = |name: &str| source::read(text).is_some_and(|place| place.has(name));
    if material.law.is_some() {
        scenario.plant.shape = ShapeCourse::Constant { a_per_m: shape_a_per_m };
        if !has("estimator.law") {
            scenario.estimator.law = LawSettings::Weights(Default::default());
        }
        return;
    }
    let factor = shape_a_per_m / DEFAULTS_ARE_FOR_A_PER_M;
    let says = |name: &str| has(&format!("estimator.law.{name}"));
    let (says_range, says_start) = (says("range_a_per_m"), says("start_a_per_m"));
    let (range, start) = match &mut scenario.estimator.law {
        LawSettings::FixedShape { .. } | LawSettings::Weights(_) | LawSettings::FixedWeights => return,
        LawSettings::MultiParameter(own) => {
            if !says_start {
                own.start_a_per_m = shape_a_per_m;
            }
            return;
        }
        LawSettings::GaussNewton(own) => (&mut own.range_a_per_m, &mut own.start_a_per_m),
        LawSettings::Folded(own) | LawSettings::Gradient(own) | LawSettings::Matrix(own) | LawSettings::Scalar(own) => {
            (&mut own.range_a_per_m, &mut own.start_a_per_m)
        }
    };
    if !says_range {
        *range = (factor * range.0, factor * range.1);
    }
    if !says_start {
        *start *= factor;
    }
}

fn resolve(
    path: &Path,
    settings: &[Setting],
    mut changed_by: Vec<String>,
    depth: usize,
) -> Result<ScenarioText, ScenarioError> {
    let text = read(path)?;
    expect_kind(path, &text, SCENARIO, |kind| kind == SCENARIO)?;
    if !is_derived(&text) {
        return Ok(ScenarioText {
            file: path.to_owned(),
            changed_by,
            text: edit(&text, settings)?,
        });
    }
    let derived: Derived = parse(path, &text)?;
    if depth > 8 {
        let bytes = place_of(&text, "based_on");
        let sentence = "is based on itself, more than 8 files deep".into();
        return Err(ScenarioError::at(path, &text, bytes, sentence));
    }
    changed_by.insert(0, path.display().to_string());
    let mut all = vec![Setting {
        path: "name".into(),
        value: format!("\"{}\"", derived.name),
    }];
    all.extend(derived.set.into_iter().map(|(path, value)| Setting { path, value }));
    all.extend_from_slice(settings);
    let base = path.parent().unwrap_or(Path::new(".")).join(derived.based_on);
    resolve(&base, &all, changed_by, depth + 1)
}

/// A file that a scenario names: relative to it, or in the program.
fn beside(folder: &Path, file: &Path) -> PathBuf {
    if is_built_in(file) {
        file.to_owned()
    } else {
        folder.join(file)
    }
}

fn edit(text: &str, settings: &[Setting]) -> Result<String, ScenarioError> {
    let mut text = text.to_owned();
    for Setting { path, value } in settings {
        let refuse = |sentence| ScenarioError::Setting {
            setting: format!("{path}={value}"),
            sentence,
        };
        // What closes or opens more than itself would be told of another place of the scenario.
        let whole =
            source::read(value).is_some_and(|own| !value[own.value.end..].trim_start().starts_with([')', ']', '}']));
        if !whole {
            return Err(refuse(
                "the value is not whole: a bracket or a quote in it is open or one too many, or a text stands without quotes"
                    .into(),
            ));
        }
        let place = source::read(&text).ok_or_else(|| refuse("the scenario is not readable RON".into()))?;
        text = place.set(&text, path, value).map_err(refuse)?;
    }
    Ok(text)
}

fn refuse(path: &Path, text: &str, invalid: &Invalid) -> ScenarioError {
    ScenarioError::at(path, text, place_of(text, &invalid.path), invalid.to_string())
}
