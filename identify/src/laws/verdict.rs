//! Which law, of those that were fitted, and what the data cannot tell.

use anhyst_measured::{noise_floor, sweep};
use anhyst_model::HysteresisLaw;
use serde::Serialize;

use super::circumstances::{UNDESCRIBED, circumstances};
use super::predict::run_along;
use super::search::{FittedLaw, fit_law};
use super::through::through;
use super::{Family, LawData, LawError, LawFile, LawOptions, Reaction, Start};
use crate::order::ascending;
use crate::parallel;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Predictions as near as this to each other are a tie: of the same laws on other parts of the same data they differ as much.
pub const TIE: f64 = 1.15;
/// What knows no history.
const WITHOUT_MEMORY: [Family; 2] = [Family::Linear, Family::Curve];
/// What is left is more than noise from this multiple of it on.
const ABOVE_NOISE: f64 = 5.0;
/// A prediction so much worse than its fit tells of too many numbers for these data.
const OVERFITTED: f64 = 3.0;

/// One law in the comparison. Shares of the output's range.
#[derive(Clone, Debug, Serialize)]
pub struct LawCandidate {
    pub law: &'static str,
    /// Numbers that the fit chose.
    pub parameters: usize,
    pub nrmse: f64,
    pub held_out_nrmse: f64,
    /// Each record's over its own range (or a tenth of the whole, if that is more), rms over records: by this they are ranked.
    pub held_out_own_nrmse: f64,
}

/// A number of the chosen law.
#[derive(Clone, Debug, Serialize)]
pub struct LawNumber {
    pub name: String,
    pub value: f64,
}

/// What `fit.json` says.
#[derive(Clone, Debug, Serialize)]
pub struct LawReport {
    pub data: String,
    pub input: String,
    pub output: String,
    /// Unit of the output.
    pub unit: &'static str,
    pub samples: usize,
    pub records: usize,
    /// The chosen law.
    pub law: &'static str,
    /// Why this one; empty where there was no choice.
    pub why: String,
    /// Numbers that the fit chose.
    pub parameters: usize,
    /// rms of what is left, over the output's range.
    pub nrmse: f64,
    /// The same of data that were kept back, predicted by fits of the others.
    pub held_out_nrmse: f64,
    /// rms of what is left, unit of the output.
    pub rms: f64,
    /// Highest less lowest output.
    pub range: f64,
    pub start: &'static str,
    /// The output falls as the input rises: the law is that of its negative.
    pub falls: bool,
    pub reaction: Reaction,
    pub values: Vec<LawNumber>,
    /// All that were fitted, the best prediction first.
    pub candidates: Vec<LawCandidate>,
    pub warnings: Vec<String>,
}

/// The chosen law, as a file and as a report.
#[derive(Clone, Debug)]
pub struct LawFit {
    pub file: LawFile,
    pub report: LawReport,
    /// What it makes of each record.
    pub modelled: Vec<Vec<f64>>,
}

