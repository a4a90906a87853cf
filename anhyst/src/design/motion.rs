//! The motions that `anhyst new` writes.

use super::amount::{ron, round};
use anhyst_controller::{Trajectory, TrajectorySettings};
use anhyst_scenario::parse;
use clap::ValueEnum;
use std::path::Path;

/// What the tip is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Profile {
    /// A sine.
    Sine,
    /// A turned non-circular profile: a sine with 30 % of three times its frequency.
    Lobes,
    /// Up and down at one speed, corners rounded.
    Triangle,
    /// Lines with a fast way back.
    Raster,
    /// Two levels.
    Steps,
}

/// Of a raster: shares of the period on the line, in each turn, on the way back.
const RASTER: (f64, f64, f64) = (0.6, 0.1, 0.2);
/// Of a motion that repeats once a second.
const TICK_S: f64 = 1e-3;

impl Profile {
    /// By so many times the frequency at which it repeats it still moves notably.
    pub fn busiest(self) -> f64 {
        match self {
            Self::Sine => 1.0,
            Self::Lobes => 3.0,
            Self::Steps => 6.0,
            Self::Triangle => 8.0,
            Self::Raster => 12.0,
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Sine => "a sine",
            Self::Lobes => "a non-circular profile of one and three lobes",
            Self::Triangle => "a triangle",
            Self::Raster => "raster lines",
            Self::Steps => "steps between two levels",
        }
    }

    /// As a scenario has it: `stroke` from end to end about `mean`, repeated `frequency_hz` times a second.
    pub fn trajectory(self, stroke: f64, mean: f64, frequency_hz: f64) -> String {
        self.of_size(stroke / reach(&self.of_size(1.0, 0.0, 1.0)), mean, frequency_hz)
    }

    /// With sharp corners `size` would be the way from end to end.
    fn of_size(self, size: f64, mean: f64, frequency_hz: f64) -> String {
        let half = 0.5 * size;
        let (number, period_s) = (|value: f64| ron(round(value, 6)), 1.0 / frequency_hz);
        let mean_m = if mean == 0.0 {
            String::new()
        } else {
            format!("mean_m: {}, ", number(mean))
        };
        let turning = |lobes: String| {
            format!(
                "Profile(spindle_rpm: {}, {mean_m}lobes: [{lobes}])",
                number(60.0 * frequency_hz)
            )
        };
        match self {
            Self::Sine => turning(format!("(1, {}, 0.0)", number(half))),
            Self::Lobes => turning(format!("(1, {}, 0.0), (3, {}, 0.0)", number(half), number(0.3 * half))),
            Self::Triangle => format!(
                "Triangle({mean_m}amplitude_m: {}, frequency_hz: {}, turn: 0.2)",
                number(half),
                number(frequency_hz)
            ),
            Self::Raster => {
                let (line, turn, back) = RASTER;
                // A line and what it overshoots in the turns.
                let length = size / (1.0 + turn / line);
                format!(
                    "Raster({mean_m}length_m: {}, line_s: {}, turn_s: {}, back_s: {})",
                    number(length),
                    number(line * period_s),
                    number(turn * period_s),
                    number(back * period_s)
                )
            }
            Self::Steps => format!(
                "Steps(levels_m: [{}, {}], dwell_s: {}, over_s: {}, repeat: true)",
                number(mean - half),
                number(mean + half),
                number(0.25 * period_s),
                number(0.25 * period_s)
            ),
        }
    }
}

/// From end to end, as a scenario would go.
fn reach(trajectory: &str) -> f64 {
    let settings: TrajectorySettings = parse(Path::new(""), trajectory).expect("it was just written");
    let trajectory = Trajectory::load(&settings, 0.0, TICK_S, Path::new("")).expect("its numbers are known");
    2.0 * trajectory.reach_m(TICK_S).expect("it repeats")
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the sizes: with rounded corners, lobes and turns, too, a wish for 80 µm is one for 80 µm from end to end.
    #[test]
    fn each_motion_goes_as_far_as_asked() {
        for profile in Profile::value_variants() {
            let text = profile.trajectory(80e-6, 30e-6, 50.0);
            let settings: TrajectorySettings = parse(Path::new(""), &text).unwrap();
            let trajectory = Trajectory::load(&settings, 0.0, 1e-4, Path::new("")).unwrap();
            let places = (0..100_000).map(|step| trajectory.at(f64::from(step) * 2e-7).position_m);
            let (low, high) = places.fold((f64::MAX, f64::MIN), |(low, high), own| (low.min(own), high.max(own)));
            assert!(
                (high - 70e-6).abs() < 1e-10 && (low + 10e-6).abs() < 1e-10,
                "{text}: {low} to {high}"
            );
        }
    }
}
