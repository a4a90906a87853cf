//! Amplitude and slew:  c = clip(u, lowest, limit),  v_k = v_{k−1} + clip(c − v_{k−1}, ±slew·T).
//!
//! u: field asked for, v: field given, both A/m; T: tick in s; slew in A/(m s). A static limit and a rate limiter: unit gain
//! while neither acts. v_{k−1} is inside the amplitude limit, so v_k is too; the step is within slew·T to one rounding of v.

use serde::{Deserialize, Serialize};

/// A field after the limits, and which of them acted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limited {
    pub field_a_per_m: f64,
    pub amplitude: bool,
    pub slew: bool,
}

/// The amplitude limit and the largest step of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Limits {
    /// Lowest and highest field.
    pub ends_a_per_m: [f64; 2],
    /// `None`: any step.
    pub step_limit_a_per_m: Option<f64>,
}

impl Limits {
    /// Within the ends.
    pub fn clipped(&self, field_a_per_m: f64) -> f64 {
        let [lowest, highest] = self.ends_a_per_m;
        field_a_per_m.clamp(lowest, highest)
    }

    /// From `last` towards `wanted`, as far as the limits and `step_limit` permit. All finite, `last` inside the limit.
    pub fn towards(&self, last_a_per_m: f64, wanted_a_per_m: f64, step_limit_a_per_m: Option<f64>) -> Limited {
        let clipped = self.clipped(wanted_a_per_m);
        let amplitude = clipped != wanted_a_per_m;
        let step = clipped - last_a_per_m;
        match step_limit_a_per_m {
            Some(most) if step.abs() > most => Limited {
                field_a_per_m: self.clipped(last_a_per_m + most.copysign(step)),
                amplitude,
                slew: true,
            },
            // The target itself, not last + step: a limit that does not act must not round.
            _ => Limited {
                field_a_per_m: clipped,
                amplitude,
                slew: false,
            },
        }
    }
}
