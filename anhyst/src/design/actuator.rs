//! The actuator that a wish names: a preset, or a file of a material, a model or a hysteresis law.

use super::Wish;
use super::amount::{amount, nice_down, ron, round};
use super::presets::{PRESETS, Preset};
use anhyst_controller::StrainLaw;
use anhyst_identify::laws::{LawFile, Reaction};
use anhyst_measured::nearest;
use anhyst_model::{ActuatorModel, Magnetostriction, RodConstants, RodElements, TwoPole, rod_per_strain};
use anhyst_scenario::{ScenarioError, gives_m, load_model, load_with};
use miette::miette;
use std::path::Path;

/// What the two poles are computed from, as a scenario's rod does.
const ELEMENTS: usize = 8;
/// Of the magnetization: beyond, more field brings little.
const OF_SATURATION: f64 = 0.9;
/// A stage and a magnet of which nothing is said: resonance in Hz, damping ratio.
const STAGE: (f64, f64) = (500.0, 0.03);
const MAGNET: (f64, f64) = (2000.0, 1.0);

/// It and how a scenario names it.
pub struct Actuator {
    pub preset: Option<&'static Preset>,
    pub model: ActuatorModel,
    /// Gain per free strain.
    pub rod: TwoPole,
    /// RON of the scenario's `material`, of `plant.material_file` and of `rod`.
    pub material_ron: String,
    pub plant_ron: Option<String>,
    pub rod_ron: String,
    /// In words.
    pub words: String,
    /// What the data of a fitted law told beside it.
    pub reaction: Reaction,
    pub noise_rms: Option<f64>,
    length_m: Option<f64>,
}

impl Actuator {
    /// Of a wish for a scenario that will lie in this folder.
    ///
    /// # Errors
    /// No such preset or file; an option that is for another kind of actuator.
    pub fn of(wish: &Wish, folder: &Path) -> miette::Result<Self> {
        let preset = PRESETS.iter().find(|preset| preset.name == wish.material);
        let file = Path::new(preset.map_or(wish.material.as_str(), |preset| preset.material));
        let model = match load_model(file) {
            Err(ScenarioError::Unreadable { instead, .. }) if preset.is_none() => {
                let names = PRESETS.map(|preset| preset.name);
                // What is no file's name means none.
                let instead = Some(instead)
                    .filter(|_| wish.material.ends_with(".ron"))
                    .unwrap_or_default();
                let meant = nearest(&wish.material, names);
                let meant = meant.map_or_else(String::new, |near| format!("is {near} meant? It is "));
                return Err(miette!(
                    "--material {}: {meant}neither a file nor one of {}{instead}; `anhyst fit` writes a file from measured loops",
                    wish.material,
                    names.join(", ")
                ));
            }
            read => read?,
        };
        let fitted: Option<LawFile> = load_with(file, "input_extent")?;
        if model.material.magnetostriction == Magnetostriction::Unmeasured {
            return Err(miette!(
                "--material {}: it says nothing of a strain, so it drives no rod; fit loops with a column of strain",
                wish.material
            ));
        }
        let named = |file: &Path| {
            let from_here = folder.as_os_str().is_empty() || folder == Path::new(".");
            let path = if from_here || preset.is_some() {
                Ok(file.to_owned())
            } else {
                std::path::absolute(file)
            };
            format!("{:?}", path.unwrap_or_else(|_| file.to_owned()).display().to_string())
        };
        let plant = wish
            .plant
            .as_deref()
            .or(preset.and_then(|preset| preset.plant.map(Path::new)));
        let (rod, rod_ron, length_m) = if model.material.law.is_some() {
            stage(wish, preset, &model)?
        } else {
            rod_of(wish, &model)?
        };
        let words = preset.map_or_else(
            || model.material.name.replace(char::is_control, " "),
            |preset| preset.words.to_owned(),
        );
        Ok(Self {
            preset,
            material_ron: format!("File({})", named(file)),
            plant_ron: plant.map(named),
            rod,
            rod_ron,
            model,
            words,
            reaction: fitted.as_ref().map(|own| own.reaction).unwrap_or_default(),
            noise_rms: fitted.and_then(|own| own.noise_rms),
            length_m,
        })
    }

    /// It follows another law than the domain wall's.
    pub fn of_law(&self) -> bool {
        self.model.material.law.is_some()
    }

    /// Units of input and output.
    pub fn units(&self) -> [&str; 2] {
        self.model.material.units()
    }

    /// Ends of the displacement from rest: within a limit of the input, or else within what its law was fitted to, or 90 % of saturation.
    pub fn gives(&self, limit: Option<f64>) -> [f64; 2] {
        let material = &self.model.material;
        match limit {
            Some(limit) => gives_m(material, &self.rod, limit),
            None if self.of_law() => gives_m(material, &self.rod, f64::MAX),
            None => {
                let strain = StrainLaw::new(&self.rod, material);
                let most = OF_SATURATION * strain.saturation_a_per_m();
                let ends = [-most, most].map(|own| strain.displacement_m(own));
                [ends[0].min(ends[1]), ends[0].max(ends[1])]
            }
        }
    }

