//! Judges a cut while it runs: error is the reference minus the true displacement, after the settling time; at the samples, and half a
//! tick before each, where the feedback does not look.

use crate::any_number::{self, exceeds};
use crate::course::{CourseJudge, Instant, counts};
use crate::error_between::Between;
use crate::error_course::ErrorCourse;
use crate::error_spectrum::ErrorSpectrum;
use crate::history::History;
use crate::last_turns::LastTurns;
use crate::noticed::Noticing;
use crate::verdict::{EstimatedParameters, LeastMargin, Verdict};
use anhyst_controller::Trajectory;
use anhyst_ipc::{Change, CoilField, Demand, Estimate, MAX_CHANGES, Measurement, SafeField, Truth, Tunable};
use anhyst_scenario::{Expect, Units};
use serde::{Deserialize, Serialize};

/// Running sums over the tokens of a run. They can be written down, for the judge that takes the place of one that died.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Judge {
    expect: Expect,
    tick_s: f64,
    field_limit_a_per_m: f64,
    #[serde(default)]
    lowest_field_a_per_m: Option<f64>,
    samples: u64,
    #[serde(with = "any_number")]
    sum_of_squares_m2: f64,
    #[serde(with = "any_number")]
    shape_error_sum_of_squares: f64,
    #[serde(default)]
    course: ErrorCourse,
    #[serde(default)]
    history: History,
    #[serde(default)]
    between: Between,
    #[serde(default)]
    trajectory_judge: Option<CourseJudge>,
    spectrum: Option<ErrorSpectrum>,
    /// Changes of the tolerance: from which tick on which.
    #[serde(default)]
    tolerances: Vec<(u64, f64)>,
    noticing: Option<Noticing>,
    /// Not written down: a table may be long, and whoever goes on has it.
    #[serde(skip)]
    trajectory: Option<Trajectory>,
    /// Nor this: a picture may begin later.
    #[serde(skip)]
    turns: Option<LastTurns>,
    /// What is wanted is no more what was stated.
    #[serde(default)]
    departed: bool,
    verdict: Verdict,
}

/// So much more than the guard's limit may be in the coil: an amplifier's own limit, noise and resolution are not the guard's.
const COIL_MARGIN: f64 = 1.01;

/// Bits of the coil's status while the amplifier's own watchdog leads the field: on the way, there, on the way back.
const WATCHDOG: u64 = CoilField::RAMPING | CoilField::SAFE | CoilField::RETURNING;

/// References that differ by less are the same.
const ROUNDING_M: f64 = 1e-12;

impl Judge {
    /// A judge of what the scenario expects, and of the guard's field limit.
    pub fn new(expect: Expect, tick_s: f64, field_limit_a_per_m: f64) -> Self {
        Self {
            expect,
            tick_s,
            field_limit_a_per_m,
            lowest_field_a_per_m: None,
            samples: 0,
            sum_of_squares_m2: 0.0,
            shape_error_sum_of_squares: 0.0,
            course: ErrorCourse::default(),
            history: History::default(),
            between: Between::default(),
            trajectory_judge: None,
            spectrum: None,
            tolerances: Vec::new(),
            noticing: None,
            trajectory: None,
            turns: None,
            departed: false,
            verdict: Verdict::default(),
        }
    }

    /// The same, saying its numbers in these.
    pub fn in_units(mut self, units: Units) -> Self {
        self.verdict.units = units;
        self
    }

    /// The same, of a guard that has a lowest field of its own.
    pub fn with_lowest_field(self, lowest_field_a_per_m: Option<f64>) -> Self {
        Self {
            lowest_field_a_per_m,
            ..self
        }
    }

    /// The same, listening to what is worth telling beside the verdict.
    pub fn noticing(self, noticing: Option<Noticing>) -> Self {
        Self { noticing, ..self }
    }

    /// The same, knowing what is wanted at any time.
    pub fn following(mut self, trajectory: Option<Trajectory>) -> Self {
        self.trajectory_judge = trajectory
            .as_ref()
            .and_then(|own| CourseJudge::new(own, &self.expect, self.tick_s));
        self.turns = trajectory
            .as_ref()
            .and_then(|own| LastTurns::new(self.tick_s, own.turns_per_s(self.tick_s)?.recip()));
        self.trajectory = trajectory;
        self
    }

    /// What another judge has written down, with what only this one knows.
    pub fn going_on(self, noted: Self) -> Self {
        Self {
            trajectory: self.trajectory,
            turns: self.turns,
            ..noted
        }
    }

