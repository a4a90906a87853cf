//! Plant and amplifier as nodes of the loop: the only file here that knows messages.

use anhyst_ipc::{Block, CoilField, Measurement, NodeId, Now, Previous, SafeField, Truth, status_word};
use anhyst_model::{Amplifier, AmplifierConstants, Material, RodConstants};
use serde::{Deserialize, Serialize};

use crate::watchdog::{Mode, Watchdog};
use crate::{Plant, PlantError, PlantSettings, WatchdogSettings, validate_amplifier};

/// Behind a lag the coil never quite gets there: so close to the safe field counts as safe, A/m.
const SAFE_WITHIN_A_PER_M: f64 = 1.0;
/// No coil has more; a model would need steps in proportion to the way.
const MAX_A_PER_M: f64 = 1e7;
/// The field of a coil whose amplifier is dead dies in so many ticks, as the simulation has it.
const DEAD_AMPLIFIER_TICKS: u32 = 20;

/// The simulated amplifier: the safe field of tick k in, the coil's field at t_k+1 out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplifierNode {
    amplifier: Amplifier,
    watchdog: Option<Watchdog>,
    tick_s: f64,
}

impl AmplifierNode {
    /// At rest.
    ///
    /// # Errors
    /// Refused constants or tick.
    pub fn new(constants: &AmplifierConstants, tick_s: f64) -> Result<Self, PlantError> {
        validate_amplifier(constants)?;
        Ok(AmplifierNode {
            amplifier: Amplifier::new(*constants, tick_s)?,
            watchdog: None,
            tick_s,
        })
    }

    /// Gives it a watchdog of its own; without one it takes every token for fresh.
    ///
    /// # Errors
    /// Refused settings.
    pub fn with_watchdog(mut self, settings: &WatchdogSettings) -> Result<Self, PlantError> {
        self.watchdog = Some(Watchdog::new(settings, self.tick_s)?);
        Ok(self)
    }

    fn act(&mut self, command_a_per_m: f64) -> CoilField {
        let output = self.amplifier.step(command_a_per_m);
        let mode = self.watchdog.map(|watchdog| watchdog.mode());
        CoilField {
            field_a_per_m: output.field_a_per_m,
            status: status_word([
                (output.amplitude_limited, CoilField::AMPLITUDE_LIMITED),
                (output.slew_limited, CoilField::SLEW_LIMITED),
                (mode == Some(Mode::Ramping), CoilField::RAMPING),
                (mode == Some(Mode::Safe), CoilField::SAFE),
                (mode == Some(Mode::Returning), CoilField::RETURNING),
            ]),
            ..CoilField::default()
        }
    }
}

impl Block for AmplifierNode {
    const NODE: NodeId = NodeId::Amplifier;
    type Inputs = (Now<SafeField>,);
    type Outputs = (CoilField,);

    fn step(&mut self, tick: u64, (Now(safe),): Self::Inputs) -> Self::Outputs {
        let command = match &mut self.watchdog {
            Some(watchdog) => watchdog.command(safe.field_a_per_m, tick.abs_diff(safe.tick)),
            None => safe.field_a_per_m,
        };
        (self.act(command),)
    }

    /// An amplifier goes on whoever simulates it: its lag has followed the commands.
    fn follow(&mut self, tick: u64, inputs: Self::Inputs) {
        self.step(tick, inputs);
    }

    fn alone(&mut self, _tick: u64) -> Option<Self::Outputs> {
        let watchdog = self.watchdog.as_mut()?;
        let distance = self.amplifier.field_a_per_m() - watchdog.safe_field_a_per_m();
        let is_safe = watchdog.mode() == Mode::Safe && distance.abs() <= SAFE_WITHIN_A_PER_M;
        if is_safe {
            return None;
        }
        let command = watchdog.command_alone();
        Some((self.act(command),))
    }
}

/// The simulated plant: the coil's field at t_k in (decided a tick ago), what is measured and what is true at t_k out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantNode {
    plant: Plant,
    /// The coil's field at t_k, as heard last.
    field_a_per_m: f64,
    /// The amplifier has said last that it is at its own safe field, where it stays whoever lives.
    amplifier_is_safe: bool,
    /// What a tick takes away from the coil's field since the amplifier died.
    dying_a_per_m: Option<f64>,
}

impl PlantNode {
    /// At rest.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn new(
        settings: &PlantSettings,
        material: &Material,
        rod: &RodConstants,
        tick_s: f64,
        seed: u64,
    ) -> Result<Self, PlantError> {
        Ok(PlantNode {
            plant: Plant::new(settings, material, rod, tick_s, seed)?,
            field_a_per_m: 0.0,
            amplifier_is_safe: false,
            dying_a_per_m: None,
        })
    }

    /// What is in it.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }
}

impl Block for PlantNode {
    const NODE: NodeId = NodeId::Plant;
    type Inputs = (Previous<CoilField>,);
    type Outputs = (Measurement, Truth);

    fn step(&mut self, tick: u64, (Previous(coil),): Self::Inputs) -> Self::Outputs {
        // Tick 0 is t_0 itself: there is no interval before it. No coil has a field that is no number, or such a field.
        if tick > 0 && coil.field_a_per_m.abs() <= MAX_A_PER_M {
            self.field_a_per_m = coil.field_a_per_m;
        }
        self.amplifier_is_safe = coil.status & CoilField::SAFE != 0;
        if tick > 0 {
            self.plant.advance(self.field_a_per_m);
        }
        self.answer()
    }

    /// The amplifier is dead: the coil's current dies.
    fn alone(&mut self, _tick: u64) -> Option<Self::Outputs> {
        if self.amplifier_is_safe || self.field_a_per_m == 0.0 {
            return None;
        }
        let part = self.field_a_per_m / f64::from(DEAD_AMPLIFIER_TICKS);
        let step = *self.dying_a_per_m.get_or_insert(part);
        let left = self.field_a_per_m - step;
        // The last step lands on 0 and not beside it.
        self.field_a_per_m = if left.abs() < 0.5 * step.abs() { 0.0 } else { left };
        self.plant.advance(self.field_a_per_m);
        Some(self.answer())
    }
}

impl PlantNode {
    /// What is measured and what is true now.
    fn answer(&mut self) -> (Measurement, Truth) {
        let readings = self.plant.measure();
        let state = self.plant.state();
        let measurement = Measurement {
            displacement_m: readings.displacement_m,
            coil_field_a_per_m: readings.field_a_per_m,
            temperature_k: readings.temperature_k,
            ..Measurement::default()
        };
        let truth = Truth {
            displacement_m: state.displacement_m,
            coil_field_a_per_m: state.magnetic.field_a_per_m,
            magnetization_a_per_m: state.magnetic.magnetization_a_per_m,
            shape_a_per_m: state.shape_a_per_m,
            temperature_k: state.temperature_k,
            cutting_force_n: state.cutting_force_n,
            displacement_between_m: state.displacement_between_m,
            ..Truth::default()
        };
        (measurement, truth)
    }
}
