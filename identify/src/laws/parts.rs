//! What is kept back in turn: whole records, or parts of a single one.

use anhyst_measured::sweep;

use super::{LawData, LawOptions, LawRecord};

/// Of the whole range: no record counts as smaller.
pub(super) const SMALLEST: f64 = 0.1;
/// Segments of a single record that are kept back alternately.
const SEGMENTS: usize = 20;
/// Parts of motions of one size.
const SIZES: usize = 4;
/// Fewer motions than this between turns of the input cannot be told by their amplitude.
const LEAST_MOTIONS: usize = 10;
/// The amplitude changes if a tenth of the motions is smaller than this share of the middle one.
const CHANGING: f64 = 0.8;
/// The sensor's filter and the stage's mode answer a jump at the start of a run: so many samples are not fitted.
const SETTLING: usize = 20;

/// Where each sample belongs: its fold, its weight; fold `None` is not fitted.
pub(super) struct Parts {
    pub folds: usize,
    pub of: Vec<Vec<(Option<usize>, f64)>>,
}

impl Parts {
    pub fn of(data: &LawData, options: &LawOptions) -> Self {
        let records = data.records.len();
        let range = data.output_range();
        let shares = if records == 1 {
            shares(&data.records[0])
        } else {
            Vec::new()
        };
        let folds = match records {
            1 => 1 + shares.iter().copied().max().unwrap_or(0),
            2..=4 => records,
            _ => options.folds.min(records),
        };
        let of_record = |(index, record): (usize, &LawRecord)| {
            let settling = if record.time_s.is_some() {
                SETTLING.min(record.len() / 50)
            } else {
                0
            };
            // Small loops count for more than their size, if not as much as large ones.
            let own_range = record.range().max(SMALLEST * range);
            let weight = range / own_range;
            (0..record.len())
                .map(|sample| {
                    let fold = if records == 1 { shares[sample] } else { index % folds };
                    ((sample >= settling).then_some(fold), weight)
                })
                .collect()
        };
        Parts {
            folds,
            of: data.records.iter().enumerate().map(of_record).collect(),
        }
    }
}

/// Which part each sample of each record belongs to; none where it is not fitted.
pub(super) fn folds(data: &LawData, options: &LawOptions) -> Vec<Vec<Option<usize>>> {
    let parts = Parts::of(data, options).of.into_iter();
    parts
        .map(|record| record.into_iter().map(|(fold, _)| fold).collect())
        .collect()
}

/// Which part of a single record each sample belongs to: where the amplitude changes, motions of one size make a part; else alternate segments.
fn shares(record: &LawRecord) -> Vec<usize> {
    let turns = sweep::turning_points(&record.input, sweep::DEFAULT_THRESHOLD);
    let ends: Vec<usize> = turns.into_iter().chain([record.len() - 1]).collect();
    let mut begin = 0;
    let mut spans = Vec::new();
    for end in &ends {
        spans.push((record.input[*end] - record.input[begin]).abs());
        begin = *end;
    }
    let mut sorted = spans.clone();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let small = sorted[sorted.len() / 10];
    if spans.len() < LEAST_MOTIONS || small > CHANGING * middle {
        return (0..record.len())
            .map(|sample| sample * SEGMENTS / record.len() % 2)
            .collect();
    }
    let below = |span: f64| sorted.partition_point(|own| *own < span);
    let mut of = Vec::with_capacity(record.len());
    for (end, span) in ends.iter().zip(&spans) {
        of.resize(*end, below(*span) * SIZES / spans.len());
    }
    of.resize(record.len(), 0);
    of
}
