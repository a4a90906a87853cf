//! The way without an estimate: dM/dH = F(H, M) at the material's nominal `a`, along the field that was really given.
//!
//! The memory follows the amplifier's model at every tick, whether it is needed or not, so that it is true when it is. The
//! change to it and back is bumpless: the first answer is the field that was given last, and the distance to the new way's
//! own answer dies along a straight line of N = [`BLEND_TICKS`] ticks. It is a distance of magnetization,
//! M_asked = M_wanted + (M(v) − M_wanted,0)·(1 − j/N), M(v) what the field given last would reach: added to the field instead it
//! would be an error that the memory sees and turns back in every tick, and as the slope differs with the direction, it rings.
//! Only what is left then (lags, and structures without such a memory) is a distance of field, u + (v − u_0)·(1 − j/N).
//! H, u, v fields (A/m), M magnetization (A/m). Assumption: the amplifier's constants are known.

use anhyst_model::{Amplifier, AmplifierConstants, Hysteresis, MagneticState, ModelError};
use serde::{Deserialize, Serialize};

/// Ticks of the walk from one way to the other.
pub const BLEND_TICKS: u32 = 100;

/// Magnetic state of the nominal material, and the walk between the ways.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Nominal {
    amplifier: Amplifier,
    /// At t_k+1.
    pub state: MagneticState,
    fallen_back: bool,
    /// Distances at the walk's beginning.
    magnetization_a_per_m: f64,
    field_a_per_m: f64,
    blend_ticks: u32,
}

impl Nominal {
    pub fn new(amplifier: &AmplifierConstants, tick_s: f64) -> Result<Self, ModelError> {
        Ok(Self {
            amplifier: Amplifier::new(*amplifier, tick_s)?,
            state: MagneticState::default(),
            fallen_back: false,
            magnetization_a_per_m: 0.0,
            field_a_per_m: 0.0,
            blend_ticks: 0,
        })
    }

    /// The state at t_k+1 after the field of the tick before was given.
    pub fn follow(&mut self, tick: u64, last_safe_field_a_per_m: f64, hysteresis: &Hysteresis) {
        // At tick 0 nothing has been given.
        if tick > 0 {
            self.amplifier.step(last_safe_field_a_per_m);
        }
        self.state = hysteresis.advance(self.state, self.amplifier.next_field_a_per_m());
    }

    /// True in the tick in which the way changes.
    pub fn turns(&mut self, fallen_back: bool) -> bool {
        fallen_back != std::mem::replace(&mut self.fallen_back, fallen_back)
    }

    /// Begins a walk with this distance of magnetization; a distance that is no number is none.
    pub fn begin(&mut self, distance_a_per_m: f64) {
        self.magnetization_a_per_m = finite(distance_a_per_m);
        self.field_a_per_m = 0.0;
        self.blend_ticks = BLEND_TICKS;
    }

    /// What the first answer of the walk leaves of the field.
    pub fn begin_field(&mut self, distance_a_per_m: f64) {
        self.field_a_per_m = finite(distance_a_per_m);
    }

    /// To be added to this tick's demand, A/m; exactly 0 when no walk is under way.
    pub fn magnetization_a_per_m(&self) -> f64 {
        self.magnetization_a_per_m * self.part()
    }

    /// To be added to this tick's answer, A/m, which ends the tick of the walk; exactly 0 when none is under way.
    pub fn take_field_a_per_m(&mut self) -> f64 {
        let field_a_per_m = self.field_a_per_m * self.part();
        self.blend_ticks = self.blend_ticks.saturating_sub(1);
        field_a_per_m
    }

    fn part(&self) -> f64 {
        f64::from(self.blend_ticks) / f64::from(BLEND_TICKS)
    }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