    /// The same, with what the scenario changes while it runs.
    pub fn with_changes(mut self, changes: &[Change]) -> Self {
        for change in changes {
            self.change(change);
        }
        self
    }

    /// Takes a change of the tolerance; false if it is another setting.
    pub fn change(&mut self, change: &Change) -> bool {
        let taken = change.set == Tunable::Tolerance && self.tolerances.len() < MAX_CHANGES;
        if taken {
            self.tolerances.push((change.tick, change.value));
        }
        taken
    }

    /// The tolerance in force.
    fn tolerance_m(&self, tick: u64) -> Option<f64> {
        let changed = self.tolerances.iter().rev().find(|(from, _)| *from <= tick);
        changed.map(|(_, value)| *value).or(self.expect.tolerance_m)
    }

    /// The same, with the spectrum of the error.
    pub fn with_spectrum(self, spectrum: Option<ErrorSpectrum>) -> Self {
        Self { spectrum, ..self }
    }

    /// Looks at one tick.
    pub fn observe(
        &mut self,
        tick: u64,
        (measured, truth): (&Measurement, &Truth),
        estimate: &Estimate,
        demand: &Demand,
        (field, coil): (&SafeField, &CoilField),
    ) {
        let time_s = tick as f64 * self.tick_s;
        let tolerance_m = self.tolerance_m(tick);
        if let Some(noticing) = &mut self.noticing {
            noticing.hear(tick, measured, (estimate, demand), field);
        }
        let seen = (measured, truth.shape_a_per_m);
        self.history.observe(tick, seen, (demand, estimate, field));
        if let Some(turns) = &mut self.turns {
            turns.observe(tick, measured, demand);
        }
        let verdict = &mut self.verdict;
        verdict.field_peak_a_per_m = verdict.field_peak_a_per_m.max(field.field_a_per_m.abs());
        verdict.field_lowest_a_per_m = verdict.field_lowest_a_per_m.min(field.field_a_per_m);
        verdict.field_highest_a_per_m = verdict.field_highest_a_per_m.max(field.field_a_per_m);
        verdict.coil_field_peak_a_per_m = verdict.coil_field_peak_a_per_m.max(coil.field_a_per_m.abs());
        let limit = self.field_limit_a_per_m;
        let lowest = self.lowest_field_a_per_m.unwrap_or(-limit);
        let room = (COIL_MARGIN - 1.0) * limit;
        let outside = |own: f64, room: f64| own > limit + room || own < lowest - room;
        let beyond = outside(field.field_a_per_m, 0.0) || outside(coil.field_a_per_m, room);
        verdict.beyond_limit_ticks += u64::from(beyond);
        let finite = field.field_a_per_m.is_finite() && coil.field_a_per_m.is_finite();
        verdict.broken_field_ticks += u64::from(!finite);
        if !coil.field_a_per_m.is_finite() {
            if verdict.coil_field_not_finite_ticks == 0 {
                verdict.first_coil_field_not_finite_tick = tick;
            }
            verdict.coil_field_not_finite_ticks += 1;
        }
        verdict.temperature_peak_k = verdict.temperature_peak_k.max(truth.temperature_k);
        verdict.guarded_ticks += u64::from(field.status != 0);
        if field.event != 0 && verdict.first_event == 0 {
            (verdict.first_event, verdict.first_event_tick) = (field.event, tick);
        }
        if coil.status & WATCHDOG != 0 {
            if verdict.watchdog_ticks == 0 {
                verdict.first_watchdog_tick = tick;
            }
            verdict.watchdog_ticks += 1;
        }
        verdict.a_estimated_a_per_m = estimate.shape_a_per_m;
        verdict.parameters = EstimatedParameters::of(estimate);
        verdict.a_true_a_per_m = truth.shape_a_per_m;
        verdict.a_final_error_a_per_m = estimate.shape_a_per_m - truth.shape_a_per_m;
        if time_s < self.expect.settling_s {
            return;
        }
        if demand.tick != truth.tick {
            // In real time a controller may leave a tick out; its last reference is not that of now.
            verdict.unjudged_ticks += 1;
            if let Some(spectrum) = &mut self.spectrum {
                spectrum.observe(None);
            }
            return;
        }
        let error_m = demand.reference_m - truth.displacement_m;
        let then_s = time_s - 0.5 * self.tick_s;
        let mut between_m = None;
        if let Some(trajectory) = &self.trajectory {
            if let Some(judge) = &mut self.trajectory_judge {
                let instant = Instant {
                    time_s,
                    reference_m: demand.reference_m,
                    displacement_m: truth.displacement_m,
                };
                judge.observe(trajectory, instant);
            }
            if !counts(trajectory, &self.expect, time_s) {
                verdict.uncounted_ticks += 1;
                return;
            }
            // Once the stated trajectory is not what is wanted, as after a change of its size, nothing is known between.
            self.departed |= (trajectory.position_m(time_s) - demand.reference_m).abs() > ROUNDING_M;
            if !self.departed && then_s >= self.expect.settling_s && counts(trajectory, &self.expect, then_s) {
                between_m = Some((trajectory.position_m(then_s) - truth.displacement_between_m).abs());
            }
        }
        self.samples += 1;
        self.course.observe(tick, error_m);
        if let Some(spectrum) = &mut self.spectrum {
            spectrum.observe(Some([error_m, measured.displacement_m - truth.displacement_m]));
        }
        self.sum_of_squares_m2 += error_m * error_m;
        self.shape_error_sum_of_squares += verdict.a_final_error_a_per_m * verdict.a_final_error_a_per_m;
        if exceeds(error_m.abs(), verdict.error_max_m) {
            (verdict.error_max_m, verdict.error_max_at_s) = (error_m.abs(), time_s);
        }
        let mut largest = (error_m.abs(), time_s, false);
        if let Some(between_m) = between_m {
            self.between.observe(then_s, between_m);
            if exceeds(between_m, largest.0) {
                largest = (between_m, then_s, true);
            }
        }
        let Some(tolerance_m) = tolerance_m else { return };
        let margin_m = tolerance_m - largest.0;
        // What is no number stays: nothing after it makes up for it.
        if verdict
            .least
            .is_none_or(|least| !least.margin_m.is_nan() && exceeds(least.margin_m, margin_m) || margin_m.is_nan())
        {
            verdict.least = Some(LeastMargin {
                margin_m,
                at_s: largest.1,
                tolerance_m,
                between: largest.2,
            });
        }
        if exceeds(largest.0, tolerance_m) && verdict.first_exceeded_at_s.is_none() {
            verdict.first_exceeded_at_s = Some(largest.1);
        }
    }

