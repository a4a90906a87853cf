//! Line by line: how far the way is from straight. On a line the reference is straight in time, so the error is fitted by
//! e = offset + slope·t, and what is left at most is the nonlinearity.

use super::instant::Instant;
use crate::any_number;
use crate::any_number::exceeds;
use anhyst_controller::Scan;
use anhyst_scenario::Expect;
use serde::{Deserialize, Serialize};

/// What came of the lines. Turns, and ways back that are of no use, are in none of it but the last.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LinesVerdict {
    /// Lines that were seen from end to end.
    pub lines: u64,
    /// Length of a line.
    pub length_m: f64,
    /// Largest distance from the straight line that fits a line best.
    #[serde(with = "any_number")]
    pub nonlinearity_m: f64,
    /// Largest error of the line's middle.
    #[serde(with = "any_number")]
    pub offset_m: f64,
    /// Largest error of a line's speed, as a share of it.
    #[serde(with = "any_number")]
    pub speed_error: f64,
    /// Largest error in turns and on ways back, which is not judged.
    #[serde(with = "any_number")]
    pub turn_error_max_m: f64,
}

/// A line's points that are kept; of a longer one every second, third, ….
const MOST_POINTS: usize = 65_536;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct LinesJudge {
    tick_s: f64,
    line_s: f64,
    /// Which points of a line are kept.
    stride: u64,
    number: Option<u64>,
    /// Seen from its beginning on.
    whole: bool,
    seen: u64,
    /// Time since the line's beginning (s), error (m).
    points: Vec<(f64, f64)>,
    verdict: LinesVerdict,
}

impl LinesJudge {
    pub fn new(scan: &Scan, tick_s: f64) -> Self {
        let points = (scan.line_s() / tick_s) as usize + 2;
        let stride = points.div_ceil(MOST_POINTS);
        Self {
            tick_s,
            stride: stride as u64,
            number: None,
            whole: false,
            seen: 0,
            points: Vec::with_capacity(points / stride + 1),
            line_s: scan.line_s(),
            verdict: LinesVerdict {
                length_m: scan.line_m(),
                ..LinesVerdict::default()
            },
        }
    }

    pub fn observe(&mut self, scan: &Scan, now: Instant) {
        let error_m = now.reference_m - now.displacement_m;
        let line = scan.line(now.time_s);
        if line.map(|line| line.number) != self.number {
            self.finish();
            self.number = line.map(|line| line.number);
            self.whole = line.is_some_and(|line| line.since_s < 1.001 * self.tick_s);
        }
        let Some(line) = line else {
            if exceeds(error_m.abs(), self.verdict.turn_error_max_m) {
                self.verdict.turn_error_max_m = error_m.abs();
            }
            return;
        };
        if self.seen.is_multiple_of(self.stride) {
            self.points.push((line.since_s, error_m));
        }
        self.seen += 1;
    }

    /// The line has come to its end.
    fn finish(&mut self) {
        let fit = Fit::of(&self.points).filter(|_| self.whole);
        if let Some(fit) = fit {
            let own = &mut self.verdict;
            let speed_error = fit.slope_m_per_s * self.line_s / own.length_m;
            own.lines += 1;
            let worst = |worst: &mut f64, value: f64| {
                if exceeds(value.abs(), *worst) {
                    *worst = value.abs();
                }
            };
            worst(&mut own.nonlinearity_m, fit.left_m);
            worst(&mut own.offset_m, fit.offset_m);
            worst(&mut own.speed_error, speed_error);
        }
        self.points.clear();
        (self.seen, self.whole) = (0, false);
    }

    pub fn verdict(&self) -> LinesVerdict {
        self.verdict
    }
}

/// The straight line through points that fits best, and what is left of them at most.
struct Fit {
    offset_m: f64,
    slope_m_per_s: f64,
    left_m: f64,
}

