//! r(t) and its first four derivatives, in closed form at any time.
//!
//! Four, because the rod's inverse takes two and the correction for the first-order hold two more. One file per kind; all of
//! them are pure functions of time, so a tick can be evaluated alone, in any order, and twice.

mod amplitude;
mod blend;
mod harmonics;
mod jet;
mod multisine;
mod profile;
mod ramps;
mod scan;
mod spindle;
mod spline;
mod steps;
mod sweep;
mod table;

use amplitude::Amplitude;
use anhyst_ipc::Invalid;
use blend::Blend;
use harmonics::Harmonics;
use jet::Jet;
use ramps::SmoothRamps;
use serde::{Deserialize, Serialize};
use spindle::Turning;
use std::path::{Path, PathBuf};
use table::Table;

pub(crate) use blend::blend;
pub use multisine::{Lines, Multisine, MultisineSettings};
pub use scan::{OnLine, RasterSettings, SawtoothSettings, Scan, TriangleSettings};
pub use spindle::SpeedChange;
pub use steps::{Step, Steps, StepsSettings};
pub use sweep::{Spacing, Sweep};

/// Position and its time derivatives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// r.
    pub position_m: f64,
    /// dr/dt.
    pub velocity_m_per_s: f64,
    /// d²r/dt².
    pub acceleration_m_per_s2: f64,
    /// d³r/dt³.
    pub jerk_m_per_s3: f64,
    /// d⁴r/dt⁴.
    pub snap_m_per_s4: f64,
}

impl Motion {
    /// This much later, s, to the fourth derivative.
    pub fn after(&self, time_s: f64) -> Motion {
        let snap = self.snap_m_per_s4;
        let jerk = self.jerk_m_per_s3;
        let to = |value: f64, rates: [f64; 3]| {
            value + time_s * (rates[0] + time_s / 2.0 * (rates[1] + time_s / 3.0 * rates[2]))
        };
        Motion {
            position_m: to(
                self.position_m,
                [self.velocity_m_per_s, self.acceleration_m_per_s2, jerk],
            ),
            velocity_m_per_s: to(self.velocity_m_per_s, [self.acceleration_m_per_s2, jerk, snap]),
            acceleration_m_per_s2: to(self.acceleration_m_per_s2, [jerk, snap, 0.0]),
            jerk_m_per_s3: jerk + time_s * snap,
            snap_m_per_s4: snap,
        }
    }
}

/// Places of a turn that are looked at.
const PLACES: u32 = 4096;

/// What the tip is to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum TrajectorySettings {
    /// Stay at 0.
    Rest,
    /// mean + Σ amplitude·sin(2π·frequency·t + phase).
    Harmonics {
        /// Mean position.
        #[serde(default)]
        mean_m: f64,
        /// Amplitude in m, frequency in Hz, phase in rad.
        terms: Vec<(f64, f64, f64)>,
    },
    /// Cross-section of a non-circular workpiece that turns in front of the tool: mean + Σ amplitude·sin(lobe·θ + phase).
    Profile {
        /// Speed of the workpiece.
        spindle_rpm: f64,
        /// Mean position.
        #[serde(default)]
        mean_m: f64,
        /// Lobes per revolution, amplitude in m, phase in rad.
        lobes: Vec<(u32, f64, f64)>,
        /// Changes of the speed, in the order of time.
        #[serde(default)]
        speed_changes: Vec<SpeedChange>,
    },
    /// From point to point, standing still in each; four continuous derivatives.
    SmoothRamps {
        /// Time in s (rising), position in m.
        points: Vec<(f64, f64)>,
    },
    /// From level to level, standing still in each.
    Steps(StepsSettings),
    /// Up and down at one speed, with rounded corners.
    Triangle(TriangleSettings),
    /// Up at one speed and faster back, with rounded corners.
    Sawtooth(SawtoothSettings),
    /// Line after line of a stated length, with turns outside it.
    Raster(RasterSettings),
    /// A sine whose frequency goes from one to another.
    Sweep(Sweep),
    /// Sines of many frequencies at once.
    Multisine(MultisineSettings),
    /// A CSV file with columns of time (rising) and position, each with its unit in its name, joined by a quintic spline.
    Table {
        /// Path, relative to the scenario's folder.
        file: PathBuf,
        /// Start again at the end: the last row is the first one, a period later. Otherwise stand still there.
        #[serde(default)]
        repeat: bool,
    },
}

