//! The runs of a sweep by what varies: how far errors spread over seeds, and over what else varies.

use crate::plan::Plan;
use crate::row::Row;

/// Least, mean and largest of what is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    low: f64,
    high: f64,
    sum: f64,
    count: u64,
}

impl Spread {
    const NOTHING: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        sum: 0.0,
        count: 0,
    };

    fn push(&mut self, value: f64) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
            self.sum += value;
            self.count += 1;
        }
    }

    /// The three of them; none where there is nothing.
    pub fn told(&self) -> Option<[f64; 3]> {
        (self.count > 0).then(|| [self.low, self.sum / self.count as f64, self.high])
    }
}

/// Runs that have the same values of some variations.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Of each of those variations the place of the value in its list.
    pub places: Vec<usize>,
    /// Runs.
    pub runs: u64,
    /// Those that held.
    pub held: u64,
    /// Of the error's rms, m.
    pub error_rms_m: Spread,
    /// Of the largest error, m.
    pub error_max_m: Spread,
}

impl Point {
    /// Counts a run in.
    pub fn push(&mut self, row: &Row) {
        self.runs += 1;
        self.held += u64::from(row.held);
        self.error_rms_m.push(row.error_rms_m);
        self.error_max_m.push(row.error_max_m);
    }
}

/// The points of some variations, the last of them changing fastest.
#[derive(Debug)]
pub struct Points {
    /// Which variations, by their number.
    pub over: Vec<usize>,
    counts: Vec<usize>,
    /// All points.
    pub all: Vec<Point>,
}

impl Points {
    /// Of these variations, by their number.
    pub fn new(plan: &Plan, over: Vec<usize>) -> Self {
        let counts: Vec<usize> = over.iter().map(|own| plan.variations()[*own].values.len()).collect();
        let size = counts.iter().product();
        let places = |mut index: usize| {
            let mut places: Vec<usize> = counts
                .iter()
                .rev()
                .map(|count| {
                    let place = index % count;
                    index /= count;
                    place
                })
                .collect();
            places.reverse();
            places
        };
        let point = |index| Point {
            places: places(index),
            runs: 0,
            held: 0,
            error_rms_m: Spread::NOTHING,
            error_max_m: Spread::NOTHING,
        };
        let all = (0..size).map(point).collect();
        Self { over, counts, all }
    }

    /// Counts a run in.
    pub fn push(&mut self, plan: &Plan, row: &Row) {
        let places = plan.places(row.index);
        let own = self.over.iter().zip(&self.counts);
        let index = own.fold(0, |index, (own, count)| index * count + places[*own]);
        self.all[index].push(row);
    }

    /// One point with all runs.
    pub fn whole(point: &Point) -> Self {
        Self {
            over: Vec::new(),
            counts: Vec::new(),
            all: vec![point.clone()],
        }
    }
}
