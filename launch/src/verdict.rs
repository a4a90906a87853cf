//! What a cut came to: its figures, what of them did not hold, and the sentence.

use crate::any_number::{self, exceeds};
use crate::course::CourseVerdict;
use crate::error_between::ErrorBetween;
use crate::error_course::ErrorWindow;
use crate::error_spectrum::{ErrorLine, SpectrumBand};
use crate::history::Told;
use anhyst_guard::Event;
use anhyst_ipc::Estimate;
use anhyst_report::number::Si;
use anhyst_scenario::{Expect, Late, Units};
use serde::{Deserialize, Serialize};

/// Values of the parameters beside `a` and their standard deviations, 0 for those held.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EstimatedParameters {
    /// Ms, A/m.
    pub saturation_magnetization_a_per_m: (f64, f64),
    /// k, A/m.
    pub pinning_a_per_m: (f64, f64),
    /// α, no unit.
    pub coupling: (f64, f64),
    /// c, no unit.
    pub reversibility: (f64, f64),
    /// Directions of all five that the last motion told.
    pub informed_directions: u64,
}

impl EstimatedParameters {
    /// Of an estimate; none where `a` alone is estimated.
    pub(crate) fn of(estimate: &Estimate) -> Option<Self> {
        (estimate.saturation_magnetization_a_per_m > 0.0).then_some(Self {
            saturation_magnetization_a_per_m: (
                estimate.saturation_magnetization_a_per_m,
                estimate.saturation_magnetization_deviation_a_per_m,
            ),
            pinning_a_per_m: (estimate.pinning_a_per_m, estimate.pinning_deviation_a_per_m),
            coupling: (estimate.coupling, estimate.coupling_deviation),
            reversibility: (estimate.reversibility, estimate.reversibility_deviation),
            informed_directions: estimate.informed_directions,
        })
    }
}

/// What came of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// What its numbers are in.
    #[serde(default)]
    pub units: Units,
    /// Root mean square error.
    #[serde(with = "any_number")]
    pub error_rms_m: f64,
    /// Largest error.
    #[serde(with = "any_number")]
    pub error_max_m: f64,
    /// When the largest error occurred.
    #[serde(with = "any_number")]
    pub error_max_at_s: f64,
    /// Error half a tick before each sample; none where the plant does not say where it was, or somebody else says what is wanted.
    #[serde(default)]
    pub between: Option<ErrorBetween>,
    /// What matters about this kind of trajectory; none where that is its error alone.
    #[serde(default)]
    pub trajectory: Option<CourseVerdict>,
    /// Least margin to the tolerance; none where none is stated.
    #[serde(default)]
    pub least: Option<LeastMargin>,
    /// When the tolerance was first exceeded, if it was.
    pub first_exceeded_at_s: Option<f64>,
    /// Estimated minus true shape parameter at the end.
    #[serde(alias = "a_final_error_A_per_m", with = "any_number")]
    pub a_final_error_a_per_m: f64,
    /// Root mean square error of the estimated shape parameter.
    #[serde(with = "any_number")]
    pub a_error_rms_a_per_m: f64,
    /// Estimated shape parameter at the end.
    #[serde(with = "any_number")]
    pub a_estimated_a_per_m: f64,
    /// True shape parameter at the end.
    #[serde(with = "any_number")]
    pub a_true_a_per_m: f64,
    /// What else was estimated, at the end.
    #[serde(default)]
    pub parameters: Option<EstimatedParameters>,
    /// Ticks without an error to judge: in real time, those that the controller left out.
    #[serde(default)]
    pub unjudged_ticks: u64,
    /// Ticks of turns, ways back and settling steps, whose error does not count.
    #[serde(default)]
    pub uncounted_ticks: u64,
    /// Ticks that were judged.
    #[serde(default)]
    pub judged_ticks: u64,
    /// Largest field that was asked of the amplifier.
    #[serde(with = "any_number")]
    pub field_peak_a_per_m: f64,
    /// Lowest of it, 0 among it.
    #[serde(default, with = "any_number")]
    pub field_lowest_a_per_m: f64,
    /// Highest of it, 0 among it.
    #[serde(default, with = "any_number")]
    pub field_highest_a_per_m: f64,
    /// Largest field in the coil.
    #[serde(default, with = "any_number")]
    pub coil_field_peak_a_per_m: f64,
    /// Ticks with more field, asked for or in the coil, than the guard's limit permits.
    #[serde(default)]
    pub beyond_limit_ticks: u64,
    /// Ticks in which the field asked for or the field in the coil was no finite number.
    #[serde(default)]
    pub broken_field_ticks: u64,
    /// Ticks in which the amplifier said that the field in the coil is no finite number, and the first of them.
    #[serde(default)]
    pub coil_field_not_finite_ticks: u64,
    #[serde(default)]
    pub first_coil_field_not_finite_tick: u64,
    /// Largest true temperature.
    #[serde(with = "any_number")]
    pub temperature_peak_k: f64,
    /// Ticks in which the guard limited the field or took it away.
    pub guarded_ticks: u64,
    /// Ticks in which the amplifier went its own way, because it heard nothing: to its safe field, there, and back.
    #[serde(default)]
    pub watchdog_ticks: u64,
    /// The first of them.
    #[serde(default)]
    pub first_watchdog_tick: u64,
    /// Number of the first event that the guard raised, 0 for none.
    pub first_event: u64,
    /// The tick of that event.
    pub first_event_tick: u64,
    /// What makes the coil later than the scenario believes.
    #[serde(default)]
    pub coil_late: Option<Late>,
    /// What is worth telling beside the verdict, as sentences.
    #[serde(default)]
    pub noticed: Vec<String>,
    /// The error over time, in at most 256 windows.
    #[serde(default)]
    pub error_course: Vec<ErrorWindow>,
    /// Events and states; tracking and estimate for the page.
    #[serde(default)]
    pub history: Told,
    /// The strongest lines of the error, at most eight.
    #[serde(default)]
    pub error_lines: Vec<ErrorLine>,
    /// Spectra of error and sensor, in at most 400 bands.
    #[serde(default)]
    pub error_spectrum: Vec<SpectrumBand>,
}

