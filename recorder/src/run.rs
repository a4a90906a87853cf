//! What the recorder has to know about a run in order to label and lay out its recording.

use crate::Scales;
use anhyst_ipc::Invalid;
use std::path::PathBuf;

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Normal course.
    Info,
    /// The loop is limited but works.
    Warning,
    /// The loop was left or damaged.
    Error,
}

impl Level {
    /// The level in Rerun's words.
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Level::Info => "INFO",
            Level::Warning => "WARN",
            Level::Error => "ERROR",
        }
    }
}

/// What an event number of the guard means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EventName {
    /// The number in [`anhyst_ipc::SafeField::event`].
    pub number: u64,
    /// A short sentence.
    pub text: String,
    /// How much it matters.
    pub level: Level,
}

/// One run, as far as its recording is concerned.
#[derive(Debug, Clone, PartialEq)]
pub struct RunInfo {
    /// The file to write, `….rrd`; the layout goes beside it as `….rbl`.
    pub path: PathBuf,
    /// Unique name of the run; the recording's id.
    pub run_id: String,
    /// Name for people.
    pub name: String,
    /// What the run shows, in Markdown; may be empty.
    pub notes: String,
    /// Length of a tick.
    pub tick_s: f64,
    /// Largest tracking error that is good enough.
    pub tolerance_m: f64,
    /// From when on the tolerance has to be kept.
    pub settling_time_s: f64,
    /// Period of the reference; the zoomed plots show a few of them. None: the reference is not periodic.
    pub period_s: Option<f64>,
    /// Smallest and largest shape parameter a, in A/m.
    pub parameter_range: [f64; 2],
    /// Ms (A/m), k (A/m) and c that the loop starts from.
    pub material: [f64; 3],
    /// The clock on the wall decides when a tick begins: how the nodes keep time is recorded, too.
    pub realtime: bool,
    /// Largest field that the guard lets through.
    pub field_limit_a_per_m: f64,
    /// Lowest field that the guard lets through.
    pub lowest_field_a_per_m: f64,
    /// In what units it is drawn.
    pub scales: Scales,
    /// The guard's event numbers in words.
    pub events: Vec<EventName>,
}

impl RunInfo {
    /// Refuses what cannot be used.
    ///
    /// # Errors
    /// The field, its value and the reason.
    pub fn validate(&self) -> Result<(), Invalid> {
        // Time stamps are whole nanoseconds: below 100 ns a tick they could not be told apart exactly.
        Invalid::unless_between("tick_s", self.tick_s, 1e-7, 1e3, "s")?;
        if self.run_id.is_empty() || self.run_id.len() > 180 {
            let length = self.run_id.len();
            return Err(Invalid::new(
                "run_id",
                format!("{length} characters are outside [1, 180]"),
            ));
        }
        Ok(())
    }

    /// Time of a tick in whole nanoseconds.
    pub(crate) fn time_ns(&self, tick: u64) -> i64 {
        time_ns(self.tick_s, tick)
    }

    /// The name of an event number.
    pub(crate) fn event(&self, number: u64) -> Option<&EventName> {
        self.events.iter().find(|event| event.number == number)
    }

    /// Length of the zoomed plots: five periods, or 0.2 s.
    pub(crate) fn zoom_s(&self) -> f64 {
        self.period_s
            .filter(|period| *period > 0.0)
            .map_or(0.2, |period| 5.0 * period)
    }
}

/// Time of a tick in whole nanoseconds.
pub(crate) fn time_ns(tick_s: f64, tick: u64) -> i64 {
    (tick as f64 * tick_s * 1e9).round() as i64
}

/// The tick at a time; the inverse of [`time_ns`].
pub(crate) fn tick_at(tick_s: f64, time_ns: i64) -> u64 {
    (time_ns as f64 * 1e-9 / tick_s).round() as u64
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A run for tests.
    pub fn run() -> RunInfo {
        RunInfo {
            path: PathBuf::new(),
            run_id: "test".into(),
            name: "test".into(),
            notes: String::new(),
            tick_s: 1e-3,
            tolerance_m: 1e-7,
            settling_time_s: 0.1,
            period_s: None,
            parameter_range: [6000.0, 7000.0],
            material: [7.65e5, 4000.0, 0.18],
            realtime: false,
            scales: Scales::default(),
            field_limit_a_per_m: 30e3,
            lowest_field_a_per_m: -30e3,
            events: Vec::new(),
        }
    }
}
