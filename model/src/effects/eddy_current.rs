//! τ dH_in/dt = H − H_in: eddy currents delay the field inside the material behind that in the coil.
//!
//! H coil field, H_in field in the material (A/m), τ diffusion time of the first mode (s), about μ₀μ_r D²/(23 ρ):
//! 73 μs for a solid Terfenol-D rod of 12.7 mm. Propagated exactly, see `field_lag.rs`.
//! A share d of it (no unit) diffuses by all modes of a round rod, with τ their mean lag: the mean field over the section is
//! Σ (4/x²) H_x, 8τ/x² dH_x/dt = H − H_x, x the zeros of J₀ (H_x = H beyond the fourth).
//! Assumption: constant permeability. Source: magnetic diffusion in a cylinder.

use serde::{Deserialize, Serialize};

use super::description::{CoilNeed, Description, Stage};
use super::field_lag::FieldLag;
use super::intersample_field::{FieldEffect, IntersampleField, Piece};
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Field,
    coil: CoilNeed::Always,
    summary: "eddy currents make the field in the material lag behind the coil's",
    signature: "measured field clean, magnetization and displacement lag; loops widen with frequency, gap proportional to rate",
    source: "magnetic diffusion in a cylinder, first mode",
    confused_with: &["amplifier_bandwidth", "loop_delay", "sensor_delay", "excess_loss"],
    parameters: &[
        ParameterSpec::size("time_constant_s", "s", [0.0, 0.02], 1e-6).by_ratio(),
        ParameterSpec::fixed("diffusion", "", [0.0, 1.0], 0.0),
    ],
    ..Description::USUAL
};

/// Squares of the first zeros of J₀.
const SQUARES: [f64; 4] = [
    5.783_185_962_946_785,
    30.471_262_343_662_087,
    74.887_006_790_695_18,
    139.040_284_426_459_83,
];
/// Secants in which a turning point is sought.
const SECANTS: usize = 2;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum EddyCurrent {
    Lag(FieldLag),
    Diffusion(Box<Diffusion>),
}

impl FieldEffect for EddyCurrent {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        Ok(if values[1] > 0.0 {
            EddyCurrent::Diffusion(Box::new(Diffusion::new(values[0], values[1], tick_s)))
        } else {
            EddyCurrent::Lag(FieldLag::new(values[0], tick_s))
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        match self {
            EddyCurrent::Lag(lag) => lag.steady_state(input),
            EddyCurrent::Diffusion(lags) => lags.steady_state(input),
        }
    }

    #[inline]
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        match self {
            EddyCurrent::Lag(lag) => lag.follow(piece, output),
            EddyCurrent::Diffusion(lags) => lags.follow(piece, output),
        }
    }
}

/// Lags side by side, and what follows at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Diffusion {
    lags: [FieldLag; SQUARES.len() + 1],
    weights: [f64; SQUARES.len() + 1],
    at_once: f64,
    input: f64,
}

impl Diffusion {
    fn new(time_constant_s: f64, share: f64, tick_s: f64) -> Self {
        let mut lags = [FieldLag::new(time_constant_s, tick_s); SQUARES.len() + 1];
        let mut weights = [1.0 - share; SQUARES.len() + 1];
        for (place, square) in (1..).zip(SQUARES) {
            lags[place] = FieldLag::new(8.0 * time_constant_s / square, tick_s);
            weights[place] = 4.0 * share / square;
        }
        Diffusion {
            lags,
            weights,
            at_once: 1.0 - weights.iter().sum::<f64>(),
            input: 0.0,
        }
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.lags.iter_mut().for_each(|lag| _ = lag.steady_state(input));
        self.input = input;
        input
    }

    /// Sum over the lags of something, by their weights.
    fn sum(&self, of: impl Fn(&FieldLag) -> f64) -> f64 {
        self.lags
            .iter()
            .zip(&self.weights)
            .map(|(lag, weight)| weight * of(lag))
            .sum()
    }

    fn output(&self) -> f64 {
        self.sum(FieldLag::output) + self.at_once * self.input
    }

    fn end(mut self, piece: Piece) -> Self {
        let excess = piece.mean - 0.5 * (self.input + piece.to);
        self.lags.iter_mut().for_each(|lag| lag.end(piece, excess));
        self.input = piece.to;
        self
    }

    fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let begin = *self;
        *self = begin.end(piece);
        let change = piece.to - begin.input;
        let excess = piece.mean - begin.input - 0.5 * change;
        // The field is a parabola over the piece.
        let begun = |part: f64| Piece {
            span: part * piece.span,
            to: begin.input + part * (change + 6.0 * excess * (1.0 - part)),
            mean: begin.input + part * (0.5 * change + excess * (3.0 - 2.0 * part)),
        };
        let rate = |lags: &Diffusion, part: f64| {
            let slope = (change + 6.0 * excess * (1.0 - 2.0 * part)) / piece.span;
            lags.sum(FieldLag::rate) + lags.at_once * slope
        };
        let answered = |lags: &Diffusion| lags.sum(|lag| lag.ticks() * lag.output());
        let (mut before, mut behind) = ((0.0, rate(&begin, 0.0)), (1.0, rate(self, 1.0)));
        if before.1 * behind.1 < 0.0 {
            let (mut turn, mut part) = (begin, 0.0);
            for _ in 0..SECANTS {
                part = before.0 + (behind.0 - before.0) * before.1 / (before.1 - behind.1);
                turn = begin.end(begun(part));
                let own = (part, rate(&turn, part));
                *(if own.1 * before.1 > 0.0 {
                    &mut before
                } else {
                    &mut behind
                }) = own;
            }
            if part > 0.0 && part < 1.0 {
                let first = begun(part);
                let second_span = piece.span - first.span;
                output.push(Piece {
                    to: turn.output(),
                    mean: first.mean - (answered(&turn) - answered(&begin)) / first.span,
                    ..first
                });
                let rest = (piece.mean - part * first.mean) / (1.0 - part);
                output.push(Piece {
                    span: second_span,
                    to: self.output(),
                    mean: rest - (answered(self) - answered(&turn)) / second_span,
                });
                return;
            }
        }
        output.push(Piece {
            to: self.output(),
            mean: piece.mean - (answered(self) - answered(&begin)) / piece.span,
            ..piece
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards diffusion against a rod of shells: the mean field over the section of a solid cylinder, by finite volumes, with its mean over
    /// the tick and its turning points.
    #[test]
    fn it_agrees_with_a_cylinder_of_shells() {
        const SHELLS: usize = 60;
        const STEPS: usize = 6000;
        let mut eddy = EddyCurrent::new(&[1.5e-4, 1.0], 1e-4).unwrap();
        // τ = R²/(8D): ∂H/∂t = D (1/r) ∂(r ∂H/∂r)/∂r with R = 1, time in ticks.
        let (diffusivity, width) = (1.0 / (8.0 * 1.5), 1.0 / SHELLS as f64);
        let mut shells = [0.0; SHELLS];
        let mean = |shells: &[f64; SHELLS]| -> f64 {
            let rings = shells.iter().enumerate();
            rings
                .map(|(place, own)| (2 * place + 1) as f64 * width * width * own)
                .sum()
        };
        let (mut from, mut turns) = (0.0, 0);
        for k in 1..40 {
            let to = 1e3 * libm::sin(0.5 * f64::from(k));
            let mut own = IntersampleField::empty();
            eddy.follow(Piece::straight(1.0, from, to), &mut own);
            let (mut held, mut extreme) = (0.0, f64::NEG_INFINITY);
            let sign = if mean(&shells) > 0.0 { 1.0 } else { -1.0 };
            let begin = sign * mean(&shells);
            for step in 0..STEPS {
                let outside = from + (to - from) * (step as f64 + 0.5) / STEPS as f64;
                let before = shells;
                for place in 0..SHELLS {
                    let inner = if place == 0 {
                        0.0
                    } else {
                        place as f64 * (before[place - 1] - before[place])
                    };
                    let outer = if place + 1 == SHELLS {
                        2.0 * SHELLS as f64 * (outside - before[place])
                    } else {
                        (place + 1) as f64 * (before[place + 1] - before[place])
                    };
                    let area = (2 * place + 1) as f64;
                    shells[place] += 2.0 * diffusivity / (width * width) * (inner + outer) / area / STEPS as f64;
                }
                held += mean(&shells) / STEPS as f64;
                extreme = extreme.max(sign * mean(&shells));
            }
            let own_mean: f64 = own.pieces().iter().map(|piece| piece.span * piece.mean).sum();
            assert!(
                (own.end() - mean(&shells)).abs() < 2.0,
                "tick {k}: {} {}",
                own.end(),
                mean(&shells)
            );
            assert!((own_mean - held).abs() < 2.0, "tick {k}: {own_mean} {held}");
            if extreme > begin.max(sign * mean(&shells)) + 1.0 {
                turns += 1;
                assert!((sign * own.pieces()[0].to - extreme).abs() < 2.0, "tick {k}");
            }
            from = to;
        }
        assert!(turns > 3, "{turns}");
    }
}
