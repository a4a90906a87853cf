//! The motions that `anhyst new` writes.

use super::amount::{ron, round};
use clap::ValueEnum;

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

/// Peak of sin x + 0.3 sin 3x: beside the sine's own.
const LOBES_PEAK: f64 = 0.920_212;
/// Of a raster: shares of the period on the line, in each turn, on the way back.
const RASTER: (f64, f64, f64) = (0.6, 0.1, 0.2);

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
        let half = 0.5 * stroke;
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
            Self::Lobes => {
                let first = half / LOBES_PEAK;
                turning(format!(
                    "(1, {}, 0.0), (3, {}, 0.0)",
                    number(first),
                    number(0.3 * first)
                ))
            }
            Self::Triangle => format!(
                "Triangle({mean_m}amplitude_m: {}, frequency_hz: {}, turn: 0.2)",
                number(half),
                number(frequency_hz)
            ),
            Self::Raster => {
                let (line, turn, back) = RASTER;
                // A line and what it overshoots in the turns.
                let length = stroke / (1.0 + turn / line);
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

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the amplitudes: with them a wish for 80 µm is one for 80 µm from end to end.
    #[test]
    fn lobes_go_as_far_as_asked() {
        let at = |angle: f64| angle.sin() + 0.3 * (3.0 * angle).sin();
        let peak = (0..100_000).map(|step| at(f64::from(step) * 1e-4)).fold(0.0, f64::max);
        assert!((peak - LOBES_PEAK).abs() < 1e-5, "{peak}");
    }
}
