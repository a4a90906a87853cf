//! How the error of a run goes over time, in a few hundred windows whatever the run's length: when they are full, each two
//! become one.

use serde::{Deserialize, Serialize};

const MAX_WINDOWS: usize = 256;

/// Windows of equally many ticks from tick 0 on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ErrorCourse {
    ticks: u64,
    windows: Vec<Window>,
}

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

impl Default for ErrorCourse {
    fn default() -> Self {
        Self {
            ticks: 1,
            windows: Vec::with_capacity(MAX_WINDOWS),
        }
    }
}

impl ErrorCourse {
    /// Takes in the error of a tick; what is no finite number has no place in a picture.
    pub fn observe(&mut self, tick: u64, error_m: f64) {
        if !error_m.is_finite() {
            return;
        }
        while tick / self.ticks >= MAX_WINDOWS as u64 {
            self.ticks *= 2;
            for place in 0..self.windows.len().div_ceil(2) {
                let later = self.windows.get(2 * place + 1).copied().unwrap_or_default();
                self.windows[place] = self.windows[2 * place].with(later);
            }
            self.windows.truncate(self.windows.len().div_ceil(2));
        }
        let place = (tick / self.ticks) as usize;
        if self.windows.len() <= place {
            self.windows.resize(place + 1, Window::default());
        }
        self.windows[place] = self.windows[place].with(Window {
            samples: 1,
            sum_of_squares_m2: error_m * error_m,
            max_m: error_m.abs(),
        });
    }

    /// The windows in which there was an error to judge.
    pub fn windows(&self, tick_s: f64) -> Vec<ErrorWindow> {
        let judged = self.windows.iter().enumerate().filter(|(_, own)| own.samples > 0);
        judged
            .map(|(place, own)| ErrorWindow {
                time_s: (place as f64 + 0.5) * self.ticks as f64 * tick_s,
                rms_m: (own.sum_of_squares_m2 / own.samples as f64).sqrt(),
                max_m: own.max_m,
            })
            .collect()
    }
}

impl Window {
    fn with(self, other: Window) -> Window {
        Window {
            samples: self.samples + other.samples,
            sum_of_squares_m2: self.sum_of_squares_m2 + other.sum_of_squares_m2,
            max_m: self.max_m.max(other.max_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the halving: whatever the length, no error is lost, counted twice, or told of another time.
    #[test]
    fn every_error_is_in_the_window_of_its_time() {
        for ticks in [1, 255, 256, 257, 1000, 70_001] {
            let mut course = ErrorCourse::default();
            (0..ticks).for_each(|tick| course.observe(tick, tick as f64));
            let windows = course.windows(1.0);
            assert!(windows.len() <= MAX_WINDOWS, "{}", windows.len());
            let samples: u64 = course.windows.iter().map(|own| own.samples).sum();
            assert_eq!(samples, ticks);
            for own in &windows {
                let half = 0.5 * course.ticks as f64;
                assert!(
                    own.max_m < own.time_s + half && own.rms_m >= own.time_s - half,
                    "{own:?}"
                );
            }
        }
    }
}
