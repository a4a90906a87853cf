//! Sentences about a fit that a reader must not miss, each with its number, its limit and what to do.

use anhyst_model::{Anhysteretic, HysteresisParameter};

use crate::report::{AGREEMENT, FitReport};

/// Two parameters correlated beyond this cannot be told apart.
pub const CORRELATION_LIMIT: f64 = 0.98;
/// Sensitivities conditioned worse than this fix some combination of parameters poorly.
pub const CONDITION_LIMIT: f64 = 100.0;
/// Curves whose NRMSE differ by less than this share are not told apart.
const CURVE_LIMIT: f64 = 0.05;
/// A residual correlated over more than this share of the loop is the model's error, not the instrument's.
const SYSTEMATIC_SHARE: f64 = 0.02;
/// An offset above this share of the amplitude deserves a word.
const OFFSET_SHARE: f64 = 0.002;
/// Fewer agreeing starts than this make chance the finder.
const FEWEST_STARTS: usize = 3;

/// All warnings of a finished report; `at_bounds` names the directions that ended at a bound of the search.
pub(crate) fn warnings(report: &FitReport, at_bounds: &[&str]) -> Vec<String> {
    let mut all = ambiguities(report);
    all.extend(at_bounds.iter().map(|name| {
        format!(
            "{name} ended at the bound of the search: its standard deviation means nothing, widen the bounds or fix it"
        )
    }));
    all.extend(starts(report));
    all.extend(curves(report));
    all.extend(loops(report));
    all
}

fn ambiguities(report: &FitReport) -> Vec<String> {
    let free: Vec<_> = report
        .parameters
        .iter()
        .filter(|fitted| fitted.standard_deviation.is_some())
        .collect();
    let mut sentences = Vec::new();
    for (i, first) in free.iter().enumerate() {
        for (j, second) in free.iter().enumerate().skip(i + 1) {
            let correlation = report.correlation[i][j];
            if correlation.abs() <= CORRELATION_LIMIT {
                continue;
            }
            let pair = [first.parameter, second.parameter];
            let mut sentence = format!(
                "{} and {} cannot be told apart by these data: their correlation is {correlation:.4}, the limit {CORRELATION_LIMIT}",
                first.symbol, second.symbol
            );
            if pair == [HysteresisParameter::Shape, HysteresisParameter::Coupling] {
                let effective = report.effective_shape_a_per_m;
                let divisor = match report.anhysteretic {
                    Anhysteretic::Langevin => "/3",
                    Anhysteretic::Ising => "",
                };
                sentence += &format!(
                    "; what the data fix is a - alpha*Ms{divisor} = {:.1} A/m with standard deviation {:.1} A/m",
                    effective.value, effective.standard_deviation
                );
            }
            sentences.push(format!(
                "{sentence}. Hold one of them at a value you trust, as in --fix {}={:.4}, or measure loops of other amplitudes",
                second.symbol, second.value
            ));
        }
    }
    if report.condition_number > CONDITION_LIMIT {
        sentences.push(format!(
            "the sensitivities have condition number {:.0}, the limit is {CONDITION_LIMIT}: some combination of {} is fixed {:.0} times \
             worse than the best one",
            report.condition_number,
            free.iter().map(|fitted| fitted.symbol.as_str()).collect::<Vec<_>>().join(", "),
            report.condition_number
        ));
    }
    sentences
}

fn starts(report: &FitReport) -> Option<String> {
    let search = &report.search;
    let few = search.agreeing_starts < FEWEST_STARTS && search.starts >= FEWEST_STARTS;
    few.then(|| {
        format!(
            "{} of {} starts ended within {:.0} % of the best NRMSE, {FEWEST_STARTS} are wanted: a better set may exist, try more starts",
            search.agreeing_starts,
            search.starts,
            100.0 * AGREEMENT
        )
    })
}

fn curves(report: &FitReport) -> Option<String> {
    let [(first, best), (second, next)] = report.search.curves[..] else {
        return None;
    };
    let close = (best - next).abs() < CURVE_LIMIT * best.min(next);
    close.then(|| {
        format!(
            "these data do not choose between the curves: {first:?} leaves {:.3} %, {second:?} {:.3} % of the range",
            100.0 * best,
            100.0 * next
        )
    })
}

fn loops(report: &FitReport) -> Vec<String> {
    let mut sentences = Vec::new();
    for of in &report.loops {
        let share = of.correlation_length_samples / of.samples as f64;
        if share > SYSTEMATIC_SHARE {
            sentences.push(format!(
                "loop {}: the residual is correlated over {:.0} of {} samples, more than {:.0} %: it is the model's error rather than noise, \
                 and the standard deviations say how far an error of this kind moves the parameters",
                of.id,
                of.correlation_length_samples,
                of.samples,
                100.0 * SYSTEMATIC_SHARE
            ));
        }
        let range = of.magnetization_rms_a_per_m / of.magnetization_nrmse;
        if of.magnetization_offset_a_per_m.abs() > 0.5 * OFFSET_SHARE * range {
            sentences.push(format!(
                "loop {}: the instrument's zero of magnetization is {:.0} A/m, {:.2} % of the amplitude; it was fitted and taken off",
                of.id,
                of.magnetization_offset_a_per_m,
                200.0 * of.magnetization_offset_a_per_m.abs() / range
            ));
        }
        if of.pooled_samples > 0 {
            sentences.push(format!(
                "loop {}: the field chatters in {} of {} samples; they were pooled so that noise makes no reversals",
                of.id, of.pooled_samples, of.samples
            ));
        }
    }
    sentences
}
