//! What a time column is like, told without refusing it.

use serde::Serialize;

use crate::run::{gaps, median_step_s};

/// Gaps that are listed one by one.
const MOST_LISTED: usize = 10;

/// The time of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Clock {
    pub from_s: f64,
    pub to_s: f64,
    /// Median step between rows, s; not above 0 where most rows do not go forward.
    pub step_s: f64,
    /// Steps from the shortest to the longest, those over gaps left out, s.
    pub steps_s: [f64; 2],
    /// Rows that time does not go forward to.
    pub backward: usize,
    pub gaps: usize,
    /// Rows that are missing in all gaps.
    pub missing: u64,
    /// The first gaps.
    pub listed: Vec<ClockGap>,
}

/// Rows that are missing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockGap {
    /// The first row of the file after it, from 0.
    pub row: usize,
    pub from_s: f64,
    pub to_s: f64,
    pub missing: u64,
}

impl Clock {
    /// Of at least two finite times.
    pub(super) fn of(time_s: &[f64]) -> Self {
        let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
        let backward = steps().filter(|step_s| *step_s <= 0.0).count();
        // Where time jumps back, a jump forward is no gap either.
        let found = if backward == 0 { gaps(time_s) } else { Vec::new() };
        let across = |index: &usize| found.binary_search_by_key(&(index + 1), |gap| gap.before).is_ok();
        let within = steps().enumerate().filter(|(index, _)| !across(index));
        let [shortest, longest] = within.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, step_s)| {
            [low.min(step_s), high.max(step_s)]
        });
        Clock {
            from_s: time_s[0],
            to_s: time_s[time_s.len() - 1],
            step_s: median_step_s(time_s),
            steps_s: [shortest, longest],
            backward,
            gaps: found.len(),
            missing: found.iter().fold(0, |sum, gap| gap.missing.saturating_add(sum)),
            listed: found
                .iter()
                .take(MOST_LISTED)
                .map(|gap| ClockGap {
                    row: gap.before,
                    from_s: time_s[gap.before - 1],
                    to_s: time_s[gap.before],
                    missing: gap.missing,
                })
                .collect(),
        }
    }

    /// Rows a second.
    pub fn rate_hz(&self) -> f64 {
        1.0 / self.step_s
    }
}