    /// What is wished where nothing is said.
    pub fn usual_stroke(&self) -> f64 {
        let [low, high] = self.gives(None);
        self.preset
            .map_or_else(|| nice_down(0.5 * (high - low)), |preset| preset.stroke)
    }

    /// What is wished where nothing is said.
    pub fn usual_frequency_hz(&self) -> f64 {
        let share = if self.of_law() { 50.0 } else { 25.0 };
        let usual = nice_down(self.rod.natural_frequency_hz() / share);
        self.preset.map_or(usual, |preset| preset.frequency_hz)
    }

    /// The largest input that its law was fitted to; none without a law.
    pub fn data_end(&self) -> Option<f64> {
        let law = self.model.material.law.as_ref();
        law.map(|law| law.input_extent[1].max(-law.input_extent[0]))
    }

    /// Of an amplifier that has the lag which a law's data told; none where they told of none.
    pub fn lag_bandwidth_hz(&self) -> Option<f64> {
        let lag_s = self.reaction.lag_s;
        (lag_s > 0.0).then(|| round((std::f64::consts::TAU * lag_s).recip(), 4))
    }

    /// A longer rod gives more; none where it has no length.
    pub fn length_for(&self, factor: f64) -> Option<f64> {
        self.length_m.map(|length_m| factor * length_m)
    }
}

type Rod = (TwoPole, String, Option<f64>);

/// A stage's or a magnet's one resonance.
fn stage(wish: &Wish, preset: Option<&Preset>, model: &ActuatorModel) -> miette::Result<Rod> {
    if let Some(option) = wish.of_rod() {
        return Err(miette!(
            "{option} is for a rod; {} follows one resonance: --resonance, --damping",
            model.name
        ));
    }
    let usual = if model.material.units()[1] == "T" {
        MAGNET
    } else {
        STAGE
    };
    let usual = preset.and_then(|preset| preset.resonance).unwrap_or(usual);
    let frequency_hz = wish.number("--resonance", &wish.resonance, "Hz")?.unwrap_or(usual.0);
    let damping_ratio = wish.damping.unwrap_or(usual.1);
    if !(damping_ratio > 0.0 && damping_ratio <= 10.0) {
        return Err(miette!("--damping {damping_ratio} is outside (0, 10]; 1 is critical"));
    }
    let resonance = anhyst_scenario::Resonance {
        frequency_hz,
        damping_ratio,
    };
    let ron = format!(
        "(resonance: (frequency_hz: {}, damping_ratio: {}))",
        ron(frequency_hz),
        ron(damping_ratio)
    );
    Ok((rod_per_strain(resonance.two_pole(), &model.material), ron, None))
}

/// A rod: a fitted model's own, or the paper's with what is said of it.
fn rod_of(wish: &Wish, model: &ActuatorModel) -> miette::Result<Rod> {
    if wish.resonance.is_some() || wish.damping.is_some() {
        return Err(miette!(
            "--resonance and --damping are for stages and magnets; a rod's follow from --length, --diameter, --mass, --youngs-modulus and --density"
        ));
    }
    if let Some(fitted) = model.rod {
        return match wish.of_rod() {
            Some(option) => Err(miette!("{option}: the model {} has a rod of its own", model.name)),
            None => Ok((rod_per_strain(fitted, &model.material), "()".into(), None)),
        };
    }
    let paper = RodConstants::paper();
    let said = |option, text: &Option<String>, unit, usual| {
        Ok::<_, miette::Report>(wish.number(option, text, unit)?.unwrap_or(usual))
    };
    let constants = RodConstants {
        youngs_modulus_pa: said("--youngs-modulus", &wish.youngs_modulus, "Pa", paper.youngs_modulus_pa)?,
        density_kg_per_m3: match &wish.density {
            None => paper.density_kg_per_m3,
            Some(text) => amount("--density", text, "kg/m3").map_err(|sentence| miette!("{sentence}"))?,
        },
        length_m: said("--length", &wish.length, "m", paper.length_m)?,
        diameter_m: said("--diameter", &wish.diameter, "m", paper.diameter_m)?,
        end_mass_kg: said("--mass", &wish.mass, "kg", paper.end_mass_kg)?,
        ..paper
    };
    let elements = RodElements::assemble(&constants, ELEMENTS).map_err(|error| miette!("the rod: {error}"))?;
    let text = format!(
        "(
        constants: (
            youngs_modulus_pa: {},
            density_kg_per_m3: {},
            length_m: {},
            diameter_m: {},
            internal_damping_n_s_per_m2: {},
            // What it pushes against: spring, damper and mass at its end.
            end_stiffness_n_per_m: {},
            end_damping_n_s_per_m: {},
            end_mass_kg: {},
        ),
    )",
        ron(constants.youngs_modulus_pa),
        ron(constants.density_kg_per_m3),
        ron(constants.length_m),
        ron(constants.diameter_m),
        ron(constants.internal_damping_n_s_per_m2),
        ron(constants.end_stiffness_n_per_m),
        ron(constants.end_damping_n_s_per_m),
        ron(constants.end_mass_kg),
    );
    Ok((elements.two_pole(1.0), text, Some(constants.length_m)))
}
