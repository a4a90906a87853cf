//! Plant and amplifier as nodes of the loop: the only file here that knows messages.

use anhyst_ipc::{Block, CoilField, Measurement, NodeId, Now, Previous, SafeField, Truth};
use anhyst_model::{Amplifier, AmplifierConstants, Material, RodConstants};
use serde::{Deserialize, Serialize};

use crate::{Plant, PlantError, PlantSettings, validate_amplifier};

/// The simulated amplifier: the safe field of tick k in, the coil's field at t_k+1 out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplifierNode {
    amplifier: Amplifier,
    /// The last command that was a number, A/m.
    command_a_per_m: f64,
    /// Where the field goes when nobody commands, A/m, and by how much in a tick.
    safe: Option<(f64, f64)>,
    tick_s: f64,
}

/// So near the safe field, A/m, counts as there: behind a lag the coil never quite gets there.
const SAFE_WITHIN_A_PER_M: f64 = 1.0;

impl AmplifierNode {
    /// At rest.
    ///
    /// # Errors
    /// Refused constants or tick.
    pub fn new(constants: &AmplifierConstants, tick_s: f64) -> Result<Self, PlantError> {
        validate_amplifier(constants)?;
        Ok(AmplifierNode {
            amplifier: Amplifier::new(*constants, tick_s)?,
            command_a_per_m: 0.0,
            safe: None,
            tick_s,
        })
    }

    /// The same, which goes to this field at this slew when it hears nobody any more.
    #[must_use]
    pub fn safe_at(mut self, safe_field_a_per_m: f64, ramp_slew_a_per_m_s: f64) -> Self {
        self.safe = Some((safe_field_a_per_m, ramp_slew_a_per_m_s * self.tick_s));
        self
    }

    fn act(&mut self, command_a_per_m: f64) -> CoilField {
        if command_a_per_m.is_finite() {
            self.command_a_per_m = command_a_per_m;
        }
        let output = self.amplifier.step(command_a_per_m);
        CoilField {
            field_a_per_m: output.field_a_per_m,
            status: u64::from(output.amplitude_limited) | u64::from(output.slew_limited) << 1,
            ..CoilField::default()
        }
    }
}

impl Block for AmplifierNode {
    const NODE: NodeId = NodeId::Amplifier;
    type Inputs = (Now<SafeField>,);
    type Outputs = (CoilField,);

    fn step(&mut self, _tick: u64, (Now(safe),): Self::Inputs) -> Self::Outputs {
        (self.act(safe.field_a_per_m),)
    }

    fn alone(&mut self, _tick: u64) -> Option<Self::Outputs> {
        let (safe_a_per_m, step_a_per_m) = self.safe?;
        let away = |field: f64| (field - safe_a_per_m).abs() > SAFE_WITHIN_A_PER_M;
        // The field of the tick after this one is decided already: it must be safe, too.
        let is_safe = !away(self.amplifier.field_a_per_m())
            && !away(self.amplifier.next_field_a_per_m())
            && self.command_a_per_m == safe_a_per_m;
        if is_safe {
            return None;
        }
        let way = safe_a_per_m - self.command_a_per_m;
        let command = self.command_a_per_m + way.clamp(-step_a_per_m, step_a_per_m);
        Some((self.act(command),))
    }
}

/// The simulated plant: the coil's field at t_k in (decided a tick ago), what is measured and what is true at t_k out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantNode {
    plant: Plant,
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
        // Tick 0 is t_0 itself: there is no interval before it.
        if tick > 0 {
            self.plant.advance(coil.field_a_per_m);
        }
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
            ..Truth::default()
        };
        (measurement, truth)
    }
}
