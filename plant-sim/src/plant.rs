//! One tick of the rig: an [`Actuator`] that warms, at a(t), under the force of a cut, and what sensors say of it.
//!
//! H coil field (A/m), linear within a tick; T rod temperature (K) from coil loss and the cut's heat; a(t) shape (A/m), taken
//! at the tick's end; u displacement of the tip (m); F cutting force (N). F at the tick's end is computed from the
//! displacement extrapolated with the tip's velocity: so nothing is solved for, and what is neglected is ½·ü·tick²·K, below
//! 0.1 N for the heaviest preset at 20 kHz.
//! The amplifier's token is the actuator's command: effects of the amplifier act between it and the coil. Without effects and
//! without a two_pole of its own the plant is straight between ticks, as estimator and controller take it; with them M is
//! taken by its mean over a tick: 1 A/m of it is 0.2 nm. Source: the paper's section 5, with the physics around it.
//! Half a tick before a sample the tip is on the cubic through displacement and velocity at both ends, (u₀ + u₁)/2 + (v₀ − v₁)·tick/8:
//! off by tick⁴/384 times the fourth derivative, (ω·tick)⁴/384 of what the rod does at ω.

use anhyst_ipc::Invalid;
use anhyst_model::{
    Actuator, ActuatorInput, ActuatorModel, ActuatorOutput, ActuatorRod, AmplifierConstants, Effect, EffectKind,
    Flicker, MagneticState, Material, ModelError, Noise, RodConstants, RodElements, Sensor, Warming, rod_per_strain,
};
use serde::{Deserialize, Serialize};

use crate::settings::SensorFaults;
use crate::{CuttingProcess, PlantError, PlantRod, PlantSettings, ShapeCourse};

/// Elements from which [`PlantRod::TwoPole`] is reduced: with these the paper's w comes out to all printed digits.
pub const TWO_POLE_ELEMENTS: usize = 8;

/// What is really so at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// Displacement of the tip, m.
    pub displacement_m: f64,
    /// Half a tick before, m.
    pub displacement_between_m: f64,
    /// Field in the coil, and magnetization.
    pub magnetic: MagneticState,
    /// a, A/m.
    pub shape_a_per_m: f64,
    /// Of the rod, K.
    pub temperature_k: f64,
    /// Against the rod, N.
    pub cutting_force_n: f64,
}

/// What the sensors say at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// Displacement of the tip, m.
    pub displacement_m: f64,
    /// Field in the coil, A/m.
    pub field_a_per_m: f64,
    /// Of the rod, K; 0 without a thermometer.
    pub temperature_k: f64,
}

/// A sensor with its own stream of noise: what one sensor draws never depends on another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Channel {
    sensor: Sensor,
    noise: Noise,
}

impl Channel {
    fn new(sensor: Sensor, seed: u64, stream: u64) -> Self {
        Channel {
            sensor,
            noise: Noise::new(seed, stream),
        }
    }

    fn measure(&mut self, true_value: f64) -> f64 {
        self.sensor.measure(true_value, &mut self.noise)
    }
}

/// The simulated plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    tick_s: f64,
    tick: u64,
    actuator: Actuator,
    shape: ShapeCourse,
    ambient_temperature_k: f64,
    /// What a joule does to the rod's temperature, K/J; 0 without heating.
    rise_per_heat: f64,
    cutting: Option<CuttingProcess>,
    command_a_per_m: f64,
    /// What the displacement sensor sees, before its noise, m.
    sensed_m: f64,
    state: PlantState,
    displacement: Channel,
    field: Channel,
    temperature: Option<Channel>,
    faults: SensorFaults,
    flicker: Flicker,
}

