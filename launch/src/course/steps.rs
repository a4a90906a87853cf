//! Step by step: settling time, from the step's beginning until the displacement stays within the tolerance of the new level,
//! and overshoot, how far it goes beyond that level.

use super::instant::Instant;
use crate::any_number;
use crate::any_number::exceeds;
use anhyst_controller::{Step, Steps};
use anhyst_report::number::Si;
use anhyst_scenario::Expect;
use serde::{Deserialize, Serialize};

/// What came of the steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepsVerdict {
    /// In their order; those that repeat stand here once, with the worst of each.
    pub steps: Vec<StepVerdict>,
}

/// What came of one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepVerdict {
    /// Level before it.
    pub from_m: f64,
    /// Level after it.
    pub to_m: f64,
    /// How long the reference takes.
    pub over_s: f64,
    /// How often it was seen from its beginning on.
    pub times: u64,
    /// How often it had not settled when the next one began, or at the end.
    pub unsettled: u64,
    /// Longest settling time from the step's beginning on; none where no tolerance is stated, or it never settled.
    pub settling_s: Option<f64>,
    /// Largest way beyond the new level.
    #[serde(with = "any_number")]
    pub overshoot_m: f64,
}

/// A step while it is seen.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Seen {
    place: usize,
    since_s: f64,
    /// Seen from its beginning on.
    whole: bool,
    /// Since its beginning, when it was outside last; none: never.
    outside_s: Option<f64>,
    #[serde(with = "any_number")]
    beyond_m: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct StepsJudge {
    tolerance_m: Option<f64>,
    tick_s: f64,
    steps: Vec<StepVerdict>,
    seen: Option<Seen>,
}

impl StepsJudge {
    pub fn new(steps: &Steps, tolerance_m: Option<f64>, tick_s: f64) -> Self {
        let unseen = |step: &Step| StepVerdict {
            from_m: step.from_m,
            to_m: step.to_m,
            over_s: step.over_s,
            times: 0,
            unsettled: 0,
            settling_s: None,
            overshoot_m: 0.0,
        };
        Self {
            tolerance_m,
            tick_s,
            steps: steps.steps().iter().map(unseen).collect(),
            seen: None,
        }
    }

    pub fn observe(&mut self, steps: &Steps, now: Instant) {
        let Some((place, since_s)) = steps.begun(now.time_s) else {
            return;
        };
        let goes_on = self.seen.filter(|seen| seen.place == place && seen.since_s <= since_s);
        let mut seen = goes_on.unwrap_or_else(|| {
            if let Some(seen) = self.seen {
                seen.told(&mut self.steps, self.tolerance_m, self.tick_s);
            }
            Seen {
                place,
                since_s,
                // The quotient's own rounding is no tick.
                whole: since_s < 1.001 * self.tick_s,
                outside_s: None,
                beyond_m: 0.0,
            }
        });
        let step = self.steps[place];
        let off_m = now.displacement_m - step.to_m;
        seen.since_s = since_s;
        if self.tolerance_m.is_some_and(|most| exceeds(off_m.abs(), most)) {
            seen.outside_s = Some(since_s);
        }
        let beyond_m = off_m * (step.to_m - step.from_m).signum();
        if exceeds(beyond_m, seen.beyond_m) {
            seen.beyond_m = beyond_m;
        }
        self.seen = Some(seen);
    }

    /// The one that is seen just now included.
    pub fn verdict(&self) -> StepsVerdict {
        let mut steps = self.steps.clone();
        if let Some(seen) = self.seen {
            seen.told(&mut steps, self.tolerance_m, self.tick_s);
        }
        StepsVerdict { steps }
    }
}

impl Seen {
    fn told(&self, steps: &mut [StepVerdict], tolerance_m: Option<f64>, tick_s: f64) {
        if !self.whole {
            return;
        }
        let step = &mut steps[self.place];
        step.times += 1;
        if exceeds(self.beyond_m, step.overshoot_m) {
            step.overshoot_m = self.beyond_m;
        }
        let settled_s = self.outside_s.map_or(0.0, |outside_s| outside_s + tick_s);
        if settled_s > self.since_s {
            step.unsettled += 1;
        } else if tolerance_m.is_some() {
            step.settling_s = Some(step.settling_s.unwrap_or(0.0).max(settled_s));
        }
    }
}

impl StepVerdict {
    /// Overshoot as a share of the step.
    pub fn overshoot(&self) -> f64 {
        self.overshoot_m / (self.to_m - self.from_m).abs()
    }
}

