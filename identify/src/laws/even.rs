//! Strain over a hysteresis law: y = y₀ + γ₁m² + γ₂m⁴, m the law's output without its zero.
//!
//! A magnetostrictive strain is no hysteresis of the field but an even function of the magnetization, which is. Where the
//! magnetization was measured beside the strain, the law is fitted to that, and the three numbers to the strain along the law's free run;
//! what is kept back is kept back from both.
//! Source: the paper's (8) and its next even term.

use anhyst_model::LawModel;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::predict::run_along;
use super::search::FittedLaw;
use super::{LawData, LawOptions};

/// y₀, γ₁, γ₂.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvenCurve {
    pub zero: f64,
    pub square: f64,
    pub fourth: f64,
}

/// How many numbers a curve is.
const NUMBERS: usize = 3;

impl EvenCurve {
    /// At an output of the law whose zero is `zero`.
    pub fn at(&self, output: f64, zero: f64) -> f64 {
        let square = (output - zero).powi(2);
        self.zero + self.square * square + self.fourth * square * square
    }

    /// By least squares over pairs (output of the law, measured).
    fn fitted(pairs: &[(f64, f64)], zero: f64) -> Option<Self> {
        let scale = pairs
            .iter()
            .map(|(output, _)| (output - zero).abs())
            .fold(0.0, f64::max);
        let row = |output: f64| {
            let square = ((output - zero) / scale).powi(2);
            [1.0, square, square * square]
        };
        let design = DMatrix::from_fn(pairs.len(), NUMBERS, |i, j| row(pairs[i].0)[j]);
        let measured = DVector::from_iterator(pairs.len(), pairs.iter().map(|(_, measured)| *measured));
        let found = design.svd(true, true).solve(&measured, 1e-12).ok()?;
        let square = scale * scale;
        let own = EvenCurve {
            zero: found[0],
            square: found[1] / square,
            fourth: found[2] / (square * square),
        };
        [own.zero, own.square, own.fourth]
            .iter()
            .all(|number| number.is_finite())
            .then_some(own)
    }
}

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