impl TrajectorySettings {
    /// The same motion, so many times as large. A table's is in its file and stays.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        match &mut self {
            Self::Rest | Self::Table { .. } => {}
            Self::Harmonics { mean_m, terms } => {
                *mean_m *= factor;
                terms.iter_mut().for_each(|term| term.0 *= factor);
            }
            Self::Profile { mean_m, lobes, .. } => {
                *mean_m *= factor;
                lobes.iter_mut().for_each(|lobe| lobe.1 *= factor);
            }
            Self::SmoothRamps { points } => points.iter_mut().for_each(|point| point.1 *= factor),
            Self::Steps(own) => own.levels_m.iter_mut().for_each(|level_m| *level_m *= factor),
            Self::Triangle(TriangleSettings {
                mean_m, amplitude_m, ..
            })
            | Self::Sawtooth(SawtoothSettings {
                mean_m, amplitude_m, ..
            })
            | Self::Sweep(Sweep {
                mean_m, amplitude_m, ..
            })
            | Self::Multisine(MultisineSettings {
                mean_m, amplitude_m, ..
            })
            | Self::Raster(RasterSettings {
                mean_m,
                length_m: amplitude_m,
                ..
            }) => {
                *mean_m *= factor;
                *amplitude_m *= factor;
            }
        }
        self
    }

    /// Refuses numbers that make no trajectory. Files are looked at by [`Trajectory::load`].
    ///
    /// # Errors
    /// The first refusal; its path is relative to this enum.
    pub fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        match self {
            Self::Rest | Self::Table { .. } => Ok(()),
            Self::Harmonics { mean_m, terms } => harmonics::validate(*mean_m, terms, tick_s),
            Self::Profile {
                spindle_rpm,
                mean_m,
                lobes,
                speed_changes,
            } => profile::validate(*spindle_rpm, *mean_m, lobes, speed_changes, tick_s),
            Self::SmoothRamps { points } => ramps::validate(points, tick_s),
            Self::Steps(own) => own.validate(tick_s),
            Self::Triangle(own) => own.validate(tick_s),
            Self::Sawtooth(own) => own.validate(tick_s),
            Self::Raster(own) => own.validate(tick_s),
            Self::Sweep(own) => own.validate(tick_s),
            Self::Multisine(own) => own.validate(tick_s),
        }
    }
}

impl TrajectorySettings {
    /// The same motion, without what comes after a run of so long.
    #[must_use]
    pub fn within(mut self, duration_s: f64) -> Self {
        if let Self::Profile { speed_changes, .. } = &mut self {
            speed_changes.retain(|change| change.at_s < duration_s);
        }
        self
    }

    /// Refuses what a run of so long would silently leave out.
    pub(crate) fn validate_within(&self, duration_s: f64) -> Result<(), Invalid> {
        let Self::Profile { speed_changes, .. } = self else {
            return Ok(());
        };
        let late = speed_changes.iter().position(|change| change.at_s >= duration_s);
        late.map_or(Ok(()), |place| {
            let at_s = speed_changes[place].at_s;
            let sentence =
                format!("{at_s} s is not before the run's end, {duration_s} s: this change would never come");
            Err(Invalid::new(format!("speed_changes.{place}.at_s"), sentence))
        })
    }
}

