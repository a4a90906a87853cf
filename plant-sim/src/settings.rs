//! What a scenario says about the simulated rig.

use anhyst_ipc::Invalid;
use anhyst_model::{AmplifierConstants, Effect, EffectKind, Material, ModelError, Sensor, TwoPole};
use serde::{Deserialize, Serialize};

use crate::{Contact, Cut, ExpansionSettings, Heating, ShapeCourse};

/// Below, Terfenol-D's easy axis reorients and the model no longer holds.
const COLDEST_K: f64 = 250.0;
/// Terfenol-D's Curie temperature.
const HOTTEST_K: f64 = 630.0;

/// The simulated plant; material and rod constants stand elsewhere in the scenario, because others know them, too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantSettings {
    /// True course of `a`; of a material with another law there is none.
    #[serde(default)]
    pub shape: ShapeCourse,
    /// Which rod.
    #[serde(default)]
    pub rod: PlantRod,
    /// What the sensors add.
    pub sensors: Sensors,
    /// Temperature of the rod at t_0, K; stays so without `heating`. 293 K unless told.
    #[serde(default = "room_temperature_k")]
    pub start_temperature_k: f64,
    /// How the rod warms up.
    #[serde(default)]
    pub heating: Option<Heating>,
    /// How the rod lengthens when warm; at its reference temperature it adds nothing.
    #[serde(default)]
    pub expansion: Option<ExpansionSettings>,
    /// What the tip cuts.
    #[serde(default)]
    pub cut: Cut,
    /// When it cuts.
    #[serde(default)]
    pub contact: Contact,
    /// Physical effects that are really there; none: those that the others believe in.
    #[serde(default)]
    pub effects: Option<Vec<Effect>>,
    /// The material that is really there; none: the one that the others believe in.
    #[serde(default)]
    pub material: Option<Material>,
    /// The same in a file of a material, a model or a hysteresis law, relative to the scenario; loading puts it in `material`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<std::path::PathBuf>,
    /// The rod that is really there, its gain per magnetization; none: the one that the others believe in.
    #[serde(default)]
    pub two_pole: Option<TwoPole>,
}

fn room_temperature_k() -> f64 {
    293.0
}

/// Noise (rms, white) and resolution of each sensor; a resolution of 0 switches quantisation off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Of the tip's displacement, m.
    pub displacement_noise_m: f64,
    /// Of the tip's displacement, m.
    #[serde(default)]
    pub displacement_resolution_m: f64,
    /// Of the monitor of the coil's field, A/m.
    pub field_noise_a_per_m: f64,
    /// Of the monitor of the coil's field, A/m.
    #[serde(default)]
    pub field_resolution_a_per_m: f64,
    /// Of the rod's temperature; none: not fitted, 0 is sent.
    #[serde(default)]
    pub temperature: Option<TemperatureSensor>,
    /// What is wrong with them beside.
    #[serde(default)]
    pub faults: SensorFaults,
}

/// What a good sensor has not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorFaults {
    /// Noise of the displacement whose power falls as 1/f, rms, m.
    pub displacement_flicker_m: f64,
    /// A hum on the displacement: amplitude, m.
    pub displacement_hum_m: f64,
    /// Its frequency, Hz.
    pub displacement_hum_hz: f64,
    /// The field's monitor says this share too much.
    pub field_gain: f64,
    /// And this more, A/m.
    pub field_zero_a_per_m: f64,
}

/// A thermometer on the rod.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemperatureSensor {
    /// rms, K.
    pub noise_k: f64,
    /// K.
    #[serde(default)]
    pub resolution_k: f64,
}

/// More elements than this only cost time: the 64th mode is far above any sampling frequency.
const MAX_ELEMENTS: usize = 64;

/// Which rod is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PlantRod {
    /// The paper's (13): what estimator and controller assume, too.
    #[default]
    TwoPole,
    /// This many elements: has the higher modes that the others do not know.
    Elements(usize),
}

impl Sensors {
    pub(crate) fn displacement(&self) -> Sensor {
        Sensor {
            noise_rms: self.displacement_noise_m,
            resolution: self.displacement_resolution_m,
        }
    }

    pub(crate) fn field(&self) -> Sensor {
        Sensor {
            noise_rms: self.field_noise_a_per_m,
            resolution: self.field_resolution_a_per_m,
        }
    }

    pub(crate) fn temperature(&self) -> Option<Sensor> {
        self.temperature.map(|sensor| Sensor {
            noise_rms: sensor.noise_k,
            resolution: sensor.resolution_k,
        })
    }

