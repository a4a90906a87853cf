//! H(t) = u(t − d): the command reaches the coil later.
//!
//! u command, H coil field (A/m), d delay (s), any fraction of a tick. u is a straight line between samples, so the
//! delayed field is exact, with a kink within the tick where a sample of the command arrives.
//! Assumption: the delay does not depend on the signal. Source: transport and computing delay of a sampled loop,
//! one or two samples on real rigs.

use serde::{Deserialize, Serialize};

use super::delay_line::DelayLine;
use super::description::{Description, Stage};
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    summary: "the command reaches the coil after a pure delay",
    signature: "phase −ωd at unit gain, the same in the measured field and in the displacement; gap proportional to rate",
    source: "transport and computing delay of sampled loops",
    confused_with: &["amplifier_bandwidth", "eddy_current", "sensor_delay"],
    parameters: &[ParameterSpec::size("delay_s", "s", [0.0, 0.05], 1e-6).by_ratio()],
    ..Description::USUAL
};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoopDelay {
    line: DelayLine,
    whole_ticks: usize,
    part: f64,
}

impl LoopDelay {
    pub fn of(delay_s: f64, tick_s: f64) -> Result<Self, ModelError> {
        let ticks = delay_s / tick_s;
        let line = DelayLine::new(ticks)?;
        let whole = libm::floor(ticks);
        Ok(LoopDelay {
            line,
            whole_ticks: whole as usize,
            part: ticks - whole,
        })
    }
}

impl FieldEffect for LoopDelay {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Self::of(values[0], tick_s)
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.line.fill(input);
        input
    }

    /// It stands first in the chain, where every piece is a whole tick.
    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        self.line.push(piece.to);
        let sample = |more: usize| self.line.sample(self.whole_ticks + more);
        let (later, earlier, earliest) = (sample(0), sample(1), sample(2));
        let part = self.part;
        if part > 0.0 {
            output.push(Piece::straight(part, earlier + part * (earliest - earlier), earlier));
        }
        output.push(Piece::straight(1.0 - part, earlier, later + part * (earlier - later)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the hysteresis behind the delay: a peak of the command comes out whole, between samples.
    #[test]
    fn a_peak_is_kept() {
        let mut delay = LoopDelay::of(1.25e-4, 1e-4).unwrap();
        delay.steady_state(0.0);
        let mut highest = 0.0_f64;
        let mut from = 0.0;
        for to in [1.0, 2.0, 3.0, 2.0, 1.0, 0.0, 0.0] {
            let mut intersample = IntersampleField::empty();
            delay.follow(Piece::straight(1.0, from, to), &mut intersample);
            from = to;
            let pieces = intersample.pieces();
            assert!((pieces.iter().map(|piece| piece.span).sum::<f64>() - 1.0).abs() < 1e-15);
            highest = pieces.iter().fold(highest, |highest, piece| highest.max(piece.to));
        }
        assert_eq!(highest, 3.0);
    }

    /// Guards the delay on a ramp, where linear interpolation has to be exact, for whole and broken numbers of ticks.
    #[test]
    fn a_ramp_comes_later_by_the_delay() {
        let tick_s = 1e-4;
        for delay_s in [0.0, 3.7e-5, 1e-4, 2.5e-4, 1.033e-3] {
            let mut delay = LoopDelay::of(delay_s, tick_s).unwrap();
            delay.steady_state(0.0);
            for k in 1..100 {
                let time_s = tick_s * f64::from(k);
                let mut intersample = IntersampleField::empty();
                delay.follow(Piece::straight(1.0, time_s - tick_s, time_s), &mut intersample);
                assert!(
                    (intersample.end() - (time_s - delay_s).max(0.0)).abs() < 1e-15,
                    "{delay_s} s, tick {k}"
                );
            }
        }
    }
}
