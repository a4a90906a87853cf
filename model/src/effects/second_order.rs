//! q τ² d²y/dt² + τ dy/dt = x − y for a field that counts within the tick: exact, with the turning point and the mean.
//!
//! Damping ratio 1/(2√q). Beside a straight line and a mean excess, 6s(1 − s) of mean 1 over a piece, x is a polynomial, so y is one and
//! what is left of the begin dies out as e^(−σt)(C + …), S = sinh(μt)/μ, σ = 1/(2qτ), μ² = σ² − 1/(qτ²), or sine for sinh.
//! Over any time ∫y = ∫x − τ Δy − qτ² Δ(dy/dt). y turns round where dy/dt is 0. Source: the variation of constants.

use serde::{Deserialize, Serialize};

use super::intersample_field::{IntersampleField, Piece};

/// Halvings of the time in which a turning point is sought.
const HALVINGS: usize = 30;

/// With less inertia, in squares of ticks, it is a lag of first order to more digits than there are.
const LEAST_INERTIA: f64 = 1e-15;

/// What is left of a state after a time: y + σ y' of it by `cosine`, the rest by `sine`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Left {
    /// In ticks.
    time: f64,
    cosine: f64,
    sine: f64,
}

/// A lag of second order of a field between samples, with its state. Times are in ticks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SecondOrderLag {
    /// τ.
    lag: f64,
    /// qτ².
    inertia: f64,
    whole: Left,
    input: f64,
    output: f64,
    /// dy/dt.
    rate: f64,
}

/// x over a piece, and what y follows of it: value, slope and half the second derivative at its begin.
struct Course {
    input: [f64; 3],
    followed: [f64; 3],
}

fn at([value, slope, curve]: [f64; 3], time: f64) -> f64 {
    value + time * (slope + time * curve)
}

impl SecondOrderLag {
    /// `share` is q; none where the lag is of first order.
    pub fn new(time_constant_s: f64, share: f64, tick_s: f64) -> Option<Self> {
        let lag = time_constant_s / tick_s;
        let inertia = share * lag * lag;
        if inertia < LEAST_INERTIA {
            return None;
        }
        let mut own = SecondOrderLag {
            lag,
            inertia,
            whole: Left::default(),
            input: 0.0,
            output: 0.0,
            rate: 0.0,
        };
        own.whole = own.left(1.0);
        Some(own)
    }

    pub fn steady_state(&mut self, input: f64) -> f64 {
        (self.input, self.output, self.rate) = (input, input, 0.0);
        input
    }

    fn left(&self, time: f64) -> Left {
        let sigma = 0.5 * self.lag / self.inertia;
        let square = sigma * sigma - 1.0 / self.inertia;
        let (cosine, sine) = if square * time * time > 1e-9 {
            let mu = libm::sqrt(square);
            let (slow, fast) = (
                libm::exp(-time / (self.inertia * (sigma + mu))),
                libm::exp(-time * (sigma + mu)),
            );
            (0.5 * (slow + fast), 0.5 * (slow - fast) / mu)
        } else {
            let decay = libm::exp(-sigma * time);
            if square * time * time < -1e-9 {
                let (sine, cosine) = libm::sincos(libm::sqrt(-square) * time);
                (decay * cosine, decay * sine / libm::sqrt(-square))
            } else {
                (decay, decay * time)
            }
        };
        Left { time, cosine, sine }
    }

    fn course(&self, piece: &Piece) -> Course {
        let excess = 6.0 * (piece.mean - 0.5 * (self.input + piece.to)) / piece.span;
        let input = [
            self.input,
            (piece.to - self.input) / piece.span + excess,
            -excess / piece.span,
        ];
        let slope = input[1] - 2.0 * self.lag * input[2];
        Course {
            input,
            followed: [
                input[0] - self.lag * slope - 2.0 * self.inertia * input[2],
                slope,
                input[2],
            ],
        }
    }

    /// y and dy/dt after a time.
    fn after(&self, course: &Course, left: Left) -> (f64, f64) {
        let sigma = 0.5 * self.lag / self.inertia;
        let [value, slope, curve] = course.followed;
        let (y, rate) = (self.output - value, self.rate - slope);
        (
            at(course.followed, left.time) + left.cosine * y + left.sine * (sigma * y + rate),
            slope + 2.0 * curve * left.time + left.cosine * rate - left.sine * (y / self.inertia + sigma * rate),
        )
    }

