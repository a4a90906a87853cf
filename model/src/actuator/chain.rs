//! The chain in motion, and a whole run of it.

use serde::{Deserialize, Serialize};

use super::fields::Fields;
use super::magnetizer::{MagneticStart, Magnetizer};
use super::rod::Load;
use super::rod_stage::RodStage;
use super::samples::Columns;
use super::signals::Signals;
use super::strain::{FreeStrain, Magnetized};
use super::{
    ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutput, ActuatorOutputs, ActuatorRod, Drive, MagneticHalf,
};
use crate::effects::intersample_field::IntersampleField;
use crate::error::require_positive;
use crate::{MagneticState, ModelError, RodState, Stage, Warming};

/// Samples that go through the chain together: few enough to stay in the nearest cache.
const STRETCH: usize = 256;

/// An actuator in motion: demagnetised and cold until its first sample, at which everything else is settled.
///
/// [`Actuator::step`] and [`Actuator::run`] give the same bits, and a run may be cut into pieces.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    amplifier: Fields,
    field: Fields,
    magnetizer: Magnetizer,
    magnetization: Signals,
    strain: FreeStrain,
    rod: RodStage,
    sensor: Signals,
    ambient_temperature_k: f64,
    /// The rod's temperature where it is reckoned for the whole chain, and that of its surroundings (K).
    warming: Option<(Warming, f64)>,
    /// Drive and field in the material at the last sample, A/m.
    drive: f64,
    within: f64,
    begun: bool,
}

