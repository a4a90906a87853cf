//! Channels that repeat a value to the last digit while what they measure moves: cut off at an end of the range, or stuck.
//!
//! A converter at its end repeats its last value, and the signal enters it at full slope (a material that saturates slows down first); a
//! recorder that hangs repeats any value and then jumps (a backlash lets go gently). What a stretch should have moved by is told by the
//! command, for the field, and by the model, for an output.

use std::collections::BTreeMap;
use std::ops::Range;

use super::finding::{Expected, Finding, FindingKind, pasted};
use crate::quantity::Quantity;
use crate::resolution::resolution;
use crate::run::{MeasuredRun, correlation};
use crate::sweep::extremes;

/// Fewest repeated values.
const MIN_ROWS: usize = 8;
/// Share of its range by which the expected series moves at least.
const MOVES: f64 = 0.04;
/// A lattice coarser than this share of the range repeats values by itself.
const COARSE: f64 = 0.01;
/// Slope before a cut, as a share of the whole series'.
const AT_FULL_SLOPE: f64 = 0.3;
/// Jump behind a stuck stretch, as a share of what was missed.
const JUMP: f64 = 0.4;
/// What is expected must be like what was measured.
const ALIKE: f64 = 0.5;

pub(super) fn check(run: &MeasuredRun, expected: &[Expected]) -> Vec<Finding> {
    let channels = expected.iter().flat_map(|expected| {
        // Of a magnetization made from flux density the instrument is the flux's.
        let own = if run.is_derived(expected.of) {
            Quantity::FluxDensity
        } else {
            expected.of
        };
        one(run, own, &expected.series)
    });
    channels.collect()
}

fn one(run: &MeasuredRun, channel: Quantity, expected: &[f64]) -> Vec<Finding> {
    let Some(measured) = run.series(channel).filter(|own| own.len() == expected.len()) else {
        return Vec::new();
    };
    let (low, high) = extremes(measured);
    let (least, most) = extremes(expected);
    // In measured units a unit of what is expected.
    let slope = (high - low) / (most - least);
    let coarse = resolution(measured).is_some_and(|step| step > COARSE * (high - low));
    if coarse || correlation(measured, expected) < ALIKE {
        return Vec::new();
    }
    let moved = |rows: &Range<usize>| {
        let (from, to) = extremes(&expected[rows.clone()]);
        to - from
    };
    let still: Vec<Range<usize>> = repeats(measured)
        .into_iter()
        .filter(|rows| moved(rows) > MOVES * (most - least))
        .collect();
    let change = |series: &[f64], from: usize, to: usize| (series[to] - series[from]).abs();
    let enters = |rows: &Range<usize>| {
        let (before, first) = (rows.start.saturating_sub(MIN_ROWS), rows.start);
        change(measured, before, first) > AT_FULL_SLOPE * slope * change(expected, before, first)
    };
    let jumps = |rows: &Range<usize>| {
        let missed = change(expected, rows.start, rows.end - 1).max(0.5 * moved(rows));
        rows.end < measured.len() && change(measured, rows.start, rows.end) > JUMP * slope * missed
    };
    let to_the_end = |rows: &Range<usize>| rows.end == measured.len();
    let at = |value: f64| still.iter().filter(move |rows| measured[rows.start] == value);
    let (mut found, mut ends) = (Vec::new(), Vec::new());
    for end in [low, high] {
        // A recorder may hang at the largest value too.
        if at(end).any(|rows| enters(rows) && !jumps(rows)) {
            let cut: Vec<Range<usize>> = at(end).cloned().collect();
            found.push(finding(run, channel, FindingKind::Saturated, &cut, end));
            ends.push(end);
        }
    }
    let hangs = |rows: &&Range<usize>| {
        let value = measured[rows.start];
        jumps(rows) && !ends.contains(&value) || to_the_end(rows) && ![low, high].contains(&value)
    };
    let stuck: Vec<Range<usize>> = still.iter().filter(hangs).cloned().collect();
    if let Some(first) = stuck.first() {
        found.push(finding(run, channel, FindingKind::Stuck, &stuck, measured[first.start]));
    }
    found
}

/// Stretches of one value.
fn repeats(series: &[f64]) -> Vec<Range<usize>> {
    let (mut found, mut first) = (Vec::new(), 0);
    for sample in 1..=series.len() {
        if sample == series.len() || series[sample] != series[first] {
            if sample - first >= MIN_ROWS {
                found.push(first..sample);
            }
            first = sample;
        }
    }
    found
}

fn finding(run: &MeasuredRun, channel: Quantity, kind: FindingKind, stretches: &[Range<usize>], value: f64) -> Finding {
    let rows: usize = stretches.iter().map(ExactSizeIterator::len).sum();
    let (name, unit) = (channel.name(), channel.unit());
    let first = run.rows[stretches[0].start];
    let times = match stretches.len() {
        1 => "once".to_owned(),
        times => format!("{times} times"),
    };
    let said = match kind {
        FindingKind::Saturated => format!("is cut off at {value:.4e} {unit}"),
        _ => format!("is stuck at {value:.4e} {unit}"),
    };
    // Beside a command the field can be done without.
    let amended_columns: Vec<String> = (channel == Quantity::Field && run.series(Quantity::FieldCommand).is_some())
        .then(|| format!("{}=-", channel.key()))
        .into_iter()
        .collect();
    let remedy = if amended_columns.is_empty() {
        "Keep what is sound with --rows, or measure it again".to_owned()
    } else {
        format!("Leave it out with {}", pasted(&amended_columns))
    };
    Finding {
        kind,
        channel,
        sentence: format!(
            "the {name} {said}, {times}, {rows} rows in all, first in row {first}, while it should move. {remedy}"
        ),
        amended_columns,
        evidence: BTreeMap::from([
            ("rows", rows as f64),
            ("times", stretches.len() as f64),
            ("value", value),
        ]),
    }
}
