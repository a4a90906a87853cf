//! τ dy/dt = x − y for a field that counts within the tick: exact, with the turning point and the mean.
//!
//! Over a piece of a tick as in `lag.rs`. Over any time ∫y = ∫x − τ(y_end − y_start), so a mean is exact, too. A mean excess of x,
//! 6s(1 − s) of mean 1 over the piece, adds 12θ − (1 − E)(6θ + 12θ²) to y at its end, θ = τ over the piece's length.
//! y turns round where it meets x: after t = −τ ln(rτ/(y_0 − x_0 + rτ)), r the slope of x.
//! Source: the variation of constants.

use serde::{Deserialize, Serialize};

use super::intersample_field::{IntersampleField, Piece};
use super::lag::ramp_weights;

/// How a piece of some length leads to the output at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Weights {
    /// Length of the piece in ticks.
    span: f64,
    output: f64,
    from: f64,
    to: f64,
    /// Of the piece's mean excess, its mean less that of its ends.
    mean_excess: f64,
}

impl Weights {
    /// `ticks` is τ/T.
    fn of(ticks: f64, span: f64) -> Self {
        let (decay, to) = ramp_weights(ticks, span);
        let theta = ticks / span;
        Weights {
            span,
            output: decay,
            from: 1.0 - decay - to,
            to,
            mean_excess: mean_excess_response(theta, 1.0, decay),
        }
    }
}

/// y after a part s of a piece with input 6s(1 − s), from 0; θ is τ over the piece, `decay` e^(−s/θ).
fn mean_excess_response(theta: f64, s: f64, decay: f64) -> f64 {
    if theta > 1e3 {
        // The difference below would keep no digits; this leaves out 1/θ of the answer.
        return s * s * (3.0 - 2.0 * s) / theta;
    }
    let b = 6.0 + 12.0 * theta;
    s * (b - 6.0 * s) - theta * b * (1.0 - decay)
}

/// A first-order lag of a field between samples, with its state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FieldLag {
    /// τ/T.
    ticks: f64,
    whole: Weights,
    /// Of the two lengths seen last, because a broken delay breaks every tick alike.
    parts: [Weights; 2],
    input: f64,
    output: f64,
}

impl FieldLag {
    pub fn new(time_constant_s: f64, tick_s: f64) -> Self {
        let ticks = time_constant_s / tick_s;
        FieldLag {
            ticks,
            whole: Weights::of(ticks, 1.0),
            parts: [Weights::default(); 2],
            input: 0.0,
            output: 0.0,
        }
    }

    pub fn steady_state(&mut self, input: f64) -> f64 {
        (self.input, self.output) = (input, input);
        input
    }

    #[inline]
    fn weights(&mut self, span: f64) -> Weights {
        if span == 1.0 {
            return self.whole;
        }
        if span != self.parts[0].span {
            self.parts.swap(0, 1);
            if span != self.parts[0].span {
                self.parts[0] = Weights::of(self.ticks, span);
            }
        }
        self.parts[0]
    }

    /// dy/dt, per tick.
    #[inline]
    pub fn rate(&self) -> f64 {
        (self.input - self.output) / self.ticks
    }

    #[inline]
    pub fn output(&self) -> f64 {
        self.output
    }

    /// τ in ticks.
    #[inline]
    pub fn ticks(&self) -> f64 {
        self.ticks
    }

    /// To the end of a piece, whose mean excess is given.
    #[inline]
    pub fn end(&mut self, piece: Piece, mean_excess: f64) {
        let weights = self.weights(piece.span);
        self.output = weights.output * self.output
            + weights.from * self.input
            + weights.to * piece.to
            + weights.mean_excess * mean_excess;
        self.input = piece.to;
    }

