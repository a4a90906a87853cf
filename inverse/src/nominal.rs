//! The way without an estimate: dM/dH = F(H, M) at the material's nominal `a`, along the field that was really given.
//!
//! The memory follows the amplifier's model at every tick, whether it is needed or not, so that it is true when it is. The
//! change to it and back is bumpless: the first answer is the field that was given last, u_k = v_{k−1}, and the distance to
//! the new way's own answer dies along a straight line, u = u_new + (v − u_new,0)·(1 − j/N), N = [`BLEND_TICKS`].
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
    distance_a_per_m: f64,
    blend_ticks: u32,
}

impl Nominal {
    pub fn new(amplifier: &AmplifierConstants, tick_s: f64) -> Result<Self, ModelError> {
        Ok(Self {
            amplifier: Amplifier::new(*amplifier, tick_s)?,
            state: MagneticState::default(),
            fallen_back: false,
            distance_a_per_m: 0.0,
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

    /// What has to be added to this tick's answer, A/m; exactly 0 when no walk is under way.
    pub fn distance_a_per_m(&mut self, fallen_back: bool, answer_a_per_m: f64, last_safe_field_a_per_m: f64) -> f64 {
        if fallen_back != self.fallen_back {
            self.fallen_back = fallen_back;
            let distance = last_safe_field_a_per_m - answer_a_per_m;
            self.distance_a_per_m = if distance.is_finite() { distance } else { 0.0 };
            self.blend_ticks = BLEND_TICKS;
        }
        if self.blend_ticks == 0 {
            return 0.0;
        }
        let part = f64::from(self.blend_ticks) / f64::from(BLEND_TICKS);
        self.blend_ticks -= 1;
        self.distance_a_per_m * part
    }
}
