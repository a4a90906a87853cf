//! From a finished search to its report.

use anhyst_model::{Anhysteretic, Hysteresis, HysteresisParameter};

use crate::engine::covariance::correlation_length_samples;
use crate::modelled::Modelled;
use crate::observed::{Nuisance, ObservedLoop};
use crate::parameters::effective_shape_a_per_m;
use crate::report::{
    AGREEMENT, Estimate, FitReport, FittedParameter, LoopReport, LoopStrainReport, SearchReport, StrainReport,
};
use crate::residuals::{Observation, Polished};
use crate::search::Effort;
use crate::simulate::{Beginning, range};
use crate::strain::StrainLaw;
use crate::uncertainty::Uncertainty;
use crate::warnings::warnings;
use anhyst_measured::{MeasuredRun, Quantity};

/// Everything that is known after a search; `polished` is sorted, best first.
pub(crate) fn report(
    measured: &[MeasuredRun],
    observation: &Observation,
    polished: &[Polished<'_>],
    tried: Vec<(Anhysteretic, f64)>,
    effort: Effort,
    hysteresis: &Hysteresis,
    modelled: &Modelled,
) -> FitReport {
    let (file, best) = (measured.first(), &polished[0]);
    let nuisance = best.nuisance();
    let uncertainty = Uncertainty::of(best, hysteresis);
    let loops = loops(measured, observation, &nuisance, modelled, &uncertainty);
    let squares = |of: &dyn Fn(&LoopReport) -> Option<f64>| {
        let each: Vec<f64> = loops.iter().filter_map(of).collect();
        (!each.is_empty()).then(|| (each.iter().map(|nrmse| nrmse * nrmse).sum::<f64>() / each.len() as f64).sqrt())
    };
    let magnetization_nrmse = squares(&|of| Some(of.magnetization_nrmse)).unwrap_or(f64::NAN);
    let strain_nrmse = squares(&|of| of.strain.map(|strain| strain.nrmse));
    let mut report = FitReport {
        source: file.map(|run| run.source.clone()).unwrap_or_default(),
        data_hash: file.map(|run| run.data_hash.clone()).unwrap_or_default(),
        anhysteretic: hysteresis.anhysteretic,
        parameters: parameters(hysteresis, &uncertainty),
        effective_shape_a_per_m: Estimate {
            value: effective_shape_a_per_m(hysteresis),
            standard_deviation: uncertainty.effective_shape_standard_deviation_a_per_m,
        },
        strain: strain(observation, modelled, hysteresis),
        magnetization_nrmse,
        strain_nrmse,
        correlation: uncertainty.correlation(),
        condition_number: uncertainty.covariance.condition_number,
        search: agreement(polished, tried, effort),
        assumptions: assumptions(observation),
        loops,
        warnings: Vec::new(),
    };
    report.warnings = warnings(&report, &best.fitter.coordinates.at_bounds(best.material_numbers()));
    report
}

fn parameters(hysteresis: &Hysteresis, uncertainty: &Uncertainty) -> Vec<FittedParameter> {
    let fitted = |parameter: HysteresisParameter| FittedParameter {
        parameter,
        symbol: parameter.symbol().to_owned(),
        unit: parameter.unit().to_owned(),
        value: parameter.of(hysteresis),
        standard_deviation: uncertainty.standard_deviation(parameter),
    };
    HysteresisParameter::ALL.into_iter().map(fitted).collect()
}

fn loops(
    measured: &[MeasuredRun],
    observation: &Observation,
    nuisance: &Nuisance,
    modelled: &Modelled,
    uncertainty: &Uncertainty,
) -> Vec<LoopReport> {
    // The law fitted to what was measured instead of to the model: what the law itself leaves.
    let true_measured: Vec<Vec<f64>> = observation
        .loops
        .iter()
        .zip(&nuisance.offset)
        .map(|(of, offset)| {
            let offset = offset * of.magnetization_range_a_per_m;
            of.magnetization_a_per_m.iter().map(|m| m - offset).collect()
        })
        .collect();
    let direct = StrainLaw::solve(&observation.loops, &true_measured);
    let one = |(index, of): (usize, &ObservedLoop)| {
        let model = &modelled.magnetizations[index];
        let offset = nuisance.offset[index] * of.magnetization_range_a_per_m;
        let residual = difference(model, &true_measured[index]);
        let strain = of.strain.as_ref().and_then(|strain| {
            let (law, direct) = (modelled.law.as_ref()?, direct.as_ref()?);
            let residual = difference(&law.along(index, model), strain);
            let from_measured = difference(&direct.along(index, &true_measured[index]), strain);
            Some(LoopStrainReport {
                nrmse: rms(&residual) / range(strain),
                rms: rms(&residual),
                largest: residual.iter().fold(0.0_f64, |most, r| most.max(r.abs())),
                nrmse_from_measured_magnetization: rms(&from_measured) / range(strain),
                zero: law.zero[index],
            })
        });
        let raw_field = measured[index].series(Quantity::Field).unwrap_or_default();
        LoopReport {
            id: measured[index].loop_id.clone(),
            samples: model.len(),
            largest_field_a_per_m: of
                .field_a_per_m
                .iter()
                .fold(0.0_f64, |most, field| most.max(field.abs())),
            beginning: of.beginning,
            pooled_samples: raw_field
                .iter()
                .zip(&of.field_a_per_m)
                .filter(|(raw, used)| raw != used)
                .count(),
            magnetization_nrmse: rms(&residual) / of.magnetization_range_a_per_m,
            magnetization_rms_a_per_m: rms(&residual),
            magnetization_offset_a_per_m: offset,
            correlation_length_samples: uncertainty.covariance.correlation_lengths_samples[index],
            strain,
        }
    };
    observation.loops.iter().enumerate().map(one).collect()
}

fn strain(observation: &Observation, modelled: &Modelled, hysteresis: &Hysteresis) -> Option<StrainReport> {
    let law = modelled.law.as_ref()?;
    // Weighted residuals of all loops: their variance and correlation length, and the sensitivity to γ.
    let (mut variance, mut information) = (0.0, 0.0);
    for (index, (of, model)) in observation.loops.iter().zip(&modelled.magnetizations).enumerate() {
        let Some(strain) = &of.strain else { continue };
        let residual = difference(&law.along(index, model), strain);
        let squares: Vec<f64> = model.iter().map(|m| m * m).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        let weight = 1.0 / (range(strain).powi(2) * strain.len() as f64);
        let sensitivity: f64 = squares.iter().map(|square| (square - mean).powi(2)).sum();
        information += weight * sensitivity;
        variance += weight * weight * sensitivity * rms(&residual).powi(2) * correlation_length_samples(&residual);
    }
    let gamma = law.gamma_m2_per_a2;
    let saturation = hysteresis.saturation_magnetization_a_per_m;
    Some(StrainReport {
        gamma_m2_per_a2: Estimate {
            value: gamma,
            standard_deviation: variance.sqrt() / information,
        },
        saturation_magnetostriction: 2.0 * gamma * saturation * saturation / 3.0,
    })
}

fn agreement(polished: &[Polished<'_>], curves: Vec<(Anhysteretic, f64)>, effort: Effort) -> SearchReport {
    let limit = (1.0 + AGREEMENT) * polished[0].nrmse();
    let agreeing: Vec<Hysteresis> = polished
        .iter()
        .filter(|problem| problem.nrmse() <= limit)
        .filter_map(Polished::hysteresis)
        .collect();
    let spread = |parameter: HysteresisParameter| {
        let values: Vec<f64> = agreeing.iter().map(|hysteresis| parameter.of(hysteresis)).collect();
        let (low, high) = anhyst_measured::sweep::extremes(&values);
        (parameter, low, high)
    };
    SearchReport {
        seed: effort.seed,
        candidates: effort.candidates,
        starts: polished.len(),
        agreeing_starts: agreeing.len(),
        spread: HysteresisParameter::ALL.into_iter().map(spread).collect(),
        curves,
    }
}

fn assumptions(observation: &Observation) -> Vec<String> {
    let mut all = vec![
        "NRMSE is the rms residual over the measured range of the loop; the joint figure is the root of the mean square over loops".to_owned(),
        "standard deviations take errors as stationary along each loop, correlated over the length given for it and unrelated to the parameters".to_owned(),
    ];
    if observation.free_offset {
        all.push("the zero of the magnetization of each loop is the instrument's and was fitted".to_owned());
    }
    for (beginning, sentence) in [
        (
            Beginning::Cycled,
            "closed loops were run twice, from the demagnetised state or, where the field does not go as far either way, from their first magnetization, \
             and compared on the second run",
        ),
        (
            Beginning::Measured,
            "sweeps start at their first measured magnetization, less the instrument's zero",
        ),
        (
            Beginning::Fitted,
            "the first magnetization of sweeps that do not close was fitted",
        ),
    ] {
        if observation.loops.iter().any(|of| of.beginning == beginning) {
            all.push(sentence.to_owned());
        }
    }
    all
}

fn difference(model: &[f64], measured: &[f64]) -> Vec<f64> {
    model
        .iter()
        .zip(measured)
        .map(|(model, measured)| model - measured)
        .collect()
}

fn rms(series: &[f64]) -> f64 {
    (series.iter().map(|value| value * value).sum::<f64>() / series.len() as f64).sqrt()
}
