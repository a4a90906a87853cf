//! What a run shows beside its verdict: a coil that follows otherwise than believed, what the guard saw, what was learned in vain, an
//! estimate that went as far as it may.

use anhyst_guard::{BelievedCoil, Event, Following, GainAndShift};
use anhyst_ipc::{Demand, Estimate, Measurement, NodeId, SafeField};
use anhyst_scenario::{Late, Scenario};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Memory of how the coil follows, s.
const MEMORY_S: f64 = 1.0;
/// The coil must move by this part of the field's limit, rms.
const MOTION: f64 = 0.005;
/// Gain and shift that are worth telling: a probe is off by some per mille.
const GAIN: f64 = 0.02;
const SHIFT_TICKS: f64 = 0.1;
/// Of the measured field, rms: more that neither gain nor time explains makes both meaningless.
const UNLIKE: f64 = 0.02;
/// Only a delay that is as near to whole ticks is one of the amplifier's.
const WHOLE_TICK: f64 = 0.15;
/// And by so many standard deviations.
const DEVIATIONS: f64 = 5.0;
/// An estimate that stays at an end of its range so long, s, is not on its way through.
const AT_EDGE_S: f64 = 0.1;
/// Of the range: noise takes the estimate off its end again and again.
const NEAR_EDGE: f64 = 0.01;

/// What listens.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Noticing {
    believed: BelievedCoil,
    /// The amplifier is somebody else's.
    foreign: bool,
    /// Of what is believed, its own part.
    amplifier_lag_s: f64,
    following: Following,
    tick_s: f64,
    motion_a_per_m: f64,
    given_a_per_m: f64,
    events: Vec<(u64, u64)>,
    taken_back_ticks: u64,
    at_edge: AtEdge,
}

/// The estimate at an end of its range.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct AtEdge {
    range_a_per_m: (f64, f64),
    /// In a row until now, the longest row, and all.
    now_ticks: u64,
    longest_ticks: u64,
    ticks: u64,
    /// Where it was last.
    shape_a_per_m: f64,
}

impl Noticing {
    /// None where ticks may be missed: nothing would follow then.
    pub fn new(scenario: &Scenario) -> Option<Self> {
        let tick_s = scenario.tick_s;
        let believed = scenario.believed_coil();
        believed.timing.then(|| Self {
            believed,
            foreign: scenario.external_nodes().contains(&NodeId::Amplifier),
            amplifier_lag_s: scenario.amplifier.lag_s(),
            following: Following::new(believed, tick_s, ((MEMORY_S / tick_s) as u64).max(1)),
            tick_s,
            motion_a_per_m: MOTION * scenario.guard.field_limit_a_per_m,
            given_a_per_m: 0.0,
            events: Vec::new(),
            taken_back_ticks: 0,
            at_edge: AtEdge::of(scenario.estimator.law.range_a_per_m()),
        })
    }

    pub fn hear(
        &mut self,
        tick: u64,
        measured: &Measurement,
        (estimate, demand): (&Estimate, &Demand),
        field: &SafeField,
    ) {
        let acts = SafeField::RAMPING | SafeField::SAFE | SafeField::HOLDING;
        // A field on its way to safety is given alike, but is no example of the cut.
        if field.status & acts == 0 {
            let coil = Some(measured.coil_field_a_per_m).filter(|own| own.is_finite());
            self.following.hear(self.given_a_per_m, coil);
        }
        self.given_a_per_m = field.field_a_per_m;
        if field.event != 0 && self.events.iter().all(|(event, _)| *event != field.event) {
            self.events.push((field.event, tick));
        }
        self.taken_back_ticks += u64::from(demand.status & Demand::TAKEN_BACK != 0);
        self.at_edge.hear(estimate);
    }

    /// As sentences, with what to paste.
    pub fn sentences(&self) -> Vec<String> {
        let mut all: Vec<String> = self
            .events
            .iter()
            .filter_map(|(event, tick)| told(*event, *tick))
            .collect();
        all.extend(self.of_coil());
        if self.taken_back_ticks > 0 {
            all.push(format!(
                "learning made it no better, and what was learned was taken back, for {} ticks: see controller.learning",
                self.taken_back_ticks
            ));
        }
        if self.at_edge.longest_ticks as f64 * self.tick_s >= AT_EDGE_S {
            all.push(format!(
                "the estimate of a stood at the end of its range, near {:.0} A/m, for {:.2} s: widen estimator.law.range_a_per_m; where a cannot \
                 be beyond it, the model errs elsewhere, see anhyst diagnose",
                self.at_edge.shape_a_per_m,
                self.at_edge.ticks as f64 * self.tick_s
            ));
        }
        all
    }

    fn found(&self) -> Option<GainAndShift> {
        self.following.gain_and_shift(self.motion_a_per_m)
    }

