//! r(t) = mean + v₁·s + (v₂ − v₁)·R(s − T₁/2) + (v₁ − v₂)·R(s − T₁/2 − T₂),  s = t modulo T₁ + T₂,
//! v₁ = 2A/T₁, v₂ = −2A/T₂: straight up and straight down, with rounded corners.
//!
//! A amplitude of the sharp corners (m), T₁ and T₂ time from corner to corner (s). R is 0 before and t after its corner, and
//! the integral of the blend S of `blend.rs` in the turn, L long (s), around it: the velocity goes from v₁ to v₂ along S, so
//! the acceleration is at most 2.461·|v₂ − v₁|/L, and four derivatives are continuous. What is rounded stays within the sharp
//! corners; outside the turns the way is exactly straight. At t = 0 it is in the middle of the way up.

use super::blend::Blend;
use super::jet::Jet;
use super::unless_turned;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// As long up as down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TriangleSettings {
    /// Mean position.
    #[serde(default)]
    pub mean_m: f64,
    /// Of the corners, were they sharp.
    pub amplitude_m: f64,
    /// How often it goes up and down.
    pub frequency_hz: f64,
    /// Share of the period that each of the two turns takes.
    pub turn: f64,
}

/// Slowly up, fast back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SawtoothSettings {
    /// Mean position.
    #[serde(default)]
    pub mean_m: f64,
    /// Of the corners, were they sharp.
    pub amplitude_m: f64,
    /// How often it goes up and back.
    pub frequency_hz: f64,
    /// Share of the period from the upper corner to the lower.
    pub back: f64,
    /// Share of the period that each of the two turns takes.
    pub turn: f64,
}

/// Line after line of equal length and speed, with turns outside it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RasterSettings {
    /// Middle of the line.
    #[serde(default)]
    pub mean_m: f64,
    /// Of a line: all of it is straight.
    pub length_m: f64,
    /// Time on a line.
    pub line_s: f64,
    /// Time from a line's end to the beginning of the way back, and from its end to the next line.
    pub turn_s: f64,
    /// Time of the straight way back, over which nothing is judged; none: as a line, and judged as one.
    #[serde(default)]
    pub back_s: Option<f64>,
}

/// What repeats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    mean_m: f64,
    amplitude_m: f64,
    rise_s: f64,
    fall_s: f64,
    turn_s: f64,
    /// The way back is of use, too.
    both_ways: bool,
}

/// Where on a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnLine {
    /// Counted from 0 at t = 0.
    pub number: u64,
    /// Since the line's beginning.
    pub since_s: f64,
}

impl Scan {
    pub(super) fn triangle(settings: &TriangleSettings) -> Self {
        let half_s = 0.5 / settings.frequency_hz;
        Self {
            mean_m: settings.mean_m,
            amplitude_m: settings.amplitude_m,
            rise_s: half_s,
            fall_s: half_s,
            turn_s: settings.turn / settings.frequency_hz,
            both_ways: true,
        }
    }

    pub(super) fn sawtooth(settings: &SawtoothSettings) -> Self {
        let period_s = settings.frequency_hz.recip();
        Self {
            mean_m: settings.mean_m,
            amplitude_m: settings.amplitude_m,
            rise_s: (1.0 - settings.back) * period_s,
            fall_s: settings.back * period_s,
            turn_s: settings.turn * period_s,
            both_ways: false,
        }
    }

    pub(super) fn raster(settings: &RasterSettings) -> Self {
        let overscan_m = 0.5 * settings.length_m / settings.line_s * settings.turn_s;
        Self {
            mean_m: settings.mean_m,
            amplitude_m: 0.5 * settings.length_m + overscan_m,
            rise_s: settings.line_s + settings.turn_s,
            fall_s: settings.back_s.unwrap_or(settings.line_s) + settings.turn_s,
            turn_s: settings.turn_s,
            both_ways: settings.back_s.is_none(),
        }
    }

    fn period_s(&self) -> f64 {
        self.rise_s + self.fall_s
    }

    pub(super) fn turns_per_s(&self) -> f64 {
        self.period_s().recip()
    }

    /// Time on a line that is judged; where both ways are, they take as long.
    pub fn line_s(&self) -> f64 {
        self.rise_s - self.turn_s
    }

    /// Length of a line, m.
    pub fn line_m(&self) -> f64 {
        2.0 * self.amplitude_m * (1.0 - self.turn_s / self.rise_s)
    }

    /// Where on a line; none in a turn, and on a way back that is of no use.
    pub fn line(&self, time_s: f64) -> Option<OnLine> {
        let period_s = self.period_s();
        let from_corner_s = time_s + 0.5 * self.rise_s;
        let period = (from_corner_s / period_s).floor();
        let since_s = from_corner_s - period * period_s - 0.5 * self.turn_s;
        let way = |since_s: f64, over_s: f64| (0.0..=over_s - self.turn_s).contains(&since_s);
        let lines = if self.both_ways { 2 } else { 1 };
        let number = lines * period.max(0.0) as u64;
        if way(since_s, self.rise_s) {
            return Some(OnLine { number, since_s });
        }
        let since_s = since_s - self.rise_s;
        (self.both_ways && way(since_s, self.fall_s)).then_some(OnLine {
            number: number + 1,
            since_s,
        })
    }

    pub(super) fn at(&self, time_s: f64) -> Jet {
        let period_s = self.period_s();
        let own_s = time_s - (time_s / period_s).floor() * period_s;
        let (up, down) = (
            2.0 * self.amplitude_m / self.rise_s,
            -2.0 * self.amplitude_m / self.fall_s,
        );
        let corner = |at_s: f64| {
            Blend {
                from_s: at_s - 0.5 * self.turn_s,
                length_s: self.turn_s,
            }
            .integral_at(own_s)
        };
        Jet([self.mean_m + up * own_s, up, 0.0, 0.0, 0.0])
            .plus(corner(0.5 * self.rise_s).scaled(down - up))
            .plus(corner(0.5 * self.rise_s + self.fall_s).scaled(up - down))
    }

    fn validate(&self, turn: &str, tick_s: f64) -> Result<(), Invalid> {
        if !self.mean_m.is_finite() {
            return Err(Invalid::new("mean_m", format!("{} m must be finite", self.mean_m)));
        }
        unless_turned(turn, "a turn", self.turn_s, turn, tick_s)
    }
}

impl TriangleSettings {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("amplitude_m", self.amplitude_m, "m")?;
        Invalid::unless_positive("frequency_hz", self.frequency_hz, "Hz")?;
        Invalid::unless_between("turn", self.turn, 0.0, 0.5, "of the period")?;
        Scan::triangle(self).validate("turn", tick_s)
    }
}

impl SawtoothSettings {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("amplitude_m", self.amplitude_m, "m")?;
        Invalid::unless_positive("frequency_hz", self.frequency_hz, "Hz")?;
        Invalid::unless_between("back", self.back, 0.0, 0.5, "of the period")?;
        Invalid::unless_between("turn", self.turn, 0.0, self.back, "of the period")?;
        Scan::sawtooth(self).validate("turn", tick_s)
    }
}

impl RasterSettings {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("length_m", self.length_m, "m")?;
        Invalid::unless_between("line_s", self.line_s, tick_s, 1e9, "s")?;
        if let Some(back_s) = self.back_s {
            Invalid::unless_between("back_s", back_s, 0.0, self.line_s, "s")?;
        }
        Scan::raster(self).validate("turn_s", tick_s)
    }
}
