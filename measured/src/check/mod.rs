//! First things first: is a run what its columns say, before any physics is blamed for a gap?
//!
//! Looked for, against the command and against what a nominal model makes of the run: a column with the other sign or in another
//! unit, two columns that changed places ([`labels`]), command and field shifted against each other ([`shift`]), a channel that is
//! cut off or stands still ([`flat`]), and what the reader had to do to the clock. Everything is decided so coarsely that no effect
//! comes near: a sign by a correlation of the other sign, a unit by powers of ten, a shift by an answer that comes before its
//! command, a dead channel by values that repeat to the last digit.

mod finding;
mod flat;
mod labels;
mod shift;

pub use finding::{Finding, FindingKind};
pub use labels::Simulate;

use std::collections::BTreeMap;

use crate::quantity::Quantity;
use crate::run::MeasuredRun;

/// All that is wrong with a run; nothing for one that is as its columns say.
pub fn first_things(run: &MeasuredRun, simulate: &Simulate) -> Vec<Finding> {
    let mut findings: Vec<Finding> = run.repair.iter().map(resampled).collect();
    // What comes next is looked for in the run as it should have been read.
    let labels = labels::check(run, simulate);
    findings.extend(labels.findings);
    let (run, expected) = (&labels.run, &labels.expected);
    match shift::swapped(run) {
        Some(swapped) => findings.push(swapped),
        None => findings.extend(shift::check(run, expected)),
    }
    findings.extend(flat::check(run, expected));
    findings
}

fn resampled(repair: &crate::ClockRepair) -> Finding {
    Finding {
        kind: FindingKind::Resampled,
        channel: Quantity::Time,
        sentence: repair.to_string(),
        amended_columns: Vec::new(),
        evidence: BTreeMap::from([
            ("filled_rows", repair.filled.len() as f64),
            ("gaps", repair.gaps as f64),
            ("jitter_s", repair.jitter_s),
        ]),
    }
}
