//! What the tests of the guard share: its sampling, ordinary settings, and tokens that give it no reason to act.
#![allow(dead_code, reason = "each test file uses its own part of this")]

use anhyst_guard::{GuardSettings, Monitors, Responses, StuckSettings};
use anhyst_ipc::{Demand, Estimate, Now};

pub const TICK_S: f64 = 5e-5;

pub fn settings() -> GuardSettings {
    GuardSettings {
        field_limit_a_per_m: 20_000.0,
        lowest_field_a_per_m: None,
        slew_limit_a_per_m_s: Some(2e8),
        safe_field_a_per_m: 0.0,
        ramp_time_s: 0.005,
        max_age_ticks: 3,
        jump_limit_m: Some(5e-6),
        stuck: Some(StuckSettings {
            ticks: 20,
            field_change_a_per_m: 500.0,
        }),
        monitors: Monitors::default(),
        reactions: Responses::default(),
    }
}

/// Tokens of a healthy controller and estimator.
pub fn others(tick: u64) -> (Now<Demand>, Now<Estimate>) {
    let demand = Demand {
        tick,
        ..Demand::default()
    };
    let estimate = Estimate {
        tick,
        ..Estimate::default()
    };
    (Now(demand), Now(estimate))
}
