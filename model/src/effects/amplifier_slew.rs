//! |dH/dt| ≤ R: the coil field cannot change faster than the supply voltage drives current through the coil.
//!
//! H coil field (A/m), R slew limit (A/(m s)). H follows the command u by at most R·T a tick.
//! Where the limit bites it acts in eighths of a tick, so a peak between samples is cut at most R·T/8 early.
//! Source: V/L of coil and supply, as a field.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::{ParameterSpec, Signal};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    differentiable: false,
    summary: "the coil field changes no faster than a limit",
    signature: "no gap below a threshold of the command's rate, triangular field; the gap depends on amplitude times frequency",
    source: "supply voltage over coil inductance",
    confused_with: &["amplifier_bandwidth", "loop_delay"],
    parameters: &[ParameterSpec::limit(
        "slew_limit_a_per_m_s",
        "A/(m s)",
        [10.0, 1e12],
        1e6,
        Signal::DriveRate,
    )],
    ..Description::USUAL
};

/// In how many parts of a tick the limit acts.
const PARTS: f64 = 8.0;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AmplifierSlew {
    most_per_tick_a_per_m: f64,
    command_a_per_m: f64,
    field_a_per_m: f64,
}

impl AmplifierSlew {
    pub fn of(slew_limit_a_per_m_s: f64, tick_s: f64) -> Self {
        AmplifierSlew {
            most_per_tick_a_per_m: slew_limit_a_per_m_s * tick_s,
            command_a_per_m: 0.0,
            field_a_per_m: 0.0,
        }
    }
}

impl FieldEffect for AmplifierSlew {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(AmplifierSlew::of(values[0], tick_s))
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        (self.command_a_per_m, self.field_a_per_m) = (input, input);
        input
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let (from, to) = (self.command_a_per_m, piece.to);
        self.command_a_per_m = to;
        let follows = self.field_a_per_m == from && (to - from).abs() <= self.most_per_tick_a_per_m * piece.span;
        if follows {
            self.field_a_per_m = to;
            output.push(piece);
            return;
        }
        let parts = libm::ceil(PARTS * piece.span);
        let most = self.most_per_tick_a_per_m * piece.span / parts;
        let mut part = 0.0;
        while part < parts {
            part += 1.0;
            let wanted = if part < parts {
                from + (to - from) * (part / parts)
            } else {
                to
            };
            let before = self.field_a_per_m;
            // Written so that a command that is not a number passes, and does not stop the program as `clamp` would.
            self.field_a_per_m = if wanted > before + most {
                before + most
            } else if wanted < before - most {
                before - most
            } else {
                wanted
            };
            output.push(Piece::straight(piece.span / parts, before, self.field_a_per_m));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the slope of what comes out: a step becomes a ramp of the limit and then arrives bit for bit.
    #[test]
    fn a_step_becomes_a_ramp() {
        let mut slew = AmplifierSlew::of(2e6, 1e-4);
        slew.steady_state(0.0);
        let mut from = 0.0;
        let mut follow = |to: f64| {
            let mut intersample = IntersampleField::empty();
            slew.follow(Piece::straight(1.0, from, to), &mut intersample);
            from = to;
            intersample
        };
        // Towards 1000 A/m the field is held back from the start, and arrives in the fifth tick.
        for k in 1..6 {
            assert!((follow(1000.0).end() - 200.0 * f64::from(k)).abs() < 1e-9);
        }
        assert_eq!(follow(1000.0).end(), 1000.0);
        assert_eq!(follow(900.0).pieces(), [Piece::straight(1.0, 1000.0, 900.0)]);
    }

    /// Guards the peak between samples: a field that is still rising meets a command that falls, and turns there.
    #[test]
    fn the_field_turns_where_it_meets_the_command() {
        let mut slew = AmplifierSlew::of(1e6, 1e-4);
        slew.steady_state(0.0);
        let mut intersample = IntersampleField::empty();
        slew.follow(Piece::straight(1.0, 0.0, 160.0), &mut intersample);
        intersample.clear();
        // From 100 against 160: they meet at 130, after 0.3 ticks, if the command falls by 100 a tick.
        slew.follow(Piece::straight(1.0, 160.0, 60.0), &mut intersample);
        intersample.keep_turns(100.0);
        assert!(
            (intersample.pieces()[0].to - 130.0).abs() <= 12.5,
            "{:?}",
            intersample.pieces()
        );
        assert_eq!(intersample.end(), 60.0);
    }
}