    /// One piece of the field, and the turning point within it.
    pub fn follow(&mut self, piece: Piece, output: &mut IntersampleField) {
        let course = self.course(&piece);
        let [value, slope, curve] = course.input;
        let begun = |time: f64| time * (value + time * (0.5 * slope + time * curve / 3.0));
        let left = if piece.span == 1.0 {
            self.whole
        } else {
            self.left(piece.span)
        };
        let (end, rate) = self.after(&course, left);
        let mut from = (0.0, self.output, self.rate);
        let mut push = |time: f64, to: f64, rate: f64| {
            let answered = self.lag * (to - from.1) + self.inertia * (rate - from.2);
            output.push(Piece {
                span: time - from.0,
                to,
                mean: (begun(time) - begun(from.0) - answered) / (time - from.0),
            });
            from = (time, to, rate);
        };
        if self.rate * rate < 0.0 {
            let (mut before, mut behind) = (0.0, piece.span);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (before + behind);
                if self.after(&course, self.left(middle)).1 * self.rate > 0.0 {
                    before = middle;
                } else {
                    behind = middle;
                }
            }
            if behind < piece.span {
                push(behind, self.after(&course, self.left(behind)).0, 0.0);
            }
        }
        push(piece.span, end, rate);
        (self.input, self.output, self.rate) = (piece.to, end, rate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::field_lag::FieldLag;

    /// Guards the law against steps twenty thousand times finer, aperiodic, at the limit and swinging, with its turning points and means; a tick in
    /// two pieces ends where the whole does.
    #[test]
    fn it_agrees_with_fine_steps() {
        for share in [0.1, 0.25, 0.51, 1.0] {
            let mut lag = SecondOrderLag::new(1.5e-4, share, 1e-4).unwrap();
            let (tau, fine) = (1.5, 20_000);
            let (mut y, mut v, mut from) = (0.0, 0.0, 0.0);
            let mut turns = 0;
            for k in 1..60 {
                let to = 1e3 * libm::sin(0.4 * f64::from(k));
                let mut own = IntersampleField::empty();
                let mut broken = lag;
                lag.follow(Piece::straight(1.0, from, to), &mut own);
                let (mut mean, mut turned) = (0.0, None);
                let step = 1.0 / f64::from(fine);
                for part in 0..fine {
                    let input = from + (to - from) * (f64::from(part) + 0.5) * step;
                    // The midpoint rule.
                    let slope = |y: f64, v: f64| (input - y - tau * v) / (share * tau * tau);
                    let (half_y, half_v) = (y + 0.5 * step * v, v + 0.5 * step * slope(y, v));
                    let (next_y, next_v) = (y + step * half_v, v + step * slope(half_y, half_v));
                    mean += step * half_y;
                    if v * next_v < 0.0 {
                        turned = Some((f64::from(part) * step, y));
                    }
                    (y, v) = (next_y, next_v);
                }
                assert!((own.end() - y).abs() < 2e-4, "q {share}, tick {k}: {} {y}", own.end());
                let own_mean: f64 = own.pieces().iter().map(|piece| piece.span * piece.mean).sum();
                assert!((own_mean - mean).abs() < 2e-4, "q {share}, tick {k}: {own_mean} {mean}");
                if let Some((time, extreme)) = turned {
                    turns += 1;
                    let [turn, _] = own.pieces() else {
                        panic!("tick {k} does not turn")
                    };
                    assert!((turn.span - time).abs() < 1e-3 && (turn.to - extreme).abs() < 1e-3);
                }
                let mut pieces = IntersampleField::empty();
                broken.follow(Piece::straight(0.3, from, from + 0.3 * (to - from)), &mut pieces);
                broken.follow(Piece::straight(0.7, from + 0.3 * (to - from), to), &mut pieces);
                assert!((pieces.end() - own.end()).abs() < 1e-9);
                from = to;
            }
            assert!(turns > 3, "{turns}");
        }
    }

    /// Guards the edge to the lag of first order.
    #[test]
    fn with_little_inertia_it_is_a_lag() {
        let (mut second, mut first) = (
            SecondOrderLag::new(2e-4, 1e-7, 1e-4).unwrap(),
            FieldLag::new(2e-4, 1e-4),
        );
        let mut from = 0.0;
        for k in 1..40 {
            let to = libm::sin(0.3 * f64::from(k));
            let (mut one, mut other) = (IntersampleField::empty(), IntersampleField::empty());
            second.follow(Piece::straight(1.0, from, to), &mut one);
            first.follow(Piece::straight(1.0, from, to), &mut other);
            assert!((one.end() - other.end()).abs() < 1e-6, "tick {k}");
            from = to;
        }
        for (lag_s, share) in [(1e-200, 0.5), (1e-4, 1e-200), (1e-4, 0.0)] {
            assert!(SecondOrderLag::new(lag_s, share, 1e-4).is_none());
        }
    }
}