/// Refuses what a blend does in fewer than four ticks: the hold's correction sees its fourth derivative.
fn unless_turned(path: &str, what: &str, length_s: f64, remedy: &str, tick_s: f64) -> Result<(), Invalid> {
    let least_s = 4.0 * tick_s;
    if length_s >= least_s {
        return Ok(());
    }
    let sentence = format!("{what} would take {length_s} s; it takes four ticks, {least_s} s, at least: see {remedy}");
    Err(Invalid::new(path, sentence))
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Kind {
    Rest,
    Harmonics(Harmonics),
    Turning(Turning),
    SmoothRamps(SmoothRamps),
    Steps(Steps),
    Scan(Scan),
    Sweep(Sweep),
    Multisine(Multisine),
    Table(Table),
}

/// What matters about a trajectory beyond where it is: what it is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course<'a> {
    /// Where it is, and nothing else.
    Path,
    /// Settling and overshoot.
    Steps(&'a Steps),
    /// Straight lines.
    Scan(&'a Scan),
    /// Frequency after frequency.
    Sweep(&'a Sweep),
    /// Many frequencies at once.
    Multisine(&'a Multisine),
}

/// A trajectory, ready to be evaluated: S(t/start)·r(t), with S the smooth blend from 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    kind: Kind,
    start_s: f64,
    amplitude: Amplitude,
}

impl Trajectory {
    /// Builds the trajectory; reads the table's file, which is the only I/O and happens here. `start_s` is the length of the
    /// smooth start from rest at 0 (0: none); files are looked for in `base_dir`.
    ///
    /// # Errors
    /// If the numbers make no trajectory or the file cannot be read; the sentence names file, row and column.
    pub fn load(settings: &TrajectorySettings, start_s: f64, tick_s: f64, base_dir: &Path) -> Result<Self, Invalid> {
        settings.validate(tick_s)?;
        let kind = match settings {
            TrajectorySettings::Rest => Kind::Rest,
            TrajectorySettings::Harmonics { mean_m, terms } => Kind::Harmonics(Harmonics::new(*mean_m, terms)),
            TrajectorySettings::Profile {
                spindle_rpm,
                mean_m,
                lobes,
                speed_changes,
            } if speed_changes.is_empty() => Kind::Harmonics(profile::harmonics(*spindle_rpm, *mean_m, lobes)),
            TrajectorySettings::Profile {
                spindle_rpm,
                mean_m,
                lobes,
                speed_changes,
            } => Kind::Turning(Turning::new(*spindle_rpm, speed_changes, *mean_m, lobes)),
            TrajectorySettings::SmoothRamps { points } => Kind::SmoothRamps(SmoothRamps::new(points)),
            TrajectorySettings::Steps(own) => Kind::Steps(Steps::new(own)),
            TrajectorySettings::Triangle(own) => Kind::Scan(Scan::triangle(own)),
            TrajectorySettings::Sawtooth(own) => Kind::Scan(Scan::sawtooth(own)),
            TrajectorySettings::Raster(own) => Kind::Scan(Scan::raster(own)),
            TrajectorySettings::Sweep(own) => Kind::Sweep(*own),
            TrajectorySettings::Multisine(own) => Kind::Multisine(Multisine::new(own)),
            TrajectorySettings::Table { file, repeat } => Kind::Table(Table::load(&base_dir.join(file), *repeat)?),
        };
        Ok(Self {
            kind,
            start_s,
            amplitude: Amplitude::default(),
        })
    }

    /// Position and derivatives at a time.
    pub fn at(&self, time_s: f64) -> Motion {
        let jet = match &self.kind {
            Kind::Rest => Jet::default(),
            Kind::Harmonics(harmonics) => harmonics.at(time_s),
            Kind::Turning(turning) => turning.at(time_s),
            Kind::SmoothRamps(ramps) => ramps.at(time_s),
            Kind::Steps(steps) => steps.at(time_s),
            Kind::Scan(scan) => scan.at(time_s),
            Kind::Sweep(sweep) => sweep.at(time_s),
            Kind::Multisine(multisine) => multisine.at(time_s),
            Kind::Table(table) => table.at(time_s),
        };
        let jet = self.amplitude.at(time_s).map_or(jet, |amplitude| jet.times(amplitude));
        let Jet(
            [
                position_m,
                velocity_m_per_s,
                acceleration_m_per_s2,
                jerk_m_per_s3,
                snap_m_per_s4,
            ],
        ) = if self.starting(time_s) {
            jet.times(
                Blend {
                    from_s: 0.0,
                    length_s: self.start_s,
                }
                .at(time_s),
            )
        } else {
            jet
        };
        Motion {
            position_m,
            velocity_m_per_s,
            acceleration_m_per_s2,
            jerk_m_per_s3,
            snap_m_per_s4,
        }
    }

    /// The position alone, where nobody asks for more: the same bits as that of [`Trajectory::at`].
    pub fn position_m(&self, time_s: f64) -> f64 {
        match &self.kind {
            Kind::Harmonics(harmonics) if !self.starting(time_s) && self.amplitude.at(time_s).is_none() => {
                harmonics.position_m(time_s)
            }
            _ => self.at(time_s).position_m,
        }
    }

    /// What it is judged by.
    pub fn course(&self) -> Course<'_> {
        match &self.kind {
            Kind::Steps(steps) => Course::Steps(steps),
            Kind::Scan(scan) => Course::Scan(scan),
            Kind::Sweep(sweep) => Course::Sweep(sweep),
            Kind::Multisine(multisine) => Course::Multisine(multisine),
            Kind::Rest | Kind::Harmonics(_) | Kind::Turning(_) | Kind::SmoothRamps(_) | Kind::Table(_) => Course::Path,
        }
    }

    /// From `from_s` on goes to so many times the stated motion, over `over_s`.
    pub(crate) fn change_amplitude(&mut self, from_s: f64, over_s: f64, factor: f64) {
        self.amplitude.change(from_s, over_s, factor);
    }

    /// Turns of what repeats, at a time; none where nothing does.
    pub fn turns(&self, time_s: f64) -> Option<f64> {
        match &self.kind {
            Kind::Rest | Kind::SmoothRamps(_) | Kind::Sweep(_) => None,
            Kind::Steps(steps) => Some(steps.turns_per_s()? * time_s),
            Kind::Scan(scan) => Some(scan.turns_per_s() * time_s),
            Kind::Multisine(multisine) => Some(multisine.turns_per_s()? * time_s),
            Kind::Harmonics(harmonics) => Some(harmonics.turns_per_s()? * time_s),
            Kind::Turning(turning) => Some(turning.turns(time_s)),
            Kind::Table(table) => Some(table.turns_per_s()? * time_s),
        }
    }

    /// How fast that is once the start is over.
    pub fn turns_per_s(&self, tick_s: f64) -> Option<f64> {
        let [from, to] = [self.start_s, self.start_s + tick_s].map(|time_s| self.turns(time_s));
        Some((to? - from?) / tick_s)
    }

    /// Half of the way between the ends of what repeats, over its first turn; none where nothing does.
    pub fn reach_m(&self, tick_s: f64) -> Option<f64> {
        let turn_s = self.turns_per_s(tick_s)?.recip();
        let places = (0..PLACES).map(|place| self.start_s + turn_s * f64::from(place) / f64::from(PLACES));
        let ends = places.map(|time_s| self.at(time_s).position_m);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), own| {
            (low.min(own), high.max(own))
        });
        Some(0.5 * (high - low))
    }

    /// True while the smooth start lasts.
    pub fn starting(&self, time_s: f64) -> bool {
        self.start_s > 0.0 && time_s < self.start_s
    }
}