    fn validate(&self) -> Result<(), Invalid> {
        let parts = [
            ("displacement_noise_m", self.displacement_noise_m, 1e-3, "m"),
            ("displacement_resolution_m", self.displacement_resolution_m, 1e-3, "m"),
            ("field_noise_a_per_m", self.field_noise_a_per_m, 1e6, "A/m"),
            ("field_resolution_a_per_m", self.field_resolution_a_per_m, 1e6, "A/m"),
        ];
        for (path, value, most, unit) in parts {
            Invalid::unless_between(path, value, 0.0, most, unit)?;
        }
        self.faults.validate().map_err(|refusal| refusal.within("faults"))?;
        let Some(thermometer) = self.temperature else {
            return Ok(());
        };
        Invalid::unless_between("temperature.noise_k", thermometer.noise_k, 0.0, 100.0, "K")?;
        Invalid::unless_between("temperature.resolution_k", thermometer.resolution_k, 0.0, 100.0, "K")
    }
}

impl SensorFaults {
    fn validate(&self) -> Result<(), Invalid> {
        let parts = [
            ("displacement_flicker_m", self.displacement_flicker_m, 0.0, 1e-3, "m"),
            ("displacement_hum_m", self.displacement_hum_m, 0.0, 1e-3, "m"),
            ("displacement_hum_hz", self.displacement_hum_hz, 0.0, 1e6, "Hz"),
            ("field_gain", self.field_gain, -0.5, 0.5, ""),
            ("field_zero_a_per_m", self.field_zero_a_per_m, -1e6, 1e6, "A/m"),
        ];
        for (path, value, least, most, unit) in parts {
            Invalid::unless_between(path, value, least, most, unit)?;
        }
        Ok(())
    }
}

impl PlantSettings {
    /// Checks everything that can be judged without material, rod and tick.
    ///
    /// # Errors
    /// The first setting that cannot be used, with its path.
    pub fn validate(&self) -> Result<(), Invalid> {
        self.shape.validate().map_err(|refusal| refusal.within("shape"))?;
        if let PlantRod::Elements(count) = self.rod
            && !(1..=MAX_ELEMENTS).contains(&count)
        {
            let sentence = format!("{count} elements are outside [1, {MAX_ELEMENTS}]");
            return Err(Invalid::new("rod", sentence));
        }
        self.sensors.validate().map_err(|refusal| refusal.within("sensors"))?;
        Invalid::unless_between(
            "start_temperature_k",
            self.start_temperature_k,
            COLDEST_K,
            HOTTEST_K,
            "K",
        )?;
        self.heating
            .map_or(Ok(()), |heating| heating.validate())
            .map_err(|refusal| refusal.within("heating"))?;
        self.expansion
            .map_or(Ok(()), |expansion| expansion.validate())
            .map_err(|refusal| refusal.within("expansion"))?;
        self.validate_together()?;
        if let Cut::Custom(milling) = &self.cut {
            milling.validate().map_err(|refusal| refusal.within("cut"))?;
        }
        self.contact.validate().map_err(|refusal| refusal.within("contact"))
    }

    /// What does not go together.
    fn validate_together(&self) -> Result<(), Invalid> {
        if self.two_pole.is_some() && self.rod != PlantRod::TwoPole {
            let sentence = "a plant with a two_pole of its own has a rod of two poles: leave Elements out";
            return Err(Invalid::new("rod", sentence));
        }
        let effects = self.effects.as_deref().unwrap_or_default();
        let drifts = effects.iter().any(|effect| effect.kind() == EffectKind::ThermalDrift);
        if drifts && matches!(self.shape, ShapeCourse::Thermal { .. }) {
            let sentence = "Thermal and the effect ThermalDrift both make `a` follow the temperature: keep one of them";
            return Err(Invalid::new("shape", sentence));
        }
        if self.expansion.is_some() && !effects.is_empty() {
            let sentence = "a plant with effects expands by the effect ThermalExpansion: give that in its place";
            return Err(Invalid::new("expansion", sentence));
        }
        Ok(())
    }
}

/// Checks a scenario's amplifier, part by part, so that each refusal has its path.
///
/// # Errors
/// The first part that no amplifier can have.
pub fn validate_amplifier(constants: &AmplifierConstants) -> Result<(), Invalid> {
    let parts = [
        ("bandwidth_hz", constants.bandwidth_hz, "Hz"),
        ("field_limit_a_per_m", constants.field_limit_a_per_m, "A/m"),
        ("slew_limit_a_per_m_s", constants.slew_limit_a_per_m_s, "A/(m s)"),
    ];
    for (path, part, unit) in parts {
        part.map_or(Ok(()), |value| Invalid::unless_positive(path, value, unit))?;
    }
    at("delay_ticks", constants.validate())
}

/// A refusal of the model, with the path at which the scenario has it.
fn at(path: &str, checked: Result<(), ModelError>) -> Result<(), Invalid> {
    checked.map_err(|error| Invalid::new(path, error.to_string()))
}
