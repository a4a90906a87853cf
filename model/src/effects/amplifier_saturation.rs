//! H = limit(u, ±L): the amplifier gives no more current than it has, with an edge unless told otherwise (`limit.rs`).
//!
//! u command, H coil field, L limit (A/m). Assumption: symmetric, without recovery time.
//! Source: supply current of power amplifiers, 10-30 A.

use serde::{Deserialize, Serialize};

use super::description::{Description, Stage};
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use super::limit::{Limit, SHARPNESS};
use crate::ModelError;
use crate::parameter::{ParameterSpec, Signal};

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Amplifier,
    needs_time: false,
    differentiable: false,
    summary: "the coil field is clipped at a limit",
    signature: "no gap below a threshold of the command, flat tops in the measured field, odd harmonics",
    source: "supply current of power amplifiers, 10-30 A",
    confused_with: &["sensor_saturation", "parameter_Ms"],
    parameters: &[
        ParameterSpec::limit("field_limit_a_per_m", "A/m", [1.0, 1e6], 1e4, Signal::Drive),
        SHARPNESS,
    ],
    ..Description::USUAL
};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AmplifierSaturation {
    limit: Limit,
    command_a_per_m: f64,
}

impl AmplifierSaturation {
    pub fn new(limit: Limit) -> Self {
        AmplifierSaturation {
            limit,
            command_a_per_m: 0.0,
        }
    }
}

impl FieldEffect for AmplifierSaturation {
    fn new(values: &[f64], _tick_s: f64) -> Result<Self, ModelError> {
        Ok(AmplifierSaturation::new(Limit::new(values[0], values[1])))
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.command_a_per_m = input;
        self.limit.of(input)
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let (from, to) = (self.command_a_per_m, piece.to);
        self.command_a_per_m = to;
        let (start, end) = (self.limit.of(from), self.limit.of(to));
        if start == from && end == to {
            output.push(piece);
            return;
        }
        if self.limit.is_round() {
            let middle = self.limit.of(0.5 * (from + to));
            output.push(Piece {
                to: end,
                // Simpson's rule.
                mean: (start + 4.0 * middle + end) / 6.0,
                ..piece
            });
            return;
        }
        let mut rest = piece.span;
        if start != end {
            // The piece crosses a limit, or both: the field moves only between them.
            let before = piece.span * (start - from) / (to - from);
            let within = piece.span * (end - start) / (to - from);
            if before > 0.0 {
                output.push(Piece::straight(before, start, start));
            }
            output.push(Piece::straight(within, start, end));
            rest = piece.span - before - within;
            if rest <= 0.0 {
                return;
            }
        }
        output.push(Piece::straight(rest, end, end));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the clip on both sides and that it leaves the rest alone.
    #[test]
    fn only_what_is_beyond_is_clipped() {
        let mut saturation = AmplifierSaturation::new(Limit::clip(100.0));
        saturation.steady_state(0.0);
        let mut from = 0.0;
        let mut follow = |to: f64| {
            let mut intersample = IntersampleField::empty();
            saturation.follow(Piece::straight(1.0, from, to), &mut intersample);
            from = to;
            let pieces = intersample.pieces().iter();
            pieces.map(|piece| (piece.span, piece.to)).collect::<Vec<_>>()
        };
        assert_eq!(follow(80.0), [(1.0, 80.0)]);
        assert_eq!(follow(120.0), [(0.5, 100.0), (0.5, 100.0)]);
        assert_eq!(follow(300.0), [(1.0, 100.0)]);
        assert_eq!(follow(-100.0), [(0.5, 100.0), (0.5, -100.0)]);
        assert_eq!(follow(-80.0), [(1.0, -80.0)]);
    }
}
