//! What the data tell beside the law: the history before them, and how late the device sees its input.

use super::search::fit_law;
use super::{Family, LawData, LawOptions, Reaction, Start};
use crate::parallel;

/// Of the output's range: what leaves more does not describe it.
pub(super) const UNDESCRIBED: f64 = 0.05;
/// Times what the best history leaves: one that leaves no more describes alike, and the plainest of these is taken.
const SAME_START: f64 = 1.02;

/// Samples to which a lag is told.
const FINEST_LAG: f64 = 0.1;

/// The histories that records of this kind can have, the plainest first.
fn starts(data: &LawData) -> &'static [Start] {
    if data.has_time() {
        &[
            Start::Rest,
            Start::Onward,
            Start::Turned,
            Start::FromBelow,
            Start::FromAbove,
        ]
    } else if data.records.iter().all(|record| record.is_closed()) {
        &[Start::Cycled, Start::Onward, Start::Rest]
    } else {
        &[
            Start::Onward,
            Start::Turned,
            Start::Rest,
            Start::FromBelow,
            Start::FromAbove,
        ]
    }
}

/// History, and how quickly the device reacts: they matter more than the form, so one form tells what they are; another, where that
/// one does not describe the data. And whether nothing slower was tried.
pub(super) fn circumstances(data: &LawData, options: &LawOptions, threads: usize) -> (Start, Reaction, bool) {
    let judge = if data.has_time() {
        Family::BentPlays
    } else {
        Family::TanhPlays(2)
    };
    let quick = LawOptions {
        draws: 3,
        steps: 10,
        samples: options.samples.min(5000),
        ..*options
    };
    let of = Judge {
        family: judge,
        lags: &[0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0],
        worth: 1.0,
    };
    let told_by = |of: &Judge, (start, reaction): (Start, Reaction)| {
        let slowest_s = data.tick_s().unwrap_or_default() * of.lags.last().copied().unwrap_or_default();
        let own_s = reaction.delay_s + reaction.lag_s;
        (start, reaction, own_s > 0.0 && own_s >= 0.999 * slowest_s)
    };
    let (told, left) = of.judged(data, &quick, threads);
    let told = told_by(&of, told);
    if left <= UNDESCRIBED {
        return told;
    }
    // It has more numbers to look for, and along one loop a lag looks like a width: only one that halves what is left is one, and that may
    // be long, as of what heats through.
    let of = Judge {
        family: Family::PreisachLogistic,
        lags: &[0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0],
        worth: 2.0,
    };
    let longer = LawOptions {
        draws: 10,
        steps: 25,
        ..quick
    };
    let (other, left_by_other) = of.judged(data, &longer, threads);
    if left_by_other < left {
        told_by(&of, other)
    } else {
        told
    }
}

/// A form that tells the circumstances.
struct Judge {
    family: Family,
    /// Lags that are tried, in samples.
    lags: &'static [f64],
    /// So many times less must be left for a lag to be one.
    worth: f64,
}

impl Judge {
    /// What it tells of them, and the share of the output's range that it leaves.
    fn judged(&self, data: &LawData, options: &LawOptions, threads: usize) -> ((Start, Reaction), f64) {
        // The first that is as good as the best, to so many times.
        let best_of = |tried: &[(Start, Reaction)], alike: f64| {
            let nrmse = parallel::map(threads, tried, |(start, reaction)| {
                let reacted = data.reacted(*reaction, *start == Start::Rest);
                fit_law(self.family, &reacted, *start, options, false).nrmse
            });
            let least = nrmse.iter().copied().fold(f64::INFINITY, f64::min);
            let best = nrmse.iter().position(|own| *own <= alike * least).unwrap_or_default();
            (tried[best], nrmse[best])
        };
        let begun: Vec<_> = starts(data).iter().map(|start| (*start, Reaction::default())).collect();
        let ((start, still), left) = best_of(&begun, SAME_START);
        let Some(tick_s) = data.tick_s() else {
            return ((start, still), left);
        };
        let react = |delay: f64, lag: f64| {
            let reaction = Reaction {
                delay_s: delay * tick_s,
                lag_s: lag * tick_s,
            };
            (start, reaction)
        };
        let lags: Vec<_> = self.lags.iter().map(|ticks| react(0.0, *ticks)).collect();
        let ((_, lagged), _) = best_of(&lags, self.worth);
        let sum = lagged.lag_s / tick_s;
        let each = [0.0, 1.0, 2.0].map(|delay| {
            let alone = (sum - delay).max(0.0);
            let mut told = best_of(&[react(delay, alone)], 1.0);
            let mut step = 0.5 * self.finest(sum);
            // Where it reacts at all, it lags by no whole number of what was tried.
            while sum > 0.0 && step >= FINEST_LAG {
                let lag = told.0.1.lag_s / tick_s;
                let beside = [(lag - step).max(0.0), lag + step].map(|lag| react(delay, lag));
                let other = best_of(&beside, 1.0);
                if other.1 < told.1 {
                    told = other;
                }
                step *= 0.5;
            }
            told
        });
        let least = each.iter().map(|own| own.1).fold(f64::INFINITY, f64::min);
        let plainest = each.into_iter().find(|own| own.1 <= self.worth * least);
        plainest.unwrap_or(((start, still), left))
    }

    /// Between the lags that are tried about this one, the least way, in samples.
    fn finest(&self, lag: f64) -> f64 {
        let ways = self.lags.iter().map(|own| (own - lag).abs()).filter(|way| *way > 0.0);
        ways.fold(f64::INFINITY, f64::min)
    }
}
