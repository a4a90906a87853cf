//! |dH/dt| ≤ R: the coil field cannot change faster than the supply voltage drives current through the coil.
//!
//! H coil field (A/m), R slew limit (A/(m s)). Between samples the command is a straight line: H runs after it at R, meets it, and follows it
//! as long as it is no steeper. Exact, with the turn where they meet.
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
        let (from, to, before) = (self.command_a_per_m, piece.to, self.field_a_per_m);
        self.command_a_per_m = to;
        let slope = (to - from) / piece.span;
        let most = self.most_per_tick_a_per_m;
        let gap = from - before;
        if (gap == 0.0 && slope.abs() <= most) || !slope.is_finite() {
            self.field_a_per_m = to;
            output.push(piece);
            return;
        }
        let closing = most - slope * 1.0_f64.copysign(gap);
        let meets = if gap == 0.0 { 0.0 } else { gap.abs() / closing };
        if closing <= 0.0 || meets >= piece.span {
            self.field_a_per_m = before + most.copysign(if gap == 0.0 { slope } else { gap }) * piece.span;
            output.push(Piece::straight(piece.span, before, self.field_a_per_m));
            return;
        }
        let (at, rest) = (from + slope * meets, piece.span - meets);
        self.field_a_per_m = if slope.abs() <= most {
            to
        } else {
            at + most.copysign(slope) * rest
        };
        if meets > 0.0 {
            output.push(Piece::straight(meets, before, at));
        }
        output.push(Piece::straight(rest, at, self.field_a_per_m));
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
        let turn = intersample.pieces()[0];
        assert!(
            (turn.to - 130.0).abs() < 1e-9 && (turn.span - 0.3).abs() < 1e-12,
            "{turn:?}"
        );
        assert_eq!(intersample.end(), 60.0);
    }
}
