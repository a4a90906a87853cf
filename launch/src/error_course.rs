//! How the error of a run goes over time.

use crate::windows::{Gathered, Windows};
use serde::{Deserialize, Serialize};

/// Errors in windows.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ErrorCourse(Windows<Window>);

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Window {
    samples: u64,
    sum_of_squares_m2: f64,
    max_m: f64,
}

/// One window of an error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorWindow {
    /// Its middle.
    pub time_s: f64,
    pub rms_m: f64,
    pub max_m: f64,
}

impl ErrorCourse {
    /// Takes in the error of a tick; what is no finite number has no place in a picture.
    pub fn observe(&mut self, tick: u64, error_m: f64) {
        if error_m.is_finite() {
            self.0.add(
                tick,
                Window {
                    samples: 1,
                    sum_of_squares_m2: error_m * error_m,
                    max_m: error_m.abs(),
                },
            );
        }
    }

    /// The windows in which there was an error to judge.
    pub fn windows(&self, tick_s: f64) -> Vec<ErrorWindow> {
        let judged = self.0.all(tick_s).filter(|(_, own)| own.samples > 0);
        judged
            .map(|(time_s, own)| ErrorWindow {
                time_s,
                rms_m: (own.sum_of_squares_m2 / own.samples as f64).sqrt(),
                max_m: own.max_m,
            })
            .collect()
    }
}

impl Gathered for Window {
    fn with(self, later: Self) -> Self {
        Self {
            samples: self.samples + later.samples,
            sum_of_squares_m2: self.sum_of_squares_m2 + later.sum_of_squares_m2,
            max_m: self.max_m.max(later.max_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_and_largest_are_those_of_the_window() {
        let mut course = ErrorCourse::default();
        (0..512).for_each(|tick| course.observe(tick, if tick % 2 == 0 { 3.0 } else { -4.0 }));
        course.observe(512, f64::NAN);
        for own in course.windows(1.0) {
            assert_eq!((own.max_m, own.rms_m), (4.0, 12.5_f64.sqrt()), "{own:?}");
        }
        assert_eq!(course.windows(1.0).len(), 256);
    }
}
