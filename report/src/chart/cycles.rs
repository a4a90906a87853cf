//! Which rows of a long run show its loops: a few whole cycles instead of hundreds upon each other.

use super::{Curve, Role};

/// Reversals smaller than this share of the whole range start no cycle.
const MIN_SWING: f64 = 0.25;
/// Cycles that can be told apart when drawn upon each other.
const MAX_CYCLES: usize = 6;
/// Two points nearer than this share of the ranges are one.
const FINE: f64 = 1.0 / 600.0;

/// The cycles that are drawn, of one abscissa: all curves over it then show the same rows.
#[derive(Clone, Debug)]
pub struct Cycles<'a> {
    x: &'a [f64],
    shown: Vec<std::ops::Range<usize>>,
    /// Cycles there are.
    pub all: usize,
}

impl<'a> Cycles<'a> {
    /// Cycles run from crest to crest; the first is shown (what comes before its crest with it), the last, and some evenly
    /// between.
    pub fn of(x: &'a [f64]) -> Self {
        let crests = crests(x);
        let mut ends = vec![0];
        ends.extend(crests.iter().skip(1));
        ends.push(x.len());
        // What follows the last crest belongs to the last cycle.
        if ends.len() > 2 {
            ends.remove(ends.len() - 2);
        }
        let all = ends.len() - 1;
        let shown = all.min(MAX_CYCLES);
        let pick = |index: usize| if shown > 1 { index * (all - 1) / (shown - 1) } else { 0 };
        let shown = (0..shown).map(pick).map(|cycle| {
            // The row that ends a cycle closes it.
            ends[cycle]..(ends[cycle + 1] + 1).min(x.len())
        });
        Cycles {
            x,
            shown: shown.collect(),
            all,
        }
    }

    /// Cycles that are shown.
    pub fn shown(&self) -> usize {
        self.shown.len()
    }

    /// The cycles of a series, with a gap between those that do not follow each other.
    pub fn curve(&self, y: &[f64], role: Role) -> Curve {
        let mut points: Vec<[f64; 2]> = Vec::new();
        let (width, height) = (extent(self.x), extent(y));
        for rows in &self.shown {
            points.push([f64::NAN; 2]);
            let mut last = [f64::NAN; 2];
            let end = rows.end.min(y.len());
            let of_cycle = self.x.iter().zip(y).enumerate().take(end).skip(rows.start);
            for (row, (&x, &y)) in of_cycle {
                let point = [x, y];
                let near = ((point[0] - last[0]) / width).hypot((point[1] - last[1]) / height) < FINE;
                if !near || row + 1 == end {
                    points.push(point);
                    last = point;
                }
            }
        }
        Curve::new(points.into_iter().skip(1), role)
    }
}

fn extent(values: &[f64]) -> f64 {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    );
    if high > low { high - low } else { 1.0 }
}

/// Rows of the maxima between which the series falls by a good part of its range and rises again.
fn crests(x: &[f64]) -> Vec<usize> {
    let swing = MIN_SWING * extent(x);
    let (mut crests, mut rising) = (Vec::new(), true);
    let (mut best, mut at) = (f64::NEG_INFINITY, 0);
    for (row, &value) in x.iter().enumerate() {
        let signed = if rising { value } else { -value };
        if signed > best {
            (best, at) = (signed, row);
        } else if signed < best - swing {
            if rising {
                crests.push(at);
            }
            rising = !rising;
            (best, at) = (-signed, row);
        }
    }
    crests
}

#[cfg(test)]
mod tests {
    //! Guards loops that are no blob: whole cycles, few of them, none cut open.
    use super::*;

    #[test]
    fn few_whole_cycles_of_many_are_shown() {
        // 100 cycles of 400 rows, with a ripple that makes no cycle of its own.
        let x: Vec<f64> = (0..40_000)
            .map(|row| {
                let phase = f64::from(row) * std::f64::consts::TAU / 400.0;
                8e3 * phase.sin() + 200.0 * (17.0 * phase).sin()
            })
            .collect();
        let cycles = Cycles::of(&x);
        assert_eq!((cycles.all, cycles.shown()), (99, MAX_CYCLES));
        assert_eq!(cycles.shown[0].start, 0);
        assert_eq!(cycles.shown[MAX_CYCLES - 1].end, x.len());
        for rows in &cycles.shown[1..MAX_CYCLES - 1] {
            assert_eq!(rows.len(), 401, "{rows:?}");
        }
        let y: Vec<f64> = x.iter().map(|x| 1e-9 * x).collect();
        let curve = cycles.curve(&y, Role::Measured);
        let gaps = curve.points.iter().filter(|point| point[0].is_nan()).count();
        assert_eq!(gaps, MAX_CYCLES - 1);
        assert!(curve.points.len() < 400 * (MAX_CYCLES + 2), "{}", curve.points.len());
    }

    #[test]
    fn a_sweep_without_cycles_is_shown_whole() {
        for x in [vec![], vec![1.0], (0..50).map(f64::from).collect::<Vec<_>>()] {
            let cycles = Cycles::of(&x);
            assert_eq!(cycles.all, 1);
            assert_eq!(cycles.curve(&x, Role::Measured).points.len(), x.len());
        }
    }
}