    /// What makes the coil later than is believed.
    pub fn late(&self) -> Option<Late> {
        let found = self.found()?;
        let shift_ticks = found.shift_ticks;
        if found.left > UNLIKE || shift_ticks < 0.0 || !is_far(shift_ticks, SHIFT_TICKS, found.shift_deviation) {
            return None;
        }
        let whole = shift_ticks.round();
        let of_delay = found.bend - 0.5 * shift_ticks * (shift_ticks - 1.0);
        let of_lag = found.bend - shift_ticks * (shift_ticks - 0.5);
        let is_delay = whole >= 1.0 && (shift_ticks - whole).abs() < WHOLE_TICK && of_delay.abs() < 0.5 * of_lag.abs();
        Some(if is_delay {
            Late::Ticks(whole as u32)
        } else {
            Late::Lag(self.believed.lag_s + shift_ticks * self.tick_s)
        })
    }

    fn of_coil(&self) -> Vec<String> {
        let mut all = Vec::new();
        let Some(found) = self.found() else { return all };
        if found.left > UNLIKE {
            all.push(format!(
                "the coil follows neither by a gain nor late: {:.0} % of its field is something else; limited, slewing, or not there all the time",
                100.0 * found.left
            ));
            return all;
        }
        if is_far(found.gain - 1.0, GAIN, found.gain_deviation) {
            all.push(format!(
                "the coil has {:.4} of the field that the scenario believes: the amplifier's gain, its unit, or the probe's",
                found.gain
            ));
        }
        let by_us = 1e6 * found.shift_ticks.abs() * self.tick_s;
        if let Some(late) = self.late() {
            all.push(format!(
                "the coil is {by_us:.0} µs later than the scenario believes: {}",
                self.remedy(late)
            ));
        } else if is_far(found.shift_ticks, SHIFT_TICKS, found.shift_deviation) {
            all.push(format!(
                "the coil leads what the scenario believes, by {by_us:.0} µs: see amplifier.bandwidth_hz and amplifier.delay_ticks"
            ));
        }
        all
    }

    /// A simulated amplifier is what the scenario says of it: only what is believed may change.
    fn remedy(&self, late: Late) -> String {
        match (late, self.foreign) {
            (Late::Ticks(ticks), true) => {
                let ticks = self.believed.delay_ticks + ticks;
                format!("{ticks} ticks beyond the loop's own fit in all, --set amplifier.delay_ticks={ticks}")
            }
            (Late::Ticks(ticks), false) => {
                let delay_s = f64::from(ticks) * self.tick_s;
                format!("{ticks} ticks fit, LoopDelay(delay_s: {delay_s:.2e}) in `effects`")
            }
            (Late::Lag(lag_s), true) => {
                let bandwidth_hz = (1.0 / (TAU * lag_s)).round();
                format!(
                    "in all a bandwidth_hz of about {bandwidth_hz} fits, --set amplifier.bandwidth_hz={bandwidth_hz:?}"
                )
            }
            (Late::Lag(lag_s), false) => {
                let (bandwidth_hz, own_s) = ((1.0 / (TAU * lag_s)).round(), lag_s - self.amplifier_lag_s);
                format!("{bandwidth_hz} Hz in all fit, AmplifierBandwidth(time_constant_s: {own_s:.2e}) in `effects`")
            }
        }
    }
}

impl AtEdge {
    fn of(range_a_per_m: (f64, f64)) -> Self {
        Self {
            range_a_per_m,
            now_ticks: 0,
            longest_ticks: 0,
            ticks: 0,
            shape_a_per_m: 0.0,
        }
    }

    fn hear(&mut self, estimate: &Estimate) {
        let (lower, upper) = self.range_a_per_m;
        let near = NEAR_EDGE * (upper - lower);
        // A fixed estimate has no range to be at the end of.
        let inside = estimate.shape_a_per_m > lower + near && estimate.shape_a_per_m < upper - near;
        if inside || near <= 0.0 {
            self.now_ticks = 0;
            return;
        }
        self.now_ticks += 1;
        self.ticks += 1;
        self.longest_ticks = self.longest_ticks.max(self.now_ticks);
        self.shape_a_per_m = estimate.shape_a_per_m;
    }
}

fn is_far(value: f64, least: f64, deviation: f64) -> bool {
    value.abs() > least + DEVIATIONS * deviation
}

/// What an event of the guard means for the rig.
fn told(event: u64, tick: u64) -> Option<String> {
    let meaning = match Event::from_number(event)? {
        Event::CoilReversed => {
            "the coil's field has the other sign than the one asked for: turn the coil's leads or the amplifier's sign round"
        }
        Event::CoilStuck => {
            "the coil's field does not move with the one asked for: amplifier off, coil open, or probe dead"
        }
        Event::CoilScaled => {
            "the coil's field is another multiple of the one asked for: a unit (A/m, kA/m, Oe) or a gain"
        }
        Event::CoilLate => {
            "the coil's field comes later than believed: see amplifier.delay_ticks and amplifier.bandwidth_hz"
        }
        Event::CoilEarly => {
            "the coil's field comes earlier than believed: see amplifier.delay_ticks and amplifier.bandwidth_hz"
        }
        Event::ErrorDiverging => {
            "the error grew larger than the profile itself: the loop is unstable, its sensor or amplifier lies, or the model is another actuator's"
        }
        event if event.is_fault() => return Some(format!("the guard saw {event} in tick {tick}: see docs/safety.md")),
        _ => return None,
    };
    Some(format!("{meaning} (guard, tick {tick})"))
}