impl Plant {
    /// At rest at t_0: zero field, demagnetised, at its start temperature.
    ///
    /// # Errors
    /// Refused settings, a material that is not valid for every shape that the course is known to reach, a refused rod or tick.
    pub fn new(
        settings: &PlantSettings,
        material: &Material,
        rod: &RodConstants,
        tick_s: f64,
        seed: u64,
    ) -> Result<Self, PlantError> {
        settings.validate()?;
        let material = settings.material.as_ref().unwrap_or(material);
        material.validate()?;
        for shape_a_per_m in settings.shape.known_shapes_a_per_m(settings.start_temperature_k) {
            material.hysteresis.with_shape(shape_a_per_m).validate()?;
        }
        let cutting = match settings.cut.milling() {
            Some(milling) => {
                let cutting = CuttingProcess::new(milling, settings.contact, tick_s);
                Some(cutting.map_err(|refusal| refusal.within("cut"))?)
            }
            None => None,
        };
        let (actuator, ambient_temperature_k) = actuator(settings, material, rod, tick_s)?;
        let sensors = &settings.sensors;
        let mut plant = Plant {
            tick_s,
            tick: 0,
            actuator,
            shape: settings.shape,
            ambient_temperature_k,
            rise_per_heat: settings
                .heating
                .map_or(0.0, |heating| 1.0 / heating.circuit.heat_capacity_j_per_k),
            cutting,
            command_a_per_m: 0.0,
            sensed_m: 0.0,
            state: PlantState::default(),
            displacement: Channel::new(sensors.displacement(), seed, 0),
            field: Channel::new(sensors.field(), seed, 1),
            temperature: sensors.temperature().map(|sensor| Channel::new(sensor, seed, 2)),
            faults: sensors.faults,
            flicker: Flicker::new(Noise::new(seed, 3)),
        };
        plant.step(0.0, 0.0);
        Ok(plant)
    }

    /// What is really so now.
    pub fn state(&self) -> &PlantState {
        &self.state
    }

    /// Goes on by one tick while the field goes linearly from its last value to `field_to_a_per_m`. A field that is no
    /// number cannot be in a coil: the last one stays.
    pub fn advance(&mut self, field_to_a_per_m: f64) {
        if field_to_a_per_m.is_finite() {
            self.command_a_per_m = field_to_a_per_m;
        }
        let time_from_s = self.time_s();
        self.tick += 1;
        let time_to_s = self.time_s();
        let coming_m = self.state.displacement_m + self.actuator.tip().velocity_m_per_s * self.tick_s;
        let (force_n, heat_w) = self.cutting.as_ref().map_or((0.0, 0.0), |cutting| {
            (cutting.force_n(time_to_s, coming_m), cutting.heat_w(time_from_s))
        });
        self.step(force_n, heat_w * self.rise_per_heat);
        if let Some(cutting) = &mut self.cutting {
            cutting.leave_face(time_to_s, self.state.displacement_m);
        }
    }

    /// The actuator's next sample, with what the cut does to it.
    fn step(&mut self, cutting_force_n: f64, heating_k_per_s: f64) {
        let shape_a_per_m = self.shape.shape_a_per_m(self.time_s(), self.ambient_temperature_k);
        self.actuator.set_shape_a_per_m(shape_a_per_m);
        self.actuator.heat(heating_k_per_s);
        let before = self.actuator.tip();
        let ActuatorOutput {
            field_a_per_m,
            magnetization_a_per_m,
            displacement_m,
            temperature_k,
            ..
        } = self.actuator.step(ActuatorInput {
            force_n: -cutting_force_n,
            ..ActuatorInput::command(self.command_a_per_m)
        });
        self.sensed_m = displacement_m;
        let tip = self.actuator.tip();
        let displacement_between_m = if self.tick == 0 {
            tip.displacement_m
        } else {
            let turned_m = 0.125 * self.tick_s * (before.velocity_m_per_s - tip.velocity_m_per_s);
            0.5 * (before.displacement_m + tip.displacement_m) + turned_m
        };
        self.state = PlantState {
            displacement_m: tip.displacement_m,
            displacement_between_m,
            magnetic: MagneticState {
                field_a_per_m,
                magnetization_a_per_m,
            },
            shape_a_per_m: self.actuator.shape_a_per_m(),
            temperature_k,
            cutting_force_n,
        };
    }