    /// The verdict so far, in a sentence, and what did not hold.
    pub fn sentence(&self) -> (String, Vec<String>) {
        let (verdict, expect) = (self.verdict(), &self.expect);
        let failures = verdict.failures(expect);
        let sentence = verdict.sentence(&failures, expect.tolerance_m, expect.settling_s);
        (sentence, failures)
    }

    /// The verdict so far.
    pub fn verdict(&self) -> Verdict {
        let mean = |sum: f64| (sum / self.samples.max(1) as f64).sqrt();
        let trajectory = self.trajectory.as_ref();
        let turn_s = trajectory.and_then(|own| Some(own.turns_per_s(self.tick_s)?.recip()));
        // A law has no `a`: what stands in its place in a token means nothing.
        let of_shape = |own: f64| if self.verdict.units.shape { own } else { f64::NAN };
        Verdict {
            error_rms_m: mean(self.sum_of_squares_m2),
            a_error_rms_a_per_m: of_shape(mean(self.shape_error_sum_of_squares)),
            a_final_error_a_per_m: of_shape(self.verdict.a_final_error_a_per_m),
            a_estimated_a_per_m: of_shape(self.verdict.a_estimated_a_per_m),
            a_true_a_per_m: of_shape(self.verdict.a_true_a_per_m),
            judged_ticks: self.samples,
            error_course: self.course.windows(self.tick_s),
            history: self.history.told(self.tick_s, turn_s).with_turns(self.turns.as_ref()),
            between: self.between.error(),
            trajectory: self.trajectory_judge.as_ref().map(CourseJudge::verdict),
            error_lines: self.spectrum.as_ref().map(ErrorSpectrum::lines).unwrap_or_default(),
            error_spectrum: self.spectrum.as_ref().map(ErrorSpectrum::bands).unwrap_or_default(),
            coil_late: self.noticing.as_ref().and_then(Noticing::late),
            noticed: self.noticing.as_ref().map(Noticing::sentences).unwrap_or_default(),
            ..self.verdict.clone()
        }
    }
}

#[cfg(test)]
#[path = "judge_tests.rs"]
mod tests;
