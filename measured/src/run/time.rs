//! Is the time of a run what a sampled system needs: strictly increasing, without gaps, uniform?
//!
//! The tick is the slope of time over sample number (least squares). A step of more than 1.5 median steps is a gap.
//! A sample may stand off the uniform clock by a tenth of a tick, or by half of the last digit in which times are
//! written: an actuator that moves 40 µm at 50 Hz passes 1.3 µm per 0.1 ms, so a tenth of that already is 0.1 µm.

use super::selection::Selection;
use crate::columns::Column;
use crate::error::MeasuredError;
use crate::quantity::Quantity;
use crate::resolution::resolution;

/// A step longer than this many median steps is a gap.
const GAP_STEPS: f64 = 1.5;
/// Largest distance from the uniform clock, in ticks.
const JITTER_TICKS: f64 = 0.1;

/// Refuses time that repeats or runs back.
pub(super) fn refuse_disorder(selection: &Selection, time_s: &[f64]) -> Result<(), MeasuredError> {
    let Some(index) = time_s.windows(2).position(|pair| pair[1] <= pair[0]) else {
        return Ok(());
    };
    let (previous, value) = (time_s[index], time_s[index + 1]);
    let place = selection.sheet.place(selection.rows[index + 1], column(selection)?);
    Err(if value == previous {
        let repeats = time_s.windows(2).filter(|pair| pair[1] == pair[0]).count();
        MeasuredError::TimeRepeats { place, value, repeats }
    } else {
        MeasuredError::TimeRunsBack { place, value, previous }
    })
}

/// The interval between samples, or why there is none.
pub(super) fn uniform_tick_s(selection: &Selection, time_s: &[f64]) -> Result<f64, MeasuredError> {
    let median_s = median_step_s(time_s);
    let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let gaps: Vec<usize> = steps()
        .enumerate()
        .filter(|(_, step_s)| *step_s > GAP_STEPS * median_s)
        .map(|(index, _)| index + 1)
        .collect();
    if let Some(&first) = gaps.first() {
        return Err(gap(selection, time_s, median_s, first, &gaps)?);
    }
    let (start_s, tick_s) = clock(time_s);
    let off_s = |index: usize| (time_s[index] - start_s - index as f64 * tick_s).abs();
    let worst = (0..time_s.len())
        .max_by(|one, other| off_s(*one).total_cmp(&off_s(*other)))
        .unwrap_or(0);
    let written_s = resolution(time_s).unwrap_or(0.0);
    // A file that writes few digits is off by half of the last one; that is the writing, not the clock.
    let limit_s = (JITTER_TICKS * tick_s).max(0.51 * written_s.min(tick_s));
    if off_s(worst) > limit_s {
        return Err(MeasuredError::Jitter {
            place: selection.sheet.place(selection.rows[worst], column(selection)?),
            value: time_s[worst],
            off_s: off_s(worst),
            tick_s,
            limit_s,
        });
    }
    Ok(tick_s)
}

/// Median interval, s.
pub(super) fn median_step_s(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Time of sample 0 and tick by least squares.
fn clock(time_s: &[f64]) -> (f64, f64) {
    let count = time_s.len() as f64;
    let (first_s, middle) = (time_s[0], (count - 1.0) / 2.0);
    let mean_s = time_s.iter().map(|at_s| at_s - first_s).sum::<f64>() / count;
    let centred = |index: usize| index as f64 - middle;
    let product: f64 = (0..time_s.len())
        .map(|i| centred(i) * (time_s[i] - first_s - mean_s))
        .sum();
    let square: f64 = (0..time_s.len()).map(|i| centred(i) * centred(i)).sum();
    let tick_s = product / square;
    (first_s + mean_s - middle * tick_s, tick_s)
}

fn gap(
    selection: &Selection,
    time_s: &[f64],
    tick_s: f64,
    first: usize,
    gaps: &[usize],
) -> Result<MeasuredError, MeasuredError> {
    let mut bounds = vec![0];
    bounds.extend(gaps);
    bounds.push(time_s.len());
    let longest = bounds
        .windows(2)
        .max_by_key(|pair| pair[1] - pair[0])
        .unwrap_or(&bounds);
    let (from_s, to_s) = (time_s[first - 1], time_s[first]);
    Ok(MeasuredError::Gap {
        place: selection.sheet.place(selection.rows[first], column(selection)?),
        from_s,
        to_s,
        missing: ((to_s - from_s) / tick_s).round() as u64 - 1,
        gaps: gaps.len(),
        keep_from: selection.rows[longest[0]] as u64,
        keep_to: selection.rows[longest[1] - 1] as u64 + 1,
    })
}

fn column<'a>(selection: &'a Selection) -> Result<&'a Column, MeasuredError> {
    let missing = || crate::columns::missing(&selection.sheet.file, &selection.sheet.headers, Quantity::Time);
    selection.columns.of(Quantity::Time).ok_or_else(missing)
}
