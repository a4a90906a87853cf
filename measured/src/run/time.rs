//! Is the time of a run what a sampled system needs: strictly increasing, without gaps, uniform? Small faults are mended.
//!
//! The clock is the straight line of time over sample number (least squares). A step of more than 1.5 median steps is a gap.
//! A sample may stand off the uniform clock by a tenth of a tick, or by half of the last digit in which times are written: an
//! actuator that moves 40 µm at 50 Hz passes 1.3 µm per 0.1 ms, so a tenth of that already is 0.1 µm.
//! Gaps of a few rows are filled, and stamps off the clock by up to half a tick are replaced; more is refused.

use super::record::{MeasuredRun, Series};
use super::repair::ClockRepair;
use super::resample::Resampling;
use super::selection::Selection;
use crate::columns::Column;
use crate::error::MeasuredError;
use crate::quantity::Quantity;
use crate::resolution::resolution;

/// A step longer than this many median steps is a gap.
const GAP_STEPS: f64 = 1.5;
/// Largest distance from the uniform clock that is no jitter, in ticks.
const MIN_JITTER_TICKS: f64 = 0.1;
/// Largest jitter that leaves no doubt which sample a stamp belongs to, in ticks: one missing row moves some stamp by half a tick.
const MAX_JITTER_TICKS: f64 = 0.45;
/// Longest gap that is filled: 2 ms at 10 kHz, a tenth of a period at 50 Hz.
pub(super) const MAX_FILLED_ROWS: u64 = 20;
/// Largest share of the rows that is filled.
const MAX_FILLED_SHARE: f64 = 0.05;

/// A uniform clock, and where a run does not stand on it.
pub(super) struct Clock {
    pub tick_s: f64,
    pub repair: Option<(ClockRepair, Resampling)>,
}

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

/// The clock of a run, or why there is none.
pub(super) fn clock(selection: &Selection, time_s: &[f64], series: &Series) -> Result<Clock, MeasuredError> {
    let written_s = resolution(time_s).unwrap_or(0.0);
    // A file that writes few digits is off by half of the last one; that is the writing, not the clock.
    let steady_s = |tick_s: f64| (MIN_JITTER_TICKS * tick_s).max(0.51 * written_s.min(tick_s));
    let limit_s = |tick_s: f64| (MAX_JITTER_TICKS * tick_s).max(steady_s(tick_s));
    let mut line = Line::of((0..time_s.len() as u64).collect(), time_s);
    let mut gaps = gaps(time_s);
    // Stamps that jitter leave steps like those of a missing row, and come back.
    if gaps.is_empty() || line.worst_s <= limit_s(line.tick_s) {
        gaps.clear();
    } else {
        let missing: u64 = gaps.iter().map(|gap| gap.missing).sum();
        let longest = gaps.iter().map(|gap| gap.missing).max().unwrap_or(0);
        if longest > MAX_FILLED_ROWS || missing as f64 > MAX_FILLED_SHARE * time_s.len() as f64 {
            return Err(gap(selection, time_s, &gaps)?);
        }
        for gap in &gaps {
            line.numbers[gap.before..]
                .iter_mut()
                .for_each(|number| *number += gap.missing);
        }
        line = Line::of(line.numbers, time_s);
    }
    let Line {
        numbers,
        start_s,
        tick_s,
        worst,
        worst_s,
    } = line;
    if worst_s > limit_s(tick_s) {
        return Err(MeasuredError::Jitter {
            place: selection.sheet.place(selection.rows[worst], column(selection)?),
            value: time_s[worst],
            off_s: worst_s,
            tick_s,
            limit_s: limit_s(tick_s),
        });
    }
    let jitter_s = if worst_s > steady_s(tick_s) { worst_s } else { 0.0 };
    if gaps.is_empty() && jitter_s == 0.0 {
        return Ok(Clock { tick_s, repair: None });
    }
    let stamped = Resampling::of(numbers.iter().map(|number| *number as f64).collect());
    let sampled = Resampling::of(time_s.iter().map(|at_s| (at_s - start_s) / tick_s).collect());
    let restamped = jitter_s == 0.0 || stamped.roughness(series) <= sampled.roughness(series);
    let resampling = if restamped { stamped } else { sampled };
    let repair = ClockRepair {
        filled: (0..resampling.samples())
            .filter(|sample| numbers.binary_search(&(*sample as u64)).is_err())
            .collect(),
        gaps: gaps.len(),
        jitter_s,
        restamped,
    };
    Ok(Clock {
        tick_s,
        repair: Some((repair, resampling)),
    })
}

