//! One tick of the rig: P → T → a, λ_T;  H → M at a;  λ(M) + λ_T and −F → u;  F from u and the face before.
//!
//! H coil field (A/m), linear within a tick; T rod temperature (K) from power P (W): coil loss, exactly averaged over the
//! tick, and the cut's heat; a(t) shape (A/m), taken at the tick's end; M magnetization (A/m); λ(M), λ_T free strains;
//! u displacement of the tip (m); F cutting force (N). F at the tick's end is computed from the displacement
//! extrapolated with the tip's velocity: so nothing is solved for, and what is neglected is ½·ü·tick²·K, below 0.1 N for
//! the heaviest preset at 20 kHz.
//! Assumptions: uniform field, strain and temperature. Source: the paper's section 5, with the physics around it.

use anhyst_model::{
    Hysteresis, MagneticState, Magnetostriction, Material, Noise, RodConstants, Sensor, ThermalExpansion,
};
use serde::{Deserialize, Serialize};

use crate::chain::{Chain, Reached};
use crate::rod::Rod;
use crate::{CuttingProcess, Heating, PlantError, PlantSettings, ShapeCourse};

/// What is really so at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantState {
    /// Displacement of the tip, m.
    pub displacement_m: f64,
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
    hysteresis: Hysteresis,
    magnetostriction: Magnetostriction,
    shape: ShapeCourse,
    heating: Option<Heating>,
    expansion: Option<ThermalExpansion>,
    cutting: Option<CuttingProcess>,
    rod: Rod,
    /// With physical effects: in place of hysteresis, strain law and rod above.
    chain: Option<Box<Chain>>,
    /// What the displacement sensor sees where that is not the tip, m.
    sensed_m: Option<f64>,
    /// The rod starts in equilibrium with its strain at t_0: it moves by the strain since then, from this displacement.
    rest_strain: f64,
    rest_displacement_m: f64,
    strain: f64,
    state: PlantState,
    displacement: Channel,
    field: Channel,
    temperature: Option<Channel>,
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
        let temperature_k = settings.start_temperature_k;
        for shape_a_per_m in settings.shape.known_shapes_a_per_m(temperature_k) {
            material.hysteresis.with_shape(shape_a_per_m).validate()?;
        }
        let rod_in_motion = Rod::new(settings.rod, rod, tick_s)?;
        let cutting = match settings.cut.milling() {
            Some(milling) => {
                let cutting = CuttingProcess::new(milling, settings.contact, tick_s);
                Some(cutting.map_err(|refusal| refusal.within("cut"))?)
            }
            None => None,
        };
        let sensors = &settings.sensors;
        let mut plant = Plant {
            tick_s,
            tick: 0,
            hysteresis: material.hysteresis,
            magnetostriction: material.magnetostriction,
            shape: settings.shape,
            heating: settings.heating,
            expansion: settings.expansion,
            cutting,
            rod: rod_in_motion,
            chain: None,
            sensed_m: None,
            rest_strain: 0.0,
            rest_displacement_m: 0.0,
            strain: 0.0,
            state: PlantState {
                temperature_k,
                shape_a_per_m: settings.shape.shape_a_per_m(0.0, temperature_k),
                ..PlantState::default()
            },
            displacement: Channel::new(sensors.displacement(), seed, 0),
            field: Channel::new(sensors.field(), seed, 1),
            temperature: sensors.temperature().map(|sensor| Channel::new(sensor, seed, 2)),
        };
        plant.rest_strain = plant.free_strain();
        plant.strain = plant.rest_strain;
        plant.rest_displacement_m = plant.rest_strain * rod.force_per_strain_n() * rod.static_compliance_m_per_n();
        plant.state.displacement_m = plant.rest_displacement_m;
        if let Some((chain, reached)) = Chain::new(settings, material, rod, tick_s)? {
            plant.chain = Some(Box::new(chain));
            plant.take(reached);
        }
        Ok(plant)
    }

    /// What is really so now.
    pub fn state(&self) -> &PlantState {
        &self.state
    }

    /// Goes on by one tick while the field goes linearly from its last value to `field_to_a_per_m`. A field that is no
    /// number cannot be in a coil: the last one stays.
    pub fn advance(&mut self, field_to_a_per_m: f64) {
        let field_from = self.state.magnetic.field_a_per_m;
        let field_to = if field_to_a_per_m.is_finite() {
            field_to_a_per_m
        } else {
            field_from
        };
        let time_from_s = self.time_s();
        self.tick += 1;
        let time_to_s = self.time_s();

        self.warm(field_from, field_to, time_from_s);
        self.state.shape_a_per_m = self.shape.shape_a_per_m(time_to_s, self.state.temperature_k);
        let velocity_m_per_s = match &self.chain {
            Some(chain) => chain.tip().velocity_m_per_s,
            None => self.rod.tip().velocity_m_per_s,
        };
        let force_to_n = self.cutting.as_ref().map_or(0.0, |cutting| {
            let coming_m = self.state.displacement_m + velocity_m_per_s * self.tick_s;
            cutting.force_n(time_to_s, coming_m)
        });
        match &mut self.chain {
            Some(chain) => {
                let (shape, temperature_k) = (self.state.shape_a_per_m, self.state.temperature_k);
                let reached = chain.advance(field_to, shape, temperature_k, -force_to_n);
                self.take(reached);
            }
            None => self.advance_plain(field_to, force_to_n),
        }
        self.state.cutting_force_n = force_to_n;
        if let Some(cutting) = &mut self.cutting {
            cutting.leave_face(time_to_s, self.state.displacement_m);
        }
    }

    /// Hysteresis, strain law and rod without effects.
    fn advance_plain(&mut self, field_to: f64, force_to_n: f64) {
        let hysteresis = self.hysteresis.with_shape(self.state.shape_a_per_m);
        self.state.magnetic = hysteresis.advance(self.state.magnetic, field_to);
        let strain_from = self.strain - self.rest_strain;
        self.strain = self.free_strain();
        let force_from_n = self.state.cutting_force_n;
        self.rod.advance(
            (strain_from, self.strain - self.rest_strain),
            (-force_from_n, -force_to_n),
        );
        self.state.displacement_m = self.rest_displacement_m + self.rod.tip().displacement_m;
    }

    /// The chain's tick as the plant's state.
    fn take(&mut self, reached: Reached) {
        let tip = self.chain.as_ref().map(|chain| chain.tip()).unwrap_or_default();
        self.sensed_m = Some(reached.sensed_m);
        self.state.displacement_m = tip.displacement_m;
        self.state.magnetic = MagneticState {
            field_a_per_m: reached.coil_field_a_per_m,
            magnetization_a_per_m: reached.magnetization_a_per_m,
        };
        self.state.shape_a_per_m = reached.shape_a_per_m;
        self.state.temperature_k = reached.temperature_k;
    }

    /// Reads every sensor once; call it once a tick, because each reading draws noise.
    pub fn measure(&mut self) -> Readings {
        let temperature_k = self.state.temperature_k;
        Readings {
            displacement_m: self
                .displacement
                .measure(self.sensed_m.unwrap_or(self.state.displacement_m)),
            field_a_per_m: self.field.measure(self.state.magnetic.field_a_per_m),
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

    fn warm(&mut self, field_from: f64, field_to: f64, time_s: f64) {
        let Some(heating) = &self.heating else { return };
        let temperature_k = self.state.temperature_k;
        let coil_w = heating.coil.map_or(0.0, |coil| {
            // Simpson's rule is exact for the square of a field that is linear in time.
            let [from, middle, to] = [field_from, 0.5 * (field_from + field_to), field_to]
                .map(|field_a_per_m| coil.power_w(field_a_per_m, temperature_k));
            (from + 4.0 * middle + to) / 6.0
        });
        let cut_w = self.cutting.as_ref().map_or(0.0, |cutting| cutting.heat_w(time_s));
        self.state.temperature_k = heating.circuit.advance(temperature_k, coil_w + cut_w, self.tick_s);
    }

    /// λ(M) + λ_T.
    fn free_strain(&self) -> f64 {
        let saturation = self.hysteresis.saturation_magnetization_a_per_m;
        let magnetic = self
            .magnetostriction
            .strain(self.state.magnetic.magnetization_a_per_m, saturation);
        magnetic
            + self
                .expansion
                .map_or(0.0, |expansion| expansion.strain(self.state.temperature_k))
    }
}
