//! The checks of what the guard hears. No feedback, no model: finite, fresh, not jumping, not stuck, within bounds.

use crate::believed::BelievedCoil;
use crate::coil::CoilWatch;
use crate::monitors::{EstimateMonitor, TrackingMonitor};
use crate::settings::DIVERGING_TICKS;
use crate::{Event, GuardSettings};
use serde::{Deserialize, Serialize};

/// Of one token: is every number finite, what is its tick, and how far is that from this one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quality {
    pub finite: bool,
    pub tick: u64,
    pub age_ticks: u64,
}

/// What the guard heard in one tick, freed from its messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    pub tick: u64,
    pub command: Quality,
    pub measurement: Quality,
    pub demand: Quality,
    pub estimate: Quality,
    /// The field asked for.
    pub command_a_per_m: f64,
    /// Measured displacement of the tip.
    pub displacement_m: f64,
    /// Measured field of the coil.
    pub coil_field_a_per_m: f64,
    /// Measured temperature of the rod; 0 where no sensor is fitted.
    pub temperature_k: f64,
    /// Tracking error.
    pub error_m: f64,
    /// Estimated shape parameter.
    pub shape_a_per_m: f64,
    /// Whether the recent motion tells the estimator something; none where it had no measurement to tell by.
    pub informed: Option<bool>,
}

/// Faults of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Faults(u64);

impl Faults {
    fn note(&mut self, fault: bool, event: Event) {
        self.0 |= u64::from(fault) << event.number();
    }

    /// All of them, in the order of their numbers.
    pub fn iter(self) -> impl Iterator<Item = Event> {
        // As a rule there is none.
        let most = if self.0 == 0 { 0 } else { Event::ALL.len() };
        Event::ALL
            .into_iter()
            .take(most)
            .filter(move |event| self.0 >> event.number() & 1 == 1)
    }
}

/// What the checks remember: the displacement last heard and since when it has been the same, and what has gone on how long.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Watch {
    /// With the tick that it was measured at.
    displacement_m: Option<(u64, f64)>,
    repetitions: u64,
    field_when_changed_a_per_m: f64,
    misses: u64,
    beyond_bound_ticks: u64,
    /// Mean square of the error, forgotten in `DIVERGING_TICKS`.
    mean_square_m2: f64,
    reference_m: Option<f64>,
    coil: Option<CoilWatch>,
    uninformed_ticks: u64,
}

/// Errors count as no more than this multiple of the reference.
const MOST: f64 = 2.0;

/// What is believed of the loop, by those who know more than the guard.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Beliefs {
    /// How far the reference goes, m: an error beyond it is none of tracking. None: it goes nowhere.
    pub reference_m: Option<f64>,
    /// The amplifier, where it is to be watched.
    pub coil: Option<BelievedCoil>,
}

/// Counts ticks in a row.
fn count(counter: &mut u64, goes_on: bool) -> u64 {
    *counter = if goes_on { counter.saturating_add(1) } else { 0 };
    *counter
}

impl Watch {
    pub fn believing(&mut self, beliefs: &Beliefs, limit_a_per_m: f64, tick_s: f64) {
        self.reference_m = beliefs.reference_m;
        self.coil = beliefs.coil.map(|coil| CoilWatch::new(coil, limit_a_per_m, tick_s));
    }

    /// Looks at what was heard while `field_a_per_m` is the field last given and commands have been followed for
    /// `following_s`; while they are not followed there is no tracking to judge.
    pub fn look(
        &mut self,
        settings: &GuardSettings,
        observed: &Observation,
        field_a_per_m: f64,
        following_s: Option<f64>,
    ) -> Faults {
        let mut faults = Faults::default();
        let most = settings.max_age_ticks;
        for (quality, not_finite, stale) in [
            (observed.command, Event::CommandNotFinite, Event::CommandStale),
            (
                observed.measurement,
                Event::MeasurementNotFinite,
                Event::MeasurementStale,
            ),
            (observed.demand, Event::DemandNotFinite, Event::DemandStale),
            (observed.estimate, Event::EstimateNotFinite, Event::EstimateStale),
        ] {
            faults.note(!quality.finite, not_finite);
            faults.note(quality.age_ticks > most, stale);
        }
        self.look_at_deadlines(settings, observed, &mut faults);
        if observed.measurement.finite && observed.measurement.age_ticks <= most {
            self.look_at_displacement(settings, observed, field_a_per_m, &mut faults);
            look_at_coil(settings, observed, &mut faults);
        } else {
            // The next usable value is no neighbour of the last one.
            self.displacement_m = None;
        }
        if let Some(tracking) = &settings.monitors.tracking {
            self.look_at_error(tracking, observed, following_s, &mut faults);
        }
        self.look_whether_it_diverges(settings, observed, following_s.is_some(), &mut faults);
        let measured = observed.measurement.finite && observed.measurement.age_ticks == 0;
        if let Some(coil) = &mut self.coil {
            let measured = measured.then_some(observed.coil_field_a_per_m);
            if let Some(event) = coil.look(observed.tick, field_a_per_m, measured) {
                faults.note(true, event);
            }
        }
        if let Some(estimate) = &settings.monitors.estimate {
            self.look_at_estimate(estimate, observed, &mut faults);
        }
        faults
    }

