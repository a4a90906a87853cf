//! y ← min(max(y, u − g/2), u + g/2): play between the rod and what the sensor looks at.
//!
//! u tip, y sensor's end (m), g total width of the gap (m). See [`crate::Play`]. It begins at y = u + s g/2: s is 0 in the middle of
//! the gap, ±1 at its ends. Where the gap is taken up by and by, r of it (no unit), y is the mean of three plays, of widths (1 + r/2) g, g
//! and (1 − r/2) g: g stays what data tell best, and a small r tells of itself only by its square.
//! Beside g = 0 the output is proportional to g while the tip moves on by more than g between reversals; where it comes
//! to rest within the gap, y − u lies anywhere between −g/2 and g/2.
//! Assumption: no inertia and no force in the gap. Source: the play operator (Prandtl).

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::signal::Signal;
use crate::parameter::ParameterSpec;
use crate::{ModelError, Play};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    needs_time: false,
    summary: "play between rod and sensor",
    signature: "after each reversal the displacement stands still over a fixed width; size independent of amplitude and rate",
    source: "play operator",
    confused_with: &["friction", "parameter_k"],
    parameters: &[
        ParameterSpec::size("gap_m", "m", [0.0, 1e-3], 1e-8).by_ratio(),
        ParameterSpec::fixed("start", "", [-1.0, 1.0], 0.0).believed(0.5),
        ParameterSpec::fixed("roundness", "", [0.0, 1.0], 0.0).believed(0.5),
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Backlash {
    /// The second is all where the gap is taken up at once.
    plays: [Play; 3],
    /// s.
    start: f64,
    is_round: bool,
}

impl Signal for Backlash {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        let play = |share: f64| Play::new(0.5 * values[0] * (1.0 + share * values[2]));
        Ok(Backlash {
            plays: [play(0.5)?, play(0.0)?, play(-0.5)?],
            start: values[1],
            is_round: values[2] > 0.0,
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        for play in &mut self.plays {
            *play = play.resting_at(input + self.start * play.half_width());
        }
        self.output()
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        // The play would hold its output; here a failed simulation must show.
        if input.is_nan() {
            return input;
        }
        if !self.is_round {
            return self.plays[1].follow(input);
        }
        self.plays.iter_mut().for_each(|play| _ = play.follow(input));
        self.output()
    }
}

impl Backlash {
    fn output(&self) -> f64 {
        if self.is_round {
            self.plays.iter().map(Play::output).sum::<f64>() / 3.0
        } else {
            self.plays[1].output()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the width: after a reversal the output stands still over the whole gap, and from the middle over half of it.
    #[test]
    fn the_gap_is_the_width_of_the_standstill() {
        let mut backlash = Backlash::new(&[2e-6, 0.0, 0.0], 1e-4).unwrap();
        backlash.steady_state(0.0);
        assert_eq!(backlash.step(0.9e-6), 0.0);
        let top = backlash.step(10e-6);
        assert!((top - 9e-6).abs() < 1e-20);
        assert_eq!(backlash.step(8.1e-6), top);
        assert!((backlash.step(7.5e-6) - 8.5e-6).abs() < 1e-20);
    }

    /// Guards the mean of the plays: after a reversal they follow one after the other.
    #[test]
    fn a_round_gap_is_taken_up_by_and_by() {
        let mut backlash = Backlash::new(&[2e-6, 0.0, 0.5], 1e-4).unwrap();
        backlash.steady_state(0.0);
        let top = backlash.step(10e-6);
        assert!((top - 9e-6).abs() < 1e-20);
        assert_eq!(backlash.step(8.51e-6), top);
        assert!((backlash.step(8e-6) - (top - 0.5e-6 / 3.0)).abs() < 1e-20);
        assert!((backlash.step(5e-6) - 6e-6).abs() < 1e-20);
    }
}