/// Where an error came nearest to the tolerance in force, or went farthest beyond it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LeastMargin {
    /// Tolerance less error; below 0 it was exceeded.
    #[serde(with = "any_number")]
    pub margin_m: f64,
    pub at_s: f64,
    pub tolerance_m: f64,
    /// Between two samples.
    #[serde(default)]
    pub between: bool,
}

impl Verdict {
    /// The verdict on a run of so many ticks: what the judge did not see, because its process was not there, it did not judge.
    pub fn of_ticks(self, ticks: u64, tick_s: f64, expect: &Expect) -> Self {
        let due = (0..ticks)
            .rev()
            .take_while(|tick| *tick as f64 * tick_s >= expect.settling_s);
        let unjudged_ticks = (due.count() as u64).saturating_sub(self.judged_ticks + self.uncounted_ticks);
        Self { unjudged_ticks, ..self }
    }

    /// The largest error, at the samples or between them, and when it was.
    pub fn largest_error(&self) -> (f64, f64) {
        let between = self.between.filter(|own| exceeds(own.max_m, self.error_max_m));
        between.map_or((self.error_max_m, self.error_max_at_s), |own| (own.max_m, own.max_at_s))
    }

    /// What a run came to, in a sentence; whatever is not tracking is not called so.
    pub fn sentence(&self, failures: &[String], tolerance_m: Option<f64>, settling_s: f64) -> String {
        let between = self.between.map_or("", |_| ", between the samples, too");
        match tolerance_m {
            _ if !failures.is_empty() => format!("NOT held: {}", failures.join("; ")),
            Some(tolerance_m) => format!(
                "held: every error after {settling_s} s is within ±{}{between}",
                Si(tolerance_m, &self.units.output)
            ),
            None => format!(
                "nothing was to be held: no tolerance is stated, and the largest error after {settling_s} s is {}",
                Si(self.largest_error().0, &self.units.output)
            ),
        }
    }

    /// The name of the first event that the guard raised.
    pub fn first_event_name(&self) -> Option<&'static str> {
        Event::from_number(self.first_event).map(Event::name)
    }

    /// What did not hold, as sentences; empty if all did.
    pub fn failures(&self, expect: &Expect) -> Vec<String> {
        let mut failures = Vec::new();
        if self.judged_ticks == 0 && self.unjudged_ticks > 0 {
            let ticks = self.unjudged_ticks;
            failures.push(format!(
                "not one of {ticks} ticks could be judged: none had a demand of its own"
            ));
        } else if self.unjudged_ticks > self.judged_ticks {
            let ticks = self.judged_ticks + self.unjudged_ticks;
            failures.push(format!("only {} of {ticks} ticks could be judged", self.judged_ticks));
        }
        if self.broken_field_ticks > self.coil_field_not_finite_ticks {
            let ticks = self.broken_field_ticks;
            failures.push(format!(
                "the field asked for or the field in the coil was no finite number in {ticks} ticks"
            ));
        }
        if self.beyond_limit_ticks > 0 {
            let peak = Si(
                self.field_peak_a_per_m.max(self.coil_field_peak_a_per_m),
                &self.units.input,
            );
            let ticks = self.beyond_limit_ticks;
            failures.push(format!(
                "the field went beyond the guard's limit in {ticks} ticks, up to {peak}"
            ));
        }
        if let Some(worst) = self
            .least
            .filter(|least| exceeds(0.0, least.margin_m) || least.margin_m.is_nan())
        {
            let (max, at, most) = (
                Si(worst.tolerance_m - worst.margin_m, &self.units.output),
                worst.at_s,
                Si(worst.tolerance_m, &self.units.output),
            );
            let between = if worst.between { ", between the samples," } else { "" };
            failures.push(format!(
                "largest error {max} at {at:.4} s{between} exceeds the tolerance of {most}"
            ));
        }
        if let Some(limit) = expect.error_rms_m.filter(|limit| exceeds(self.error_rms_m, *limit)) {
            let (rms, limit) = (Si(self.error_rms_m, &self.units.output), Si(limit, &self.units.output));
            failures.push(format!("error rms {rms} exceeds {limit}"));
        }
        failures.extend(
            self.trajectory
                .iter()
                .flat_map(|own| own.failures(expect, &self.units.output)),
        );
        let faulty = Event::from_number(self.first_event).filter(|event| event.is_fault());
        if let Some(event) = faulty.filter(|_| !failures.is_empty()) {
            failures.insert(0, format!("the guard saw {event} in tick {}", self.first_event_tick));
        }
        // What comes back of it as a measurement, the guard sees later.
        if self.coil_field_not_finite_ticks > 0 {
            let (ticks, first) = (self.coil_field_not_finite_ticks, self.first_coil_field_not_finite_tick);
            let sentence = format!(
                "coil_field_not_finite: the amplifier said a field that is no finite number in {ticks} ticks, first in tick {first}"
            );
            let later = faulty.is_some() && self.first_event_tick < first;
            failures.insert(usize::from(later).min(failures.len()), sentence);
        }
        let final_error = self.a_final_error_a_per_m.abs();
        if let Some(limit) = expect
            .a_final_error_a_per_m
            .filter(|limit| exceeds(final_error, *limit))
        {
            failures.push(format!("final error of a {final_error:.2} A/m exceeds {limit} A/m"));
        }
        failures
    }
}
