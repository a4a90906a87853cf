//! H(t) within a tick: a polyline, so that turning points between samples reach the hysteresis.
//!
//! A lag, a broken delay or a slew limit turns the field round between samples; a rate-independent model remembers that
//! extreme, and 30 A/m of it, missed, is some 100 nm. So effects on the field take and give fields between samples: pieces that last
//! a part of the tick, end at a value and have a mean, because within a piece the field may be curved, too.
//! Commands and coil fields begin as one straight piece a tick.

use crate::ModelError;

/// Pieces that a tick can hold; more are joined to the last.
const MAX_PIECES: usize = 16;

/// A piece of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Piece {
    /// Part of the tick that it lasts.
    pub span: f64,
    /// Field at its end, A/m.
    pub to: f64,
    /// Mean field over it, A/m.
    pub mean: f64,
}

impl Piece {
    /// A straight line.
    #[inline]
    pub fn straight(span: f64, from: f64, to: f64) -> Self {
        Piece {
            span,
            to,
            mean: 0.5 * (from + to),
        }
    }
}

/// The field over one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntersampleField {
    pieces: [Piece; MAX_PIECES],
    length: usize,
}

impl IntersampleField {
    pub fn empty() -> Self {
        IntersampleField {
            pieces: [Piece::default(); MAX_PIECES],
            length: 0,
        }
    }

    /// One straight piece over the whole tick.
    #[inline]
    pub fn set_straight(&mut self, from: f64, to: f64) {
        self.length = 1;
        self.pieces[0] = Piece::straight(1.0, from, to);
    }

    #[inline]
    pub fn clear(&mut self) {
        self.length = 0;
    }

    #[inline]
    pub fn push(&mut self, piece: Piece) {
        if self.length < MAX_PIECES {
            self.pieces[self.length] = piece;
            self.length += 1;
        } else {
            let last = &mut self.pieces[MAX_PIECES - 1];
            *last = joined(*last, piece);
        }
    }

    /// Becomes the same as another.
    #[inline]
    pub fn take(&mut self, other: &IntersampleField) {
        self.length = other.length;
        // Of most ticks it is one, which needs no call.
        self.pieces[0] = other.pieces[0];
        if self.length > 1 {
            self.pieces[..other.length].copy_from_slice(other.pieces());
        }
    }

    pub fn pieces(&self) -> &[Piece] {
        &self.pieces[..self.length]
    }

    /// Field at the end of the tick, A/m.
    pub fn end(&self) -> f64 {
        self.pieces().last().map_or(0.0, |piece| piece.to)
    }

    /// Joins pieces until each end but the last is a turning point: all that a rate-independent model stops at.
    #[inline]
    pub fn keep_turns(&mut self, from: f64) {
        if self.length <= 1 {
            return;
        }
        let (mut kept, mut before) = (0, from);
        let mut piece = self.pieces[0];
        for index in 1..self.length {
            let next = self.pieces[index];
            if (next.to - piece.to) * (piece.to - before) < 0.0 {
                self.pieces[kept] = piece;
                kept += 1;
                (before, piece) = (piece.to, next);
            } else {
                piece = joined(piece, next);
            }
        }
        self.pieces[kept] = piece;
        self.length = kept + 1;
    }
}

fn joined(first: Piece, second: Piece) -> Piece {
    let span = first.span + second.span;
    Piece {
        span,
        to: second.to,
        mean: (first.span * first.mean + second.span * second.mean) / span,
    }
}

/// An effect that takes one field and gives another.
pub(crate) trait FieldEffect: Sized {
    /// From the effect's values and the tick; an infinite tick is a sweep too slow for any memory of time.
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError>;

    /// Takes the run's first sample as having stood there for ever.
    fn steady_state(&mut self, input: f64) -> f64;

    /// Takes one piece and adds what becomes of it.
    fn follow(&mut self, piece: Piece, output: &mut IntersampleField);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polyline(points: &[(f64, f64)]) -> IntersampleField {
        let (mut intersample, mut from) = (IntersampleField::empty(), 0.0);
        for &(span, to) in points {
            intersample.push(Piece::straight(span, from, to));
            from = to;
        }
        intersample
    }

    /// Guards the hysteresis against needless and against missing stops: a monotone tick is one piece again, and each
    /// extreme stays with its time; the mean over the tick is kept.
    #[test]
    fn only_turning_points_stay() {
        let mut intersample = polyline(&[(0.25, 1.0), (0.25, 3.0), (0.125, 2.0), (0.125, 2.0), (0.25, 5.0)]);
        let mean = |intersample: &IntersampleField| -> f64 {
            intersample.pieces().iter().map(|piece| piece.span * piece.mean).sum()
        };
        let before = mean(&intersample);
        intersample.keep_turns(0.0);
        // A plateau does not hide the turn that follows it.
        let kept: Vec<(f64, f64)> = intersample
            .pieces()
            .iter()
            .map(|piece| (piece.span, piece.to))
            .collect();
        assert_eq!(kept, [(0.5, 3.0), (0.25, 2.0), (0.25, 5.0)]);
        assert!((mean(&intersample) - before).abs() < 1e-15);
    }

    /// Guards the bound of a tick: what is too much is joined to the last piece, and time and end are kept.
    #[test]
    fn a_full_tick_keeps_time_and_end() {
        let intersample = polyline(&(0..40).map(|index| (0.025, f64::from(index))).collect::<Vec<_>>());
        let span: f64 = intersample.pieces().iter().map(|piece| piece.span).sum();
        assert!((span - 1.0).abs() < 1e-12);
        assert_eq!(intersample.end(), 39.0);
    }
}
