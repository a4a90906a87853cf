//! A strain fitted over the law of what lies beneath it.

use anhyst_model::LawModel;

use super::even::{EvenCurve, NUMBERS};
use super::predict::run_along;
use super::search::FittedLaw;
use super::{LawData, LawOptions};

/// What the law without a fold makes of every record.
fn runs(model: &LawModel, law: &FittedLaw, beneath: &LawData) -> Vec<Vec<f64>> {
    let records = beneath.records.iter();
    records
        .map(|record| run_along(model, law.start, record, beneath.input_extent))
        .collect()
}

/// A law that was fitted to what lies beneath, judged by what it makes of the data; as it was where there is no such curve.
pub(super) fn through(mut law: FittedLaw, beneath: &LawData, data: &LawData, options: &LawOptions) -> FittedLaw {
    let folds = super::parts::folds(data, options);
    let pairs = |runs: &[Vec<f64>], keep: &dyn Fn(Option<usize>) -> bool| {
        let mut pairs = Vec::new();
        for ((run, record), folds) in runs.iter().zip(&data.records).zip(&folds) {
            let all = run.iter().zip(&record.output).zip(folds);
            pairs.extend(
                all.filter(|(_, fold)| keep(**fold))
                    .map(|((made, measured), _)| (*made, *measured)),
            );
        }
        pairs
    };
    let squares = |curve: &EvenCurve, pairs: &[(f64, f64)], zero: f64| -> f64 {
        let each = pairs
            .iter()
            .map(|(made, measured)| (curve.at(*made, zero) - measured).powi(2));
        each.sum()
    };
    let whole = pairs(&runs(&law.model, &law, beneath), &|fold| fold.is_some());
    let zero = law.model.offset;
    let Some(curve) = EvenCurve::fitted(&whole, zero) else {
        return law;
    };
    let (mut kept_back, mut count) = (0.0, 0);
    for (fold, model) in law.folds.iter().enumerate() {
        let made = runs(model, &law, beneath);
        let (others, own) = (
            pairs(&made, &|of| of.is_some_and(|of| of != fold)),
            pairs(&made, &|of| of == Some(fold)),
        );
        if let Some(curve) = EvenCurve::fitted(&others, model.offset) {
            kept_back += squares(&curve, &own, model.offset);
            count += own.len();
        }
    }
    let range = data.output_range();
    law.nrmse = (squares(&curve, &whole, zero) / whole.len() as f64).sqrt() / range;
    law.held_out_nrmse = (kept_back / count.max(1) as f64).sqrt() / range;
    law.held_out_own_nrmse = law.held_out_nrmse;
    law.parameters += NUMBERS;
    law.curve = Some(curve);
    law
}