impl MeasuredRun {
    /// Puts the run on a clock.
    pub(super) fn keep_time(&mut self, clock: Clock) {
        self.tick_s = Some(clock.tick_s);
        let Some((repair, resampling)) = clock.repair else {
            return;
        };
        for quantity in Quantity::ALL {
            if let Some(values) = &mut self.series[quantity.index()] {
                *values = resampling.of_series(quantity, values);
            }
        }
        let begin_s = self.time_s.as_ref().map_or(0.0, |time_s| time_s[0]);
        let samples = resampling.samples();
        self.time_s = Some(
            (0..samples)
                .map(|sample| begin_s + sample as f64 * clock.tick_s)
                .collect(),
        );
        self.rows = (0..samples)
            .map(|sample| self.rows[resampling.before(sample)])
            .collect();
        self.lines = self
            .lines
            .as_ref()
            .map(|lines| (0..samples).map(|sample| lines[resampling.before(sample)]).collect());
        self.repair = Some(repair);
    }
}

/// Median interval, s.
pub(crate) fn median_step_s(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Rows that are missing before a sample.
pub(crate) struct Gap {
    pub before: usize,
    pub missing: u64,
}

/// The gaps of a time that increases.
pub(crate) fn gaps(time_s: &[f64]) -> Vec<Gap> {
    let limit_s = GAP_STEPS * median_step_s(time_s);
    let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
    // The median of rounded times is off; the mean of those that are no gaps is not.
    let (sum_s, count) = steps()
        .filter(|step_s| *step_s <= limit_s)
        .fold((0.0, 0.0), |(sum, count), step_s| (sum + step_s, count + 1.0));
    let missing = |step_s: f64| (step_s * count / sum_s).round() as u64 - 1;
    let long = steps().enumerate().filter(|(_, step_s)| *step_s > limit_s);
    long.map(|(index, step_s)| Gap {
        before: index + 1,
        missing: missing(step_s),
    })
    .collect()
}

/// Time over sample number by least squares.
struct Line {
    numbers: Vec<u64>,
    /// Of sample 0.
    start_s: f64,
    tick_s: f64,
    /// The sample that is farthest off, and how far, s.
    worst: usize,
    worst_s: f64,
}

impl Line {
    fn of(numbers: Vec<u64>, time_s: &[f64]) -> Self {
        let count = time_s.len() as f64;
        let first_s = time_s[0];
        let middle = numbers.iter().map(|number| *number as f64).sum::<f64>() / count;
        let mean_s = time_s.iter().map(|at_s| at_s - first_s).sum::<f64>() / count;
        let centred = || numbers.iter().map(|number| *number as f64 - middle);
        let product: f64 = centred()
            .zip(time_s)
            .map(|(number, at_s)| number * (at_s - first_s - mean_s))
            .sum();
        let tick_s = product / centred().map(|number| number * number).sum::<f64>();
        let start_s = first_s + mean_s - middle * tick_s;
        let off_s = |(number, at_s): (&u64, &f64)| (at_s - start_s - *number as f64 * tick_s).abs();
        let all = numbers.iter().zip(time_s).map(off_s).enumerate();
        let (worst, worst_s) = all.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((0, 0.0));
        Line {
            numbers,
            start_s,
            tick_s,
            worst,
            worst_s,
        }
    }
}

fn gap(selection: &Selection, time_s: &[f64], gaps: &[Gap]) -> Result<MeasuredError, MeasuredError> {
    let mut bounds = vec![0];
    bounds.extend(gaps.iter().map(|gap| gap.before));
    bounds.push(time_s.len());
    let longest = bounds
        .windows(2)
        .max_by_key(|pair| pair[1] - pair[0])
        .unwrap_or(&bounds);
    let first = &gaps[0];
    Ok(MeasuredError::Gap {
        place: selection.sheet.place(selection.rows[first.before], column(selection)?),
        from_s: time_s[first.before - 1],
        to_s: time_s[first.before],
        missing: first.missing,
        gaps: gaps.len(),
        most: MAX_FILLED_ROWS,
        keep_from: selection.rows[longest[0]] as u64,
        keep_to: selection.rows[longest[1] - 1] as u64 + 1,
    })
}

fn column<'a>(selection: &Selection<'a>) -> Result<&'a Column, MeasuredError> {
    let missing = || crate::columns::missing(&selection.sheet.file, &selection.sheet.headers, Quantity::Time);
    selection.columns.of(Quantity::Time).ok_or_else(missing)
}