impl Actuator {
    /// For samples `tick_s` apart. Allocates what delays need, and never again.
    ///
    /// # Errors
    /// As [`ActuatorModel::validate`]; a tick that is not finite and positive; a delay of more than 100000 ticks.
    pub fn new(model: &ActuatorModel, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "the tick", "s")?;
        Self::with_tick(model, model.actuator_rod(), tick_s)
    }

    /// As [`Actuator::new`], but on this rod in place of the model's.
    ///
    /// # Errors
    /// As [`Actuator::new`], and an effect that the rod cannot have.
    pub fn on_rod(model: &ActuatorModel, rod: ActuatorRod, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "the tick", "s")?;
        Self::with_tick(model, Some(rod), tick_s)
    }

    /// For a sweep without time, slow beyond every lag: the rod is always in equilibrium and the amplifier only clips.
    ///
    /// # Errors
    /// As [`Actuator::new`], and an effect that needs time ([`crate::EffectKind::needs_time`]).
    pub fn quasi_static(model: &ActuatorModel) -> Result<Self, ModelError> {
        for effect in &model.effects {
            if effect.kind().needs_time() {
                return Err(ModelError::EffectNeedsTime {
                    effect: effect.kind().name(),
                });
            }
        }
        Self::with_tick(model, model.actuator_rod(), f64::INFINITY)
    }

    fn with_tick(model: &ActuatorModel, rod: Option<ActuatorRod>, tick_s: f64) -> Result<Self, ModelError> {
        model.validate_with(rod.as_ref())?;
        let effects = &model.effects;
        Ok(Actuator {
            amplifier: Fields::of_amplifier(&model.amplifier, effects, tick_s)?,
            field: Fields::of(effects, Stage::Field, tick_s)?,
            magnetizer: Magnetizer::new(model, tick_s),
            magnetization: Signals::of(effects, Stage::Magnetization, tick_s)?,
            strain: FreeStrain::new(model, tick_s),
            rod: RodStage::new(model, rod, tick_s)?,
            sensor: Signals::of(effects, Stage::Sensor, tick_s)?,
            ambient_temperature_k: model.ambient_temperature_k,
            warming: None,
            drive: 0.0,
            within: 0.0,
            begun: false,
        })
    }

    /// The same, but the first sample finds the material in this state instead of demagnetised. Another law than the domain wall's has
    /// turned round where it is told, and been at one extreme of its input after, the one that leaves this output or comes nearest to it.
    pub fn starting_at(mut self, start: impl Into<MagneticStart>) -> Self {
        self.magnetizer.start(start.into());
        self
    }

    /// The same with a rod whose temperature follows the coil's field and heat from outside: thermal effects take it as they
    /// take a measured one.
    pub fn warming(mut self, warming: Warming, surroundings_k: f64) -> Self {
        self.warming = Some((warming, surroundings_k));
        self
    }

    /// The same, but between samples M and the free strain are straight lines, as estimator and controller take them, and the
    /// hysteresis is computed to 1e-9 Ms.
    pub fn straight_between_samples(mut self) -> Self {
        self.magnetizer.straight = true;
        self
    }

    /// Another shape parameter of the anhysteretic curve at ambient temperature from the next sample on, A/m: finite and positive.
    pub fn set_shape_a_per_m(&mut self, shape_a_per_m: f64) {
        self.magnetizer.set_shape(shape_a_per_m);
    }

    /// Heating of a rod that is [`Actuator::warming`] from outside from now on, K/s.
    pub fn heat(&mut self, heating_k_per_s: f64) {
        if let Some((warming, _)) = &mut self.warming {
            warming.heat(heating_k_per_s);
        }
    }

    /// The shape parameter (A/m) at the last sample's temperature.
    pub fn shape_a_per_m(&self) -> f64 {
        self.magnetizer.shape_a_per_m()
    }

    /// Field in the material and its magnetization without creep, after the last sample.
    pub fn magnetic_state(&self) -> MagneticState {
        self.magnetizer.state
    }

    /// The tip itself after the last sample, before anything that the sensor does; at rest at 0 without a rod.
    pub fn tip(&self) -> RodState {
        self.rod.state()
    }

    /// Takes the next sample.
    pub fn step(&mut self, input: ActuatorInput) -> ActuatorOutput {
        let mut output = ActuatorOutput::default();
        let temperature = input.temperature_k.map(|temperature_k| [temperature_k]);
        let inputs = ActuatorInputs {
            drive_a_per_m: &[input.drive_a_per_m],
            drive: input.drive,
            temperature_k: temperature.as_ref().map(|column| column.as_slice()),
            force_n: Some(&[input.force_n]),
        };
        let columns = Columns {
            field: std::slice::from_mut(&mut output.field_a_per_m),
            magnetization: std::slice::from_mut(&mut output.magnetization_a_per_m),
            strain: std::slice::from_mut(&mut output.strain),
            displacement: std::slice::from_mut(&mut output.displacement_m),
            temperature: std::slice::from_mut(&mut output.temperature_k),
        };
        self.stretch(inputs, columns, &mut [0.0]);
        output
    }

    /// Takes a stretch of samples of any length and overwrites `outputs`.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn run(&mut self, inputs: ActuatorInputs, outputs: &mut ActuatorOutputs) -> Result<(), ModelError> {
        inputs.validate()?;
        let length = inputs.drive_a_per_m.len();
        outputs.resize(length);
        let mut mean_excess = [0.0; STRETCH];
        for from in (0..length).step_by(STRETCH) {
            let to = length.min(from + STRETCH);
            self.stretch(
                inputs.part(from, to),
                outputs.part(from, to),
                &mut mean_excess[..to - from],
            );
        }
        Ok(())
    }

    /// The first half of a whole run, from the drive to the hysteresis: what lies behind may change without its being run again.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn magnetize(&mut self, inputs: ActuatorInputs) -> Result<MagneticHalf, ModelError> {
        self.magnetize_drifting(inputs, [0.0; 2])
    }

    /// The same while the shape parameter drifts evenly, so far above the model's (A/m) at the first sample and so far at the last.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn magnetize_drifting(
        &mut self,
        inputs: ActuatorInputs,
        above_a_per_m: [f64; 2],
    ) -> Result<MagneticHalf, ModelError> {
        inputs.validate()?;
        let length = inputs.drive_a_per_m.len();
        let mut half = MagneticHalf::of_length(length);
        let (own_a_per_m, [first, last]) = (self.magnetizer.ambient_shape_a_per_m(), above_a_per_m);
        let stretch = if first == last { length.max(1) } else { STRETCH };
        for from in (0..length).step_by(stretch) {
            let to = length.min(from + stretch);
            let place = (from + to) as f64 / (2 * length) as f64;
            self.set_shape_a_per_m(own_a_per_m + (first + (last - first) * place));
            let first = !std::mem::replace(&mut self.begun, true);
            let columns = half.columns().map(|column| &mut column[from..to]);
            self.magnetize_stretch(first, &inputs.part(from, to), columns);
        }
        Ok(half)
    }

    /// The other half of that run, on an actuator that has not had its first: the same bits as [`Actuator::run`]. Overwrites `outputs`.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn run_from(
        &mut self,
        half: &MagneticHalf,
        inputs: ActuatorInputs,
        outputs: &mut ActuatorOutputs,
    ) -> Result<(), ModelError> {
        inputs.validate()?;
        outputs.begin_with(half);
        let mut mean_excess = [0.0; STRETCH];
        for from in (0..half.len()).step_by(STRETCH) {
            let to = half.len().min(from + STRETCH);
            let mean_excess = &mut mean_excess[..to - from];
            mean_excess.copy_from_slice(half.mean_excess(from, to));
            let first = !std::mem::replace(&mut self.begun, true);
            self.move_stretch(first, &inputs.part(from, to), outputs.part(from, to), mean_excess);
        }
        Ok(())
    }

    /// The chain, stage by stage; `mean_excess` is room for what a straight line between samples leaves out. All have one length.
    #[inline(always)]
    fn stretch(&mut self, inputs: ActuatorInputs, columns: Columns, mean_excess: &mut [f64]) {
        let first = !std::mem::replace(&mut self.begun, true);
        let magnetic = [
            &mut *columns.field,
            &mut *columns.magnetization,
            &mut *columns.temperature,
            &mut *mean_excess,
        ];
        self.magnetize_stretch(first, &inputs, magnetic);
        self.move_stretch(first, &inputs, columns, mean_excess);
    }

    /// From what the hysteresis has written to the sensor.
    #[inline(always)]
    fn move_stretch(&mut self, first: bool, inputs: &ActuatorInputs, columns: Columns, mean_excess: &mut [f64]) {
        let Columns {
            field,
            magnetization,
            strain,
            displacement,
            temperature,
        } = columns;
        self.magnetization.pass(first, magnetization);
        let known = inputs.temperature_k.is_some() || self.warming.is_some();
        let silent = !known && self.magnetizer.rise_k().is_none();
        let (temperature, unknown) = if known {
            (Some(&*temperature), None)
        } else {
            (None, silent.then_some(temperature))
        };
        let magnetized = Magnetized {
            first,
            coil_field: field,
            magnetization,
            temperature,
        };
        self.strain.pass(&magnetized, strain, mean_excess);
        if self.magnetizer.straight {
            mean_excess.fill(0.0);
        }
        self.strain.expand(&magnetized, strain, unknown);
        let load = Load {
            first,
            strain,
            mean_excess,
            magnetization,
            force: inputs.force_n,
        };
        self.rod.pass(&load, displacement);
        self.sensor.pass(first, displacement);
    }

    /// From the drive to M: writes coil field, M, the temperature as far as it is known here, and the mean excess of M.
    #[inline]
    fn magnetize_stretch(&mut self, first: bool, inputs: &ActuatorInputs, columns: [&mut [f64]; 4]) {
        let [field, magnetization, temperature, mean_excess] = columns;
        match inputs.temperature_k {
            Some(measured) => temperature.copy_from_slice(measured),
            None => temperature.fill(self.ambient_temperature_k),
        }
        let driven = inputs.drive == Drive::Command && !self.amplifier.is_empty();
        let mut from = 0;
        if first && let Some(&drive) = inputs.drive_a_per_m.first() {
            self.drive = drive;
            field[0] = if driven {
                self.amplifier.steady_state(drive)
            } else {
                drive
            };
            self.within = self.field.steady_state(field[0]);
            let known_k = self.known_temperature_k(true, inputs, 0, field[0]);
            magnetization[0] = self.magnetizer.steady_state(field[0], self.within, known_k);
            temperature[0] = known_k.unwrap_or(temperature[0]);
            mean_excess[0] = 0.0;
            from = 1;
        }
        if !driven && self.field.is_empty() && self.magnetizer.is_plain() && self.warming.is_none() {
            for index in from..inputs.drive_a_per_m.len() {
                field[index] = inputs.drive_a_per_m[index];
                (magnetization[index], mean_excess[index]) = self.magnetizer.step_plain(field[index]);
            }
            return;
        }
        let (mut intersample, mut spare) = (IntersampleField::empty(), IntersampleField::empty());
        for index in from..inputs.drive_a_per_m.len() {
            let drive = inputs.drive_a_per_m[index];
            intersample.set_straight(self.drive, drive);
            self.drive = drive;
            if driven {
                self.amplifier.follow(&mut intersample, &mut spare);
            }
            field[index] = intersample.end();
            self.field.follow(&mut intersample, &mut spare);
            intersample.keep_turns(self.within);
            self.within = intersample.end();
            let known_k = self.known_temperature_k(false, inputs, index, field[index]);
            (magnetization[index], mean_excess[index]) = self.magnetizer.step(field[index], &intersample, known_k);
            let reckoned = || Some(self.ambient_temperature_k + self.magnetizer.rise_k()?);
            if let Some(temperature_k) = known_k.or_else(reckoned) {
                temperature[index] = temperature_k;
            }
        }
    }

    /// The rod's temperature where no effect has to reckon it: that of the whole chain, or a measured one, K.
    fn known_temperature_k(
        &mut self,
        first: bool,
        inputs: &ActuatorInputs,
        index: usize,
        coil_field: f64,
    ) -> Option<f64> {
        let Some((warming, surroundings_k)) = &mut self.warming else {
            return inputs.temperature_k.map(|column| column[index]);
        };
        if first {
            warming.stand_at(coil_field);
        } else {
            warming.step(coil_field);
        }
        Some(*surroundings_k + warming.rise_k())
    }
}

/// A run from the demagnetised state, samples `tick_s` apart.
///
/// # Errors
/// As [`Actuator::new`] and [`Actuator::run`].
pub fn simulate(
    model: &ActuatorModel,
    tick_s: f64,
    inputs: ActuatorInputs,
    outputs: &mut ActuatorOutputs,
) -> Result<(), ModelError> {
    Actuator::new(model, tick_s)?.run(inputs, outputs)
}