    /// Reads every sensor once; call it once a tick, because each reading draws noise.
    pub fn measure(&mut self) -> Readings {
        let temperature_k = self.state.temperature_k;
        let (mut sensed_m, mut field_a_per_m) = (self.sensed_m, self.state.magnetic.field_a_per_m);
        let faults = self.faults;
        // Untouched without them: the bits of a good sensor stay.
        if faults != SensorFaults::default() {
            let hum = libm::sin(std::f64::consts::TAU * faults.displacement_hum_hz * self.time_s());
            sensed_m += faults.displacement_flicker_m * self.flicker.normal() + faults.displacement_hum_m * hum;
            field_a_per_m = (1.0 + faults.field_gain) * field_a_per_m + faults.field_zero_a_per_m;
        }
        Readings {
            displacement_m: self.displacement.measure(sensed_m),
            field_a_per_m: self.field.measure(field_a_per_m),
            temperature_k: self
                .temperature
                .as_mut()
                .map_or(0.0, |channel| channel.measure(temperature_k)),
        }
    }

    /// t_k from its number, not summed: no rounding gathers in a long run.
    fn time_s(&self) -> f64 {
        self.tick as f64 * self.tick_s
    }
}

/// The actuator of the settings, before its first sample, and its ambient temperature (K).
fn actuator(
    settings: &PlantSettings,
    material: &Material,
    rod: &RodConstants,
    tick_s: f64,
) -> Result<(Actuator, f64), PlantError> {
    let start_temperature_k = settings.start_temperature_k;
    let mut effects = settings.effects.clone().unwrap_or_default();
    let straight = effects.is_empty() && settings.two_pole.is_none();
    if let ShapeCourse::Thermal { .. } = settings.shape {
        effects.push(proportional_to_temperature(&effects)?);
    }
    let mut ambient_temperature_k = start_temperature_k;
    if let Some(expansion) = &settings.expansion {
        effects.push(expansion.effect()?);
        ambient_temperature_k = expansion.reference_temperature_k;
    }
    let model = ActuatorModel {
        name: material.name.clone(),
        source: material.source.clone(),
        amplifier: AmplifierConstants::default(),
        material: material.clone(),
        rod: None,
        coil: true,
        effects,
        ambient_temperature_k,
        tolerances: Default::default(),
    };
    let rod = match (settings.rod, settings.two_pole) {
        (PlantRod::Elements(count), _) => ActuatorRod::Elements(RodElements::assemble(rod, count)?),
        (PlantRod::TwoPole, Some(own)) => ActuatorRod::TwoPole(rod_per_strain(own, material)),
        (PlantRod::TwoPole, None) => ActuatorRod::TwoPole(RodElements::assemble(rod, TWO_POLE_ELEMENTS)?.two_pole(1.0)),
    };
    let mut actuator = Actuator::on_rod(&model, rod, tick_s).map_err(|error| match error {
        ModelError::EffectNeedsTwoPoles { .. } => PlantError::Invalid(Invalid::new("rod", error.to_string())),
        other => PlantError::Model(other),
    })?;
    if straight {
        actuator = actuator.straight_between_samples();
    }
    if let Some(heating) = &settings.heating {
        let warming = heating.warming(start_temperature_k, tick_s);
        actuator = actuator.warming(warming, heating.circuit.ambient_k);
    } else if settings.expansion.is_some() {
        // It stays as warm as it is.
        actuator = actuator.warming(Warming::new(0.0, 1.0, tick_s), start_temperature_k);
    }
    Ok((actuator, ambient_temperature_k))
}

/// a = a₀·T/T₀ as an effect; it warms as an expansion does, because it is the same rod.
fn proportional_to_temperature(effects: &[Effect]) -> Result<Effect, ModelError> {
    let expansion = effects
        .iter()
        .find(|effect| effect.kind() == EffectKind::ThermalExpansion);
    let warming = expansion.map_or([0.0, 1.0], |effect| [effect.values()[0], effect.values()[1]]);
    Effect::new(EffectKind::ThermalDrift, &[warming[0], warming[1], 1.0])
}