    /// One piece of the field, and the turning point within it.
    #[inline]
    pub fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let (input_from, output_from) = (self.input, self.output);
        let mean_excess = piece.mean - 0.5 * (input_from + piece.to);
        self.end(piece, mean_excess);
        let mean = |span: f64, input_mean: f64, from: f64, to: f64| Piece {
            span,
            to,
            mean: input_mean - self.ticks / span * (to - from),
        };
        if (input_from - output_from) * (piece.to - self.output) < 0.0 {
            let change = piece.to - input_from;
            let theta = self.ticks / piece.span;
            let decay = theta * change / (output_from - input_from + theta * change);
            let part = -theta * libm::log(decay);
            // Rounding may put it outside; then it is no more than a rounding away from an end.
            if part > 0.0 && part < 1.0 {
                // The input's mean excess counts, too; it moves the time, but at an extreme that does not matter.
                let turn = input_from + part * (change + mean_excess * mean_excess_response(theta, part, decay) / part);
                let begun = input_from + part * (0.5 * change + mean_excess * (3.0 - 2.0 * part));
                let time = piece.span * part;
                output.push(mean(time, begun, output_from, turn));
                let ended = (piece.mean - part * begun) / (1.0 - part);
                output.push(mean(piece.span - time, ended, turn, self.output));
                return;
            }
        }
        output.push(mean(piece.span, piece.mean, output_from, self.output));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::lag::Lag;

    /// Guards the hysteresis behind a lag: on a triangle the turning point lies where output meets input, and pieces of
    /// a tick lead to the same end as the whole.
    #[test]
    fn the_turning_point_is_found() {
        let mut lag = FieldLag::new(2e-4, 1e-4);
        lag.steady_state(0.0);
        for k in 1..10 {
            lag.follow(
                Piece::straight(1.0, f64::from(k - 1), f64::from(k)),
                &mut IntersampleField::empty(),
            );
        }
        let mut intersample = IntersampleField::empty();
        for k in 1..10 {
            let to = 9.0 - f64::from(k);
            intersample.clear();
            let whole_from = lag;
            lag.follow(Piece::straight(1.0, to + 1.0, to), &mut intersample);
            let [turn, end] = intersample.pieces() else {
                assert_eq!(intersample.pieces().len(), 1);
                continue;
            };
            let mut broken = whole_from;
            assert!((turn.to - (to + 1.0 - turn.span)).abs() < 1e-12, "output meets input");
            assert!(turn.to > end.to && (turn.span + end.span - 1.0).abs() < 1e-15);
            let mut pieces = IntersampleField::empty();
            for span in [0.3, 0.7] {
                let from = broken.input;
                broken.follow(Piece::straight(span, from, from - span), &mut pieces);
            }
            assert!((pieces.end() - end.to).abs() < 1e-13);
            return;
        }
        panic!("it never turned");
    }

    /// Guards the mean and the mean excess against a lag stepped a thousand times finer: two lags in series.
    #[test]
    fn two_lags_in_series_agree_with_fine_steps() {
        let parts = 1000;
        let (mut first, mut second) = (FieldLag::new(1.5e-4, 1e-4), FieldLag::new(0.8e-4, 1e-4));
        let (mut fine_first, mut fine_second) = (Lag::new(1.5e-1, 1e-4), Lag::new(0.8e-1, 1e-4));
        let (mut from, mut output) = (0.0, 0.0);
        for k in 1..60 {
            let to = libm::sin(0.15 * f64::from(k));
            let (mut between, mut end) = (IntersampleField::empty(), IntersampleField::empty());
            first.follow(Piece::straight(1.0, from, to), &mut between);
            for piece in between.pieces() {
                second.follow(*piece, &mut end);
            }
            let mut mean = 0.0;
            for part in 1..=parts {
                let before = output;
                let input = from + (to - from) * f64::from(part) / f64::from(parts);
                output = fine_second.step(fine_first.step(input));
                mean += 0.5 * (before + output) / f64::from(parts);
            }
            let own_mean: f64 = end.pieces().iter().map(|piece| piece.span * piece.mean).sum();
            assert!((end.end() - output).abs() < 2e-4, "tick {k}: {} {output}", end.end());
            assert!((own_mean - mean).abs() < 2e-4, "tick {k}: {own_mean} {mean}");
            from = to;
        }
    }
}