impl StepsVerdict {
    pub(super) fn refuse(&self, expect: &Expect, unit: &str, failures: &mut Vec<String>) {
        let worst = |one: &&StepVerdict, other: &&StepVerdict| one.overshoot().total_cmp(&other.overshoot());
        let Some(step) = self.steps.iter().filter(|step| step.times > 0).max_by(worst) else {
            failures.push("not one step was seen from its beginning on after the settling time".to_owned());
            return;
        };
        if let Some(most) = expect.overshoot.filter(|most| exceeds(step.overshoot(), *most)) {
            failures.push(format!(
                "the step from {} to {} overshoots by {:.3} of it, more than {most}",
                Si(step.from_m, unit),
                Si(step.to_m, unit),
                step.overshoot()
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CourseJudge, CourseVerdict};
    use super::*;
    use anhyst_controller::{StepsSettings, Trajectory, TrajectorySettings};
    use std::f64::consts::PI;

    const TICK_S: f64 = 1e-5;
    const EXPECT: Expect = Expect {
        tolerance_m: Some(0.4e-6),
        ..Expect::NONE
    };

    /// Guards settling time and overshoot: a second-order response to a step of ±20 µm, h·(1 − e^(−ζωt)·(cos ω_d·t + ζω/ω_d·sin ω_d·t)),
    /// overshoots by e^(−πζ/√(1 − ζ²)), and its envelope h/√(1 − ζ²)·e^(−ζωt) is within the tolerance from ln(h/(e·√(1 − ζ²)))/ζω on.
    #[test]
    fn a_second_order_response_has_its_overshoot_and_settling_time() {
        let settings = TrajectorySettings::Steps(StepsSettings {
            levels_m: vec![0.0, 20e-6],
            dwell_s: 0.05,
            over_s: 4e-4,
            velocity_limit_m_per_s: None,
            acceleration_limit_m_per_s2: None,
            repeat: true,
        });
        let trajectory = Trajectory::load(&settings, 0.0, TICK_S, std::path::Path::new(".")).unwrap();
        let anhyst_controller::Course::Steps(steps) = trajectory.course() else {
            panic!("no steps")
        };
        let (damping, omega) = (0.3_f64, 2000.0_f64);
        let slowed = (1.0 - damping * damping).sqrt();
        let response = |time_s: f64| {
            let angle = omega * slowed * time_s;
            1.0 - (-damping * omega * time_s).exp() * (angle.cos() + damping / slowed * angle.sin())
        };
        let mut judge = CourseJudge::new(&trajectory, &EXPECT, TICK_S).unwrap();
        for tick in 0..32_000 {
            let time_s = f64::from(tick) * TICK_S;
            let displacement_m = steps.begun(time_s).map_or(0.0, |(place, since_s)| {
                let step = steps.steps()[place];
                step.from_m + (step.to_m - step.from_m) * response(since_s)
            });
            let reference_m = trajectory.at(time_s).position_m;
            judge.observe(
                &trajectory,
                Instant {
                    time_s,
                    reference_m,
                    displacement_m,
                },
            );
        }
        let CourseVerdict::Steps(verdict) = judge.verdict() else {
            panic!("no steps")
        };
        let overshoot = (-PI * damping / slowed).exp();
        // The last extremum of the response outside the tolerance is at a multiple of π/ω_d; it comes back in soon after.
        let envelope_s = (20e-6 / (EXPECT.tolerance_m.unwrap() * slowed)).ln() / (damping * omega);
        let half_turn_s = PI / (omega * slowed);
        for step in &verdict.steps {
            assert!(step.times >= 2 && step.unsettled == 0, "{step:?}");
            assert!(
                (step.overshoot() / overshoot - 1.0).abs() < 1e-3,
                "{step:?}, not {overshoot}"
            );
            let settling_s = step.settling_s.unwrap();
            assert!(
                (envelope_s - half_turn_s..=envelope_s + TICK_S).contains(&settling_s),
                "{settling_s} s, {envelope_s} s"
            );
            // Exactly: outside at the last tick before, inside from there on.
            let off = |time_s: f64| 20e-6 * (response(time_s) - 1.0).abs();
            assert!(off(settling_s - 1.5 * TICK_S) > 0.4e-6 && off(settling_s + TICK_S) < 0.4e-6);
        }
        let most = |overshoot: f64| Expect {
            overshoot: Some(overshoot),
            ..EXPECT
        };
        assert_eq!(verdict_failures(&verdict, most(1.01 * overshoot)), 0);
        assert_eq!(verdict_failures(&verdict, most(0.99 * overshoot)), 1);
    }

    fn verdict_failures(verdict: &StepsVerdict, expect: Expect) -> usize {
        CourseVerdict::Steps(verdict.clone()).failures(&expect, "m").len()
    }
}
