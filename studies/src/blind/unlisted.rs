//! Effects that the library does not hold, laid over the displacement x of the nominal model; s is what the gap asks for.
//!
//! Ripple: y = x + s sin(2π x / p), the interpolation error of an encoder, p its period.
//! Drag: y = x − s ẋ|ẋ|, a force of the square of the speed on a stiff rod.
//! Fatigue: y = x (1 − s m), m' = (x²/x_max² − m)/τ, τ = 0.05 s: the gain sags after activity and recovers.

use super::draw::Draw;
use anhyst_diagnosis::rms;

const FATIGUE_S: f64 = 0.05;

/// Physics of the study alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unlisted {
    Ripple,
    Drag,
    Fatigue,
}

impl Unlisted {
    pub const ALL: [Unlisted; 3] = [Unlisted::Ripple, Unlisted::Drag, Unlisted::Fatigue];

    pub fn name(self) -> &'static str {
        match self {
            Unlisted::Ripple => "unlisted_ripple",
            Unlisted::Drag => "unlisted_drag",
            Unlisted::Fatigue => "unlisted_fatigue",
        }
    }

    /// What it adds to a displacement, of the wanted rms (m); none where it cannot.
    pub fn added(self, x: &[f64], tick_s: f64, wanted_m: f64, draw: &mut Draw) -> Option<Vec<f64>> {
        let largest = x.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let period_m = largest / draw.between(4.0, 15.0);
        let mut memory = 0.0;
        let mut added: Vec<f64> = (0..x.len())
            .map(|row| match self {
                Unlisted::Ripple => libm::sin(std::f64::consts::TAU * x[row] / period_m),
                Unlisted::Drag => {
                    let speed = (x[row] - x[row.saturating_sub(1)]) / tick_s;
                    -speed * speed.abs()
                }
                Unlisted::Fatigue => {
                    memory += (x[row] * x[row] / (largest * largest) - memory) * tick_s / FATIGUE_S;
                    -x[row] * memory
                }
            })
            .collect();
        let scale = wanted_m / rms(added.iter().copied());
        if !scale.is_finite() {
            return None;
        }
        added.iter_mut().for_each(|value| *value *= scale);
        Some(added)
    }
}
