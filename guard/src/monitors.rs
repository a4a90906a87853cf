//! What the guard watches beyond freshness and the displacement: limits that a scenario may set. Each is off unless given.
//!
//! Current: H = n·I, H the coil's field (A/m), I the current (A), n the coil constant (1/m). Temperature in K, error in m.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Further monitors of the guard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Monitors {
    /// Hottest measured temperature of the rod. Needs a thermometer: 0 K is "none fitted" and exceeds nothing.
    pub temperature_limit_k: Option<f64>,
    /// Largest current of the coil.
    pub current: Option<CurrentMonitor>,
    /// Largest tracking error.
    pub tracking: Option<TrackingMonitor>,
    /// When the estimate is not to be used.
    pub estimate: Option<EstimateMonitor>,
    /// So many ticks in a row without the command or the measurement of the tick are a fault.
    pub deadline_misses: Option<u64>,
    /// Whether an error larger than the reference itself is a fault.
    pub diverging: bool,
    /// When a coil that does not follow is a fault.
    pub coil: CoilWatching,
    /// A held field goes on to the safe field after this time.
    pub hold_at_most_s: f64,
    /// Instants at which the guard is asked to come back, as an operator would.
    pub reset_at_s: Vec<f64>,
}

/// When the coil's measured field is held against the one given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CoilWatching {
    /// Where amplifier or plant are somebody else's.
    #[default]
    Foreign,
    /// Always.
    On,
    /// Never.
    Off,
}

/// Limits of the coil's current.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurrentMonitor {
    /// Field per current of the coil, n = H/I.
    pub coil_constant_per_m: f64,
    /// No more is ever asked of the amplifier.
    pub limit_a: f64,
    /// A measured field that means more is a fault: the amplifier does not do what it is told.
    pub trip_a: f64,
}

/// Bound of the tracking error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackingMonitor {
    /// Largest magnitude of reference minus measured displacement.
    pub error_limit_m: f64,
    /// So many ticks in a row beyond it are a fault.
    #[serde(default = "one")]
    pub after_ticks: u64,
    /// So long after the start, and after each way back, errors do not count: a loop needs time to settle.
    #[serde(default)]
    pub settling_s: f64,
}

/// When the estimate of `a` is not to be used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimateMonitor {
    /// Smallest and largest credible `a`.
    pub range_a_per_m: (f64, f64),
    /// So many ticks in a row without information are a fault; none: never.
    #[serde(default)]
    pub uninformed_ticks: Option<u64>,
}

fn one() -> u64 {
    1
}

impl Default for Monitors {
    fn default() -> Self {
        Self {
            temperature_limit_k: None,
            current: None,
            tracking: None,
            estimate: None,
            deadline_misses: None,
            diverging: true,
            coil: CoilWatching::Foreign,
            hold_at_most_s: 0.1,
            reset_at_s: Vec::new(),
        }
    }
}

impl Monitors {
    /// Refuses limits that nothing real can have.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub(crate) fn validate(&self) -> Result<(), Invalid> {
        if let Some(limit_k) = self.temperature_limit_k {
            Invalid::unless_between("temperature_limit_k", limit_k, 1.0, 2000.0, "K")?;
        }
        if let Some(current) = &self.current {
            let constant = current.coil_constant_per_m;
            Invalid::unless_between("current.coil_constant_per_m", constant, 1e-3, 1e9, "1/m")?;
            Invalid::unless_between("current.limit_a", current.limit_a, 1e-9, 1e6, "A")?;
            Invalid::unless_between("current.trip_a", current.trip_a, current.limit_a, 1e6, "A")?;
        }
        if let Some(tracking) = &self.tracking {
            Invalid::unless_positive("tracking.error_limit_m", tracking.error_limit_m, "m")?;
            Invalid::unless_between("tracking.settling_s", tracking.settling_s, 0.0, 1e9, "s")?;
            at_least_one("tracking.after_ticks", tracking.after_ticks)?;
        }
        if let Some(estimate) = &self.estimate {
            let (least, most) = estimate.range_a_per_m;
            Invalid::unless_positive("estimate.range_a_per_m", least, "A/m")?;
            Invalid::unless_between("estimate.range_a_per_m", most, least, 1e12, "A/m")?;
            if let Some(ticks) = estimate.uninformed_ticks {
                at_least_one("estimate.uninformed_ticks", ticks)?;
            }
        }
        if let Some(ticks) = self.deadline_misses {
            at_least_one("deadline_misses", ticks)?;
        }
        Invalid::unless_between("hold_at_most_s", self.hold_at_most_s, 0.0, 3600.0, "s")?;
        self.reset_at_s
            .iter()
            .try_for_each(|at_s| Invalid::unless_between("reset_at_s", *at_s, 0.0, 1e9, "s"))
    }
}

fn at_least_one(path: &str, ticks: u64) -> Result<(), Invalid> {
    if ticks > 0 {
        return Ok(());
    }
    Err(Invalid::new(
        path,
        "0 ticks would be a fault at once and always; give at least 1",
    ))
}