/// Fits the named law, or all and takes the one that is worth its numbers. Of an output that falls as the input rises it is fitted to the
/// negative.
///
/// # Errors
/// A law that ends no better than a line.
pub fn fit_laws(
    family: Option<Family>,
    data: &LawData,
    options: &LawOptions,
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<LawFit, LawError> {
    let turned = rising(data);
    let data = turned.as_ref().unwrap_or(data);
    let families: Vec<Family> = match family {
        Some(family) => {
            let own = Some(family).filter(|own| !WITHOUT_MEMORY.contains(own));
            WITHOUT_MEMORY.into_iter().chain(own).collect()
        }
        None => Family::ALL.into_iter().filter(|family| family.suits(data)).collect(),
    };
    let (seen, mut fitted) = fit_all(&families, data, options, threads, progress);
    let line = fitted[0].clone();
    let plain = fitted.iter().filter(|own| WITHOUT_MEMORY.contains(&own.family));
    let plain = plain.min_by(|one, other| one.held_out_own_nrmse.total_cmp(&other.held_out_own_nrmse));
    let plain = plain.unwrap_or(&line).clone();
    if let Some(family) = family {
        fitted.retain(|own| own.family == family);
    }
    fitted.retain(|own| own.model.validate().is_ok() && own.held_out_nrmse.is_finite());
    ascending(&mut fitted, |own| own.held_out_own_nrmse);
    let Some(best) = fitted.first() else {
        return Err(worse(family.unwrap_or(Family::Linear), f64::NAN, line.nrmse));
    };
    let tied = |own: &&FittedLaw| own.held_out_own_nrmse <= TIE * best.held_out_own_nrmse;
    // At one price what claims no memory.
    let cost = |own: &&FittedLaw| (own.parameters, !WITHOUT_MEMORY.contains(&own.family));
    let price = |one: &&FittedLaw, other: &&FittedLaw| cost(one).cmp(&cost(other));
    // Of those that predict alike, those that also describe alike; of these the cheapest.
    let least = fitted
        .iter()
        .filter(tied)
        .map(|own| own.nrmse)
        .fold(f64::INFINITY, f64::min);
    let described = |own: &&FittedLaw| own.nrmse <= TIE * least;
    let chosen = fitted
        .iter()
        .filter(tied)
        .filter(described)
        .min_by(price)
        .unwrap_or(best);
    if family.is_some_and(|family| family != Family::Linear) && chosen.nrmse > line.nrmse {
        return Err(worse(chosen.family, chosen.nrmse, line.nrmse));
    }
    let ties: Vec<&FittedLaw> = fitted
        .iter()
        .filter(tied)
        .filter(|own| own.family != chosen.family)
        .collect();
    let mut warnings = warnings(data, chosen, &ties, &plain);
    warnings.extend(doubts_of_fit(&seen, data, chosen));
    let falls = turned.is_some() && data.beneath.is_none();
    let mut fit = made(&seen, data, falls, chosen, &fitted, warnings);
    if family.is_none() {
        fit.report.why = why(chosen, &fitted, ties.len());
    }
    Ok(fit)
}

/// The data with an output that rises with the input, where it falls.
fn rising(data: &LawData) -> Option<LawData> {
    match &data.beneath {
        // Its sign does not show in the strain.
        Some(beneath) => beneath.falls().then(|| LawData {
            beneath: Some(Box::new(beneath.turned())),
            ..data.clone()
        }),
        None => data.falls().then(|| data.turned()),
    }
}

/// The data as the device sees them, with its reaction.
struct Seen {
    data: LawData,
    reaction: Reaction,
    /// Nothing slower was tried.
    at_end: bool,
}

fn fit_all(
    families: &[Family],
    data: &LawData,
    options: &LawOptions,
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> (Seen, Vec<FittedLaw>) {
    let beneath = data.beneath.as_deref().unwrap_or(data);
    let (start, reaction, at_end) = circumstances(beneath, options, threads);
    let seen = data.reacted(reaction, start == Start::Rest);
    let done = AtomicUsize::new(0);
    let fitted = parallel::map(threads, families, |family| {
        let fitted = match &seen.beneath {
            None => fit_law(*family, &seen, start, options, false),
            Some(beneath) => through(fit_law(*family, beneath, start, options, true), beneath, &seen, options),
        };
        progress(1 + done.fetch_add(1, Ordering::Relaxed), families.len());
        fitted
    });
    let seen = Seen {
        data: seen,
        reaction,
        at_end,
    };
    (seen, fitted)
}

/// Every law that [`fit_laws`] would choose from, each with a report of its own.
pub fn fit_each(data: &LawData, options: &LawOptions, threads: usize) -> Vec<LawFit> {
    let families: Vec<Family> = Family::ALL.into_iter().filter(|family| family.suits(data)).collect();
    let (seen, fitted) = fit_all(&families, data, options, threads, &|_, _| ());
    fitted
        .iter()
        .map(|own| made(&seen, data, false, own, std::slice::from_ref(own), Vec::new()))
        .collect()
}

/// The rule in the numbers of this choice; `fitted` begins with the best prediction.
fn why(chosen: &FittedLaw, fitted: &[FittedLaw], ties: usize) -> String {
    let name = chosen.family.name();
    let to = |own: &FittedLaw| format!("{:.3} %", 100.0 * own.held_out_own_nrmse);
    match fitted {
        [best, next, ..] if ties == 0 => format!(
            "{name}, because it predicts what was kept back best, to {}; the next, {}, to {}",
            to(best),
            next.family.name(),
            to(next)
        ),
        [best, _, ..] => format!(
            "{name}, because {} laws predict what was kept back to within {:.0} % of the best ({}, {}), and of those that also describe \
             the data alike it has the fewest numbers, {}",
            ties + 1,
            100.0 * (TIE - 1.0),
            best.family.name(),
            to(best),
            chosen.parameters
        ),
        _ => String::new(),
    }
}

fn worse(family: Family, nrmse: f64, line_nrmse: f64) -> LawError {
    LawError::WorseThanALine {
        law: family.name(),
        nrmse: 100.0 * nrmse,
        line_nrmse: 100.0 * line_nrmse,
    }
}

fn warnings(data: &LawData, chosen: &FittedLaw, ties: &[&FittedLaw], plain: &FittedLaw) -> Vec<String> {
    let mut warnings = data.doubts.clone();
    if chosen.nrmse > UNDESCRIBED {
        warnings.push(format!(
            "{:.0} % of the range is left: what answers here is no hysteresis of this input alone, but noise, another input, a rate, or a curve that \
             turns round as a strain does over a field",
            100.0 * chosen.nrmse
        ));
    }
    if chosen.nrmse <= UNDESCRIBED && plain.held_out_own_nrmse <= TIE * chosen.held_out_own_nrmse {
        let name = if plain.family == Family::Linear {
            "line"
        } else {
            "curve without memory"
        };
        warnings.push(format!("a {name} predicts as well: these data show no hysteresis"));
    }
    if !ties.is_empty() {
        let names: Vec<String> = ties
            .iter()
            .map(|own| format!("{} ({})", own.family.name(), own.parameters))
            .collect();
        warnings.push(format!(
            "the data cannot choose: {} (numbers) predict as well as {} ({}), to {:.0} %",
            names.join(", "),
            chosen.family.name(),
            chosen.parameters,
            100.0 * (TIE - 1.0)
        ));
    }
    if chosen.held_out_nrmse > OVERFITTED * chosen.nrmse {
        warnings.push(format!(
            "data that were kept back are predicted {:.1} times worse than those that were fitted: of other motions expect the former",
            chosen.held_out_nrmse / chosen.nrmse
        ));
    }
    // Where there are several, as reversal curves, each may begin at a turn.
    let never_turns =
        data.records.len() == 1 && sweep::turning_points(&data.records[0].input, sweep::DEFAULT_THRESHOLD).is_empty();
    if never_turns && chosen.family != Family::Linear {
        warnings.push("the input never turns round here: what the law does after a turn is not measured".to_owned());
    }
    if data.records.len() == 1 {
        warnings.push(
            "one record: what was kept back are parts of the same motion; other amplitudes, rates and histories are not tested".to_owned(),
        );
    }
    warnings
}

/// Where what was found may be what the law lacks.
fn doubts_of_fit(seen: &Seen, data: &LawData, chosen: &FittedLaw) -> Vec<String> {
    let mut doubts = Vec::new();
    let Reaction { delay_s, lag_s } = seen.reaction;
    if seen.at_end {
        doubts.push(format!(
            "the reaction beside the law, {:.4} ms, is the slowest that was tried: unless the device is as slow, it stands for what the law \
             lacks, and one of other motions is worse with it",
            1e3 * (delay_s + lag_s)
        ));
    }
    let left = chosen.nrmse * data.output_range();
    let times = noise_rms(data).map_or(0.0, |noise| left / noise);
    if times > ABOVE_NOISE {
        doubts.push(format!(
            "what is left is {times:.0} times the noise: another law, a rate or another input may describe more of it"
        ));
    }
    doubts
}

/// The floor under the output of the longest record over time; the records of sweeps have none that could be told from their motion.
fn noise_rms(data: &LawData) -> Option<f64> {
    let timed = data.records.iter().filter(|record| record.time_s.is_some());
    let floor = noise_floor(&timed.max_by_key(|record| record.len())?.output, &[])?;
    Some(floor.rms).filter(|rms| *rms > 0.0)
}

fn made(
    seen: &Seen,
    asked: &LawData,
    falls: bool,
    chosen: &FittedLaw,
    fitted: &[FittedLaw],
    warnings: Vec<String>,
) -> LawFit {
    let Seen { data, reaction, .. } = seen;
    let candidate = |own: &FittedLaw| LawCandidate {
        law: own.family.name(),
        parameters: own.parameters,
        nrmse: own.nrmse,
        held_out_nrmse: own.held_out_nrmse,
        held_out_own_nrmse: own.held_out_own_nrmse,
    };
    let parameters = HysteresisLaw::parameters(&chosen.model).into_iter();
    let values = parameters.filter(|number| number.value != 0.0).map(|number| LawNumber {
        name: number.name,
        value: number.value,
    });
    let report = LawReport {
        data: data.source.clone(),
        input: data.input.name().to_owned(),
        output: data.output.name().to_owned(),
        unit: data.output.unit(),
        samples: data.samples(),
        records: data.records.len(),
        law: chosen.family.name(),
        why: String::new(),
        parameters: chosen.parameters,
        nrmse: chosen.nrmse,
        held_out_nrmse: chosen.held_out_nrmse,
        rms: chosen.nrmse * data.output_range(),
        range: data.output_range(),
        start: chosen.start.words(),
        falls,
        reaction: *reaction,
        values: values.collect(),
        candidates: fitted.iter().map(candidate).collect(),
        warnings,
    };
    let file = LawFile {
        input: data.input,
        output: data.output,
        start: chosen.start,
        input_extent: asked.input_extent,
        reaction: *reaction,
        noise_rms: noise_rms(asked),
        model: chosen.model.clone(),
        even: chosen.curve,
        falls,
    };
    let along = |record| {
        let mut run = run_along(&chosen.model, chosen.start, record, data.input_extent);
        file.told(&mut run);
        run
    };
    LawFit {
        modelled: data.records.iter().map(along).collect(),
        file,
        report,
    }
}