    fn look_at_deadlines(&mut self, settings: &GuardSettings, observed: &Observation, faults: &mut Faults) {
        let missed = observed.command.age_ticks > 0 || observed.measurement.age_ticks > 0;
        let misses = count(&mut self.misses, missed);
        let most = settings.monitors.deadline_misses;
        faults.note(most.is_some_and(|most| misses >= most), Event::DeadlineMissed);
    }

    fn look_at_displacement(
        &mut self,
        settings: &GuardSettings,
        observed: &Observation,
        field_a_per_m: f64,
        faults: &mut Faults,
    ) {
        let measured_at = observed.measurement.tick;
        let before = self.displacement_m.replace((measured_at, observed.displacement_m));
        // A token that is read twice says nothing about the sensor.
        let repeated = before.is_some_and(|(_, value)| value.to_bits() == observed.displacement_m.to_bits());
        if !repeated {
            self.repetitions = 0;
            self.field_when_changed_a_per_m = field_a_per_m;
        } else if observed.measurement.age_ticks == 0 {
            self.repetitions = self.repetitions.saturating_add(1);
        }
        let jumped = settings
            .jump_limit_m
            .zip(before)
            .is_some_and(|(limit_m, (tick, value))| {
                // Tokens may be missing between the two: the tip had their ticks to move in.
                let ticks = measured_at.abs_diff(tick).max(1);
                (observed.displacement_m - value).abs() > limit_m * ticks as f64
            });
        faults.note(jumped, Event::DisplacementJump);
        let field_change = (field_a_per_m - self.field_when_changed_a_per_m).abs();
        let stuck = settings
            .stuck
            .is_some_and(|stuck| self.repetitions >= stuck.ticks && field_change >= stuck.field_change_a_per_m);
        faults.note(stuck, Event::DisplacementStuck);
    }

    fn look_at_error(
        &mut self,
        tracking: &TrackingMonitor,
        observed: &Observation,
        following_s: Option<f64>,
        faults: &mut Faults,
    ) {
        let counts = following_s.is_some_and(|time_s| time_s >= tracking.settling_s);
        // What is not finite has its own event.
        let beyond = counts && observed.demand.finite && observed.error_m.abs() > tracking.error_limit_m;
        let ticks = count(&mut self.beyond_bound_ticks, beyond);
        faults.note(ticks >= tracking.after_ticks, Event::TrackingLost);
    }

    fn look_whether_it_diverges(
        &mut self,
        settings: &GuardSettings,
        observed: &Observation,
        following: bool,
        faults: &mut Faults,
    ) {
        let Some(reference_m) = self.reference_m.filter(|_| settings.monitors.diverging) else {
            return;
        };
        if !following {
            self.mean_square_m2 = 0.0;
        } else if observed.demand.finite {
            // A spike is no error that grows.
            let error_m = observed.error_m.abs().min(MOST * reference_m);
            self.mean_square_m2 += (error_m * error_m - self.mean_square_m2) / DIVERGING_TICKS as f64;
        }
        faults.note(self.mean_square_m2 > reference_m * reference_m, Event::ErrorDiverging);
    }

    fn look_at_estimate(&mut self, monitor: &EstimateMonitor, observed: &Observation, faults: &mut Faults) {
        let (least, most) = monitor.range_a_per_m;
        let outside = observed.estimate.finite && !(least..=most).contains(&observed.shape_a_per_m);
        faults.note(outside, Event::EstimateOutside);
        if let Some(informed) = observed.informed {
            count(&mut self.uninformed_ticks, !informed);
        }
        let most = monitor.uninformed_ticks;
        let uninformed = most.is_some_and(|most| self.uninformed_ticks >= most);
        faults.note(uninformed, Event::EstimateUninformed);
    }
}

fn look_at_coil(settings: &GuardSettings, observed: &Observation, faults: &mut Faults) {
    let limit_k = settings.monitors.temperature_limit_k;
    let hot = limit_k.is_some_and(|limit| observed.temperature_k > limit);
    faults.note(hot, Event::TemperatureExceeded);
    let over = settings
        .monitors
        .current
        .is_some_and(|current| observed.coil_field_a_per_m.abs() > current.trip_a * current.coil_constant_per_m);
    faults.note(over, Event::CurrentExceeded);
}
