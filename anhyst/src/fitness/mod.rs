//! What is measured of a rig before anything of it is estimated, small to large and under the guard, and whether it is fit for more:
//! the sensor at rest, amplifier and coil, the way from demand to sensor with the loop's margins on it.
//!
//! Each is an open-loop run of the scenario's processes as they are, and a judgement of its tokens.

pub mod amplifier;
pub mod response;
pub mod rest;

use anhyst_conformance::amplifier::{Check, checks_table};
use anhyst_controller::TrajectorySettings;
use anhyst_guard::CoilWatching;
use anhyst_report::page::Section;
use anhyst_report::table::{Cell, Verdict};
use anhyst_scenario::{Expect, Scenario};
use serde::Serialize;

/// An error above this part of the profile is no tracking.
pub const TRACKS: f64 = 0.05;
/// Of the profile, in the first motions.
pub const SMALL: f64 = 0.2;

/// What a step came to.
#[derive(Debug, Serialize)]
pub struct Step {
    /// What was measured.
    pub name: &'static str,
    /// Figures with their limits.
    pub checks: Vec<Check>,
    /// In sentences.
    #[serde(skip)]
    pub findings: Vec<String>,
    /// Why the rig is not fit.
    pub refusal: Option<String>,
    #[serde(skip)]
    pub section: Section,
}

impl Step {
    /// Those of `checks` whose name is in `fatal` refuse the rig where they do not hold; others are findings.
    pub fn new(name: &'static str, checks: Vec<Check>, fatal: &[&str]) -> Self {
        let failed = || checks.iter().filter(|check| !check.passed);
        let refusal = failed().find(|check| fatal.contains(&check.name));
        let refusal = refusal.map(|check| format!("{name}: {}", check.sentence));
        let minor = failed().filter(|check| !fatal.contains(&check.name));
        let findings = minor.map(|check| format!("{name}: {}", check.sentence)).collect();
        let mut table = checks_table(&checks);
        table.header.push("what it says".to_owned());
        for (row, check) in table.rows.iter_mut().zip(&checks) {
            row.push(Cell::Words(check.sentence.clone()));
        }
        let colour = match (&refusal, checks.iter().all(|check| check.passed)) {
            (Some(_), _) => (Verdict::Fail, "not fit"),
            (None, true) => (Verdict::Pass, "fit"),
            (None, false) => (Verdict::Pass, "fit, with findings"),
        };
        let heading = name[..1].to_uppercase() + &name[1..];
        Self {
            name,
            findings,
            refusal,
            section: Section::new(&heading).badge(colour.0, colour.1).table(table),
            checks,
        }
    }
}

/// The scenario with nothing followed, nothing learned and nothing expected, for so long.
fn open_loop(of: &Scenario, duration_s: f64) -> Scenario {
    let mut own = of.clone();
    let controller = &mut own.controller;
    controller.trajectory = TrajectorySettings::Rest;
    (controller.start_s, controller.feedback, controller.learning) = (0.0, None, None);
    own.duration_s = duration_s;
    own.expect = Expect {
        settling_s: 0.5 * duration_s,
        ..Expect::NONE
    };
    let monitors = &mut own.guard.monitors;
    monitors.coil = CoilWatching::On;
    // Nothing is followed, and an error is nothing that could grow.
    (monitors.diverging, monitors.tracking) = (false, None);
    own.recording.ring_s = None;
    own
}