impl Fit {
    fn of(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let count = points.len() as f64;
        let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(time_s, own)| of(time_s, own)).sum::<f64>();
        let (middle_s, offset_m) = (sum(&|time_s, _| time_s) / count, sum(&|_, own| own) / count);
        let along = sum(&|time_s, _| (time_s - middle_s) * (time_s - middle_s));
        let slope_m_per_s = sum(&|time_s, own| (time_s - middle_s) * (own - offset_m)) / along;
        let left_m = points.iter().fold(0.0, |most: f64, &(time_s, own)| {
            let left_m = (own - offset_m - slope_m_per_s * (time_s - middle_s)).abs();
            if exceeds(left_m, most) { left_m } else { most }
        });
        Some(Self {
            offset_m,
            slope_m_per_s,
            left_m,
        })
    }
}

impl LinesVerdict {
    /// As a share of the line.
    pub fn nonlinearity(&self) -> f64 {
        self.nonlinearity_m / self.length_m
    }

    pub(super) fn refuse(&self, expect: &Expect, failures: &mut Vec<String>) {
        if self.lines == 0 {
            failures.push("not one line was seen from end to end after the settling time".to_owned());
        } else if let Some(most) = expect.nonlinearity.filter(|most| exceeds(self.nonlinearity(), *most)) {
            failures.push(format!(
                "the lines are off from straight by {:.2e} of their length, more than {most:e}",
                self.nonlinearity()
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CourseJudge, CourseVerdict};
    use super::*;
    use anhyst_controller::{RasterSettings, Trajectory, TrajectorySettings};
    use std::f64::consts::PI;

    /// Guards the fit: y = 0.999·r + 3 nm + a bow of 5 nm, sin(π·part) less its own mean 2/π, has an offset of 3 nm, a speed error of 1e-3,
    /// and 2/π of the bow as nonlinearity; a wild turn is in none of them.
    #[test]
    fn a_bowed_line_has_its_offset_speed_and_bow() {
        let settings = TrajectorySettings::Raster(RasterSettings {
            mean_m: 0.0,
            length_m: 40e-6,
            line_s: 0.02,
            turn_s: 4e-3,
            back_s: Some(6e-3),
        });
        let tick_s = 1e-5;
        let trajectory = Trajectory::load(&settings, 0.0, tick_s, std::path::Path::new(".")).unwrap();
        let anhyst_controller::Course::Scan(scan) = trajectory.course() else {
            panic!("no scan")
        };
        let mut judge = CourseJudge::new(&trajectory, &Expect::NONE, tick_s).unwrap();
        for tick in 0..10_000 {
            let time_s = f64::from(tick) * tick_s;
            let reference_m = trajectory.at(time_s).position_m;
            let displacement_m = scan.line(time_s).map_or(reference_m - 1e-6, |line| {
                let bow = (PI * line.since_s / 0.02).sin() - 2.0 / PI;
                0.999 * reference_m - 3e-9 + 5e-9 * bow
            });
            judge.observe(
                &trajectory,
                Instant {
                    time_s,
                    reference_m,
                    displacement_m,
                },
            );
        }
        let CourseVerdict::Lines(own) = judge.verdict() else {
            panic!("no lines")
        };
        // Of 100 ms with 34 ms a period: the first line begins in its middle.
        assert_eq!(own.lines, 2, "{own:?}");
        for (found, expected) in [
            (own.length_m, 40e-6),
            (own.offset_m, 3e-9),
            (own.speed_error, 1e-3),
            (own.nonlinearity_m, 5e-9 * 2.0 / PI),
            (own.turn_error_max_m, 1e-6),
        ] {
            assert!(
                (found / expected - 1.0).abs() < 2e-3,
                "{found} against {expected}: {own:?}"
            );
        }
        let failures = |most: f64| {
            let expect = Expect {
                nonlinearity: Some(most),
                ..Expect::NONE
            };
            judge.verdict().failures(&expect, "m").len()
        };
        assert_eq!((failures(8.1e-5), failures(7.8e-5)), (0, 1));
    }
}
