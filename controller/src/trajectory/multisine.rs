//! r(t) = mean + A·Σ sin(2πfₖ·t + φₖ),  φₖ = −π·k(k − 1)/n for k = 1 … n: all lines at once, with a small peak.
//!
//! A amplitude of each line (m), f its frequency (Hz), n the number of lines. Assumption: about equally spaced lines; for these
//! the phases keep the peak below twice the rms value. Source: M. R. Schroeder, Synthesis of low-peak-factor signals, 1970.

use super::harmonics::{self, Harmonics};
use super::jet::Jet;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// More lines than this are slow to compute in every tick.
const MOST_LINES: usize = 512;
/// A line may be so many times the frequency with which all repeat.
const MOST_LOBES: u32 = 10_000;

/// Which frequencies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Lines {
    /// These, Hz.
    List(Vec<f64>),
    /// Equally spaced ones, both ends included.
    Grid {
        /// Lowest.
        from_hz: f64,
        /// Highest.
        to_hz: f64,
        /// From one to the next.
        step_hz: f64,
    },
}

/// Sines of one amplitude, all at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultisineSettings {
    /// Mean position.
    #[serde(default)]
    pub mean_m: f64,
    /// Of each line.
    pub amplitude_m: f64,
    /// Their frequencies.
    pub lines: Lines,
}

/// The lines and their sum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Multisine {
    lines_hz: Vec<f64>,
    period_s: Option<f64>,
    sum: Harmonics,
}

impl Lines {
    fn hz(&self) -> Vec<f64> {
        match self {
            Lines::List(lines) => lines.clone(),
            Lines::Grid {
                from_hz,
                to_hz,
                step_hz,
            } => {
                let steps = ((to_hz - from_hz) / step_hz + 1e-6).floor().min(MOST_LINES as f64) as usize;
                (0..=steps).map(|step| from_hz + step as f64 * step_hz).collect()
            }
        }
    }
}

impl MultisineSettings {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("amplitude_m", self.amplitude_m, "m")?;
        if let Lines::Grid {
            from_hz,
            to_hz,
            step_hz,
        } = self.lines
        {
            Invalid::unless_positive("lines.from_hz", from_hz, "Hz")?;
            Invalid::unless_positive("lines.step_hz", step_hz, "Hz")?;
            harmonics::unless_sampled("lines.to_hz", to_hz, tick_s)?;
            Invalid::unless_between("lines.from_hz", from_hz, 0.0, to_hz, "Hz")?;
        }
        let lines = self.lines.hz();
        if !(1..=MOST_LINES).contains(&lines.len()) {
            let sentence = format!("{} lines are outside [1, {MOST_LINES}]", lines.len());
            return Err(Invalid::new("lines", sentence));
        }
        for (place, line_hz) in lines.iter().enumerate() {
            let path = match self.lines {
                Lines::List(_) => format!("lines.{place}"),
                Lines::Grid { .. } => "lines".to_owned(),
            };
            harmonics::unless_sampled(&path, *line_hz, tick_s)?;
            if lines[..place].contains(line_hz) {
                return Err(Invalid::new(path, format!("{line_hz} Hz is there already")));
            }
        }
        harmonics::validate(self.mean_m, &[], tick_s)
    }
}

impl Multisine {
    pub(super) fn new(settings: &MultisineSettings) -> Self {
        let lines_hz = settings.lines.hz();
        let count = lines_hz.len() as f64;
        let terms: Vec<_> = lines_hz
            .iter()
            .enumerate()
            .map(|(place, line_hz)| {
                // k(k − 1) modulo 2n first: large angles lose digits.
                let turns = (place * (place + 1)) as f64 % (2.0 * count) / count;
                (settings.amplitude_m, *line_hz, -PI * turns)
            })
            .collect();
        let sum = Harmonics::new(settings.mean_m, &terms);
        Self {
            period_s: sum.turns_per_s_within(MOST_LOBES).map(f64::recip),
            lines_hz,
            sum,
        }
    }

    /// The frequencies.
    pub fn lines_hz(&self) -> &[f64] {
        &self.lines_hz
    }

    /// After which all repeat; none if there is no such time.
    pub fn period_s(&self) -> Option<f64> {
        self.period_s
    }

    pub(super) fn turns_per_s(&self) -> Option<f64> {
        self.period_s.map(f64::recip)
    }

    pub(super) fn at(&self, time_s: f64) -> Jet {
        self.sum.at(time_s)
    }
}
