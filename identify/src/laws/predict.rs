//! A free run of a law along records, and how far it is from what was measured.

use anhyst_model::{HysteresisLaw, LawModel};
use serde::Serialize;

use super::{LawData, LawFile, LawRecord, Start};

/// What a model made of records, and its distance.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// One series a record, the length of the record's.
    pub modelled: Vec<Vec<f64>>,
    pub error: Distance,
    /// The same of each record.
    pub records: Vec<Distance>,
}

/// Of a modelled and a measured output, in the output's SI unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distance {
    pub samples: usize,
    pub rms: f64,
    /// With the mean taken off: a sensor's zero is anybody's.
    pub rms_after_mean: f64,
    pub max: f64,
    /// Of what was measured, highest less lowest.
    pub range: f64,
}

impl Distance {
    /// Of pairs (modelled, measured).
    pub fn of(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let errors = pairs.clone().map(|(modelled, measured)| modelled - measured);
        let samples = errors.clone().count();
        let count = samples.max(1) as f64;
        let mean = errors.clone().sum::<f64>() / count;
        let rms_about = |zero: f64| (errors.clone().map(|error| (error - zero).powi(2)).sum::<f64>() / count).sqrt();
        let [low, high] = pairs.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, measured)| {
            [low.min(measured), high.max(measured)]
        });
        Distance {
            samples,
            rms: rms_about(0.0),
            rms_after_mean: rms_about(mean),
            max: errors.fold(0.0, |most: f64, error| most.max(error.abs())),
            range: high - low,
        }
    }
}

/// The free run along one record.
pub(super) fn run_along(model: &LawModel, start: Start, record: &LawRecord, input_extent: [f64; 2]) -> Vec<f64> {
    let mut state = start.state(model, record, input_extent);
    let mut modelled = Vec::with_capacity(record.len());
    for (sample, input) in record.input.iter().enumerate() {
        if sample > 0 {
            model.pass(&mut state, record.passed_s(sample));
            model.advance(&mut state, *input);
        }
        modelled.push(model.output(&state));
    }
    modelled
}

/// Runs a law freely along every record of a file.
pub fn predict(law: &LawFile, data: &LawData) -> Prediction {
    let data = &data.reacted(law.reaction, law.start == Start::Rest);
    let own = data.input_extent;
    let extent = [own[0].min(law.input_extent[0]), own[1].max(law.input_extent[1])];
    let modelled: Vec<Vec<f64>> = data
        .records
        .iter()
        .map(|record| {
            let mut run = run_along(&law.model, law.start, record, extent);
            law.told(&mut run);
            run
        })
        .collect();
    Prediction::new(modelled, data)
}

impl Prediction {
    /// Of series that a model has made, one a record.
    pub fn new(modelled: Vec<Vec<f64>>, data: &LawData) -> Self {
        let pairs = |(made, record): (&Vec<f64>, &LawRecord)| {
            let pairs = made.iter().copied().zip(record.output.iter().copied());
            pairs.collect::<Vec<_>>()
        };
        let each: Vec<Vec<(f64, f64)>> = modelled.iter().zip(&data.records).map(pairs).collect();
        Prediction {
            error: Distance::of(each.iter().flatten().copied()),
            records: each.iter().map(|record| Distance::of(record.iter().copied())).collect(),
            modelled,
        }
    }
}
