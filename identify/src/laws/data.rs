//! Measured runs and sweeps as what a law sees: one input, one output, and time where there is one.

use anhyst_measured::{LAW_INPUTS, LAW_OUTPUTS, MeasuredRun, Quantity};
use anhyst_model::SlowLag;
use serde::{Deserialize, Serialize};

use super::LawError;

/// Fewer samples in all hold no law.
const LEAST_SAMPLES: usize = 20;
/// A sweep that ends where it began, to this share of the spans, has come round.
const CLOSED: f64 = 0.05;

/// A jump is longer than so many of the usual steps, and than this share of the input's extent.
const JUMP_STEPS: f64 = 5.0;
const JUMP: f64 = 0.04;
/// Fewer jumps make no reversal curves.
const LEAST_JUMPS: usize = 4;

/// One record in the order in which it was measured. Both series have one length, at least 2.
#[derive(Clone, Debug, PartialEq)]
pub struct LawRecord {
    pub id: String,
    /// SI units.
    pub input: Vec<f64>,
    /// SI units.
    pub output: Vec<f64>,
    /// s; none for a sweep.
    pub time_s: Option<Vec<f64>>,
}

impl LawRecord {
    pub fn len(&self) -> usize {
        self.input.len()
    }

    pub fn is_empty(&self) -> bool {
        self.input.is_empty()
    }

    /// s from the sample before; 0 without time.
    pub fn passed_s(&self, sample: usize) -> f64 {
        match &self.time_s {
            Some(time_s) if sample > 0 => time_s[sample] - time_s[sample - 1],
            _ => 0.0,
        }
    }

    /// It comes back to where it began, as a loop does.
    pub fn is_closed(&self) -> bool {
        let back = |series: &[f64]| {
            let [low, high] = extent(series.iter());
            (series[0] - series[series.len() - 1]).abs() <= CLOSED * (high - low)
        };
        self.time_s.is_none() && back(&self.input) && back(&self.output)
    }

    /// Output, highest less lowest.
    pub fn range(&self) -> f64 {
        let [low, high] = extent(self.output.iter());
        high - low
    }
}

/// The curves of a record that jumps back again and again, each time to another input, and then goes the other way: first-order reversal
/// curves one behind the other. Any other record stays one.
fn reversal_curves(record: &LawRecord) -> Vec<LawRecord> {
    let steps: Vec<f64> = record.input.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sizes: Vec<f64> = steps.iter().map(|step| step.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let [low, high] = extent(record.input.iter());
    let middle = sizes.get(sizes.len() / 2).copied().unwrap_or_default();
    let jump = (JUMP_STEPS * middle).max(JUMP * (high - low));
    let begins: Vec<usize> = (1..record.len())
        .filter(|sample| steps[sample - 1].abs() > jump)
        .collect();
    let [first, last] = extent(begins.iter().map(|begin| &record.input[*begin]));
    let rising = begins.first().is_some_and(|begin| steps[begin - 1] < 0.0);
    let back = |step: f64| if rising { step < 0.0 } else { step > 0.0 };
    // Between jumps it goes the other way; noise may turn it a little.
    let ways = |back_too: bool| -> f64 {
        let those = steps
            .iter()
            .filter(|step| step.abs() <= jump && (back(**step) == back_too));
        those.map(|step| step.abs()).sum()
    };
    let others = begins.iter().all(|begin| back(steps[begin - 1])) && ways(true) < 0.1 * ways(false);
    if begins.len() < LEAST_JUMPS || !others || last - first < 0.2 * (high - low) {
        return vec![record.clone()];
    }
    let bounds: Vec<usize> = std::iter::once(0).chain(begins).chain([record.len()]).collect();
    let curve = |(number, pair): (usize, &[usize])| LawRecord {
        id: format!("{} curve {number}", record.id),
        input: record.input[pair[0]..pair[1]].to_vec(),
        output: record.output[pair[0]..pair[1]].to_vec(),
        time_s: record.time_s.as_ref().map(|time_s| time_s[pair[0]..pair[1]].to_vec()),
    };
    let pairs = bounds.windows(2).filter(|pair| pair[1] - pair[0] > 1);
    pairs.enumerate().map(curve).collect()
}

/// Lowest and highest.
pub(super) fn extent<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(*value), high.max(*value)]
    })
}

/// How late the device sees its input: a delay, then a first-order lag. Amplifier, acquisition, and what moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reaction {
    pub delay_s: f64,
    pub lag_s: f64,
}

/// Records of one device.
#[derive(Clone, Debug, PartialEq)]
pub struct LawData {
    /// Where they come from.
    pub source: String,
    pub input: Quantity,
    pub output: Quantity,
    pub records: Vec<LawRecord>,
    /// Of the input over all records.
    pub input_extent: [f64; 2],
    /// Of the output over all records.
    pub output_extent: [f64; 2],
    /// Of a strain: the same records with the magnetization, if it is known, of which the strain is an even function.
    pub beneath: Option<Box<LawData>>,
    /// What the reader took the data for, in sentences.
    pub doubts: Vec<String>,
}

impl LawData {
    /// The first input of the runs ([`LAW_INPUTS`]) and the first output that was measured ([`LAW_OUTPUTS`]), unless they are named.
    ///
    /// # Errors
    /// Runs without them, or in which one of them stands still.
    pub fn of(runs: &[MeasuredRun], input: Option<Quantity>, output: Option<Quantity>) -> Result<Self, LawError> {
        let source = runs.first().map_or_else(String::new, |run| run.source.clone());
        let present = || {
            let held = Quantity::ALL
                .iter()
                .filter(|quantity| runs.iter().all(|run| run.series(**quantity).is_some()));
            held.map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ")
        };
        let in_all = |quantity: &Quantity| runs.iter().all(|run| run.series(*quantity).is_some());
        let measured = |quantity: &Quantity| in_all(quantity) && runs.iter().all(|run| run.column(*quantity).is_some());
        let none = || LawError::NoInput {
            source_of_data: source.clone(),
            present: present(),
        };
        let inputs = || {
            LAW_INPUTS
                .into_iter()
                .filter(|own| input.map_or_else(|| in_all(own), |input| *own == input))
        };
        // The first that was measured, else one that was made from others.
        let answer = |input: Quantity| match output {
            Some(output) => Some(output),
            None => {
                let others = || LAW_OUTPUTS.into_iter().filter(|own| *own != input);
                others().find(measured).or_else(|| others().find(in_all))
            }
        };
        let (input, output) = inputs()
            .find_map(|input| Some((input, answer(input).filter(|output| *output != input)?)))
            .ok_or_else(none)?;
        let series = |run: &MeasuredRun, wanted: Quantity, whose| {
            let series = run.series(wanted).map(<[f64]>::to_vec);
            series.ok_or_else(|| LawError::Missing {
                source_of_data: source.clone(),
                wanted,
                whose,
                present: present(),
            })
        };
        let record = |run: &MeasuredRun| {
            Ok(LawRecord {
                id: run.loop_id.clone(),
                input: series(run, input, "drives the law")?,
                output: series(run, output, "the law gives")?,
                time_s: run.time_s.clone(),
            })
        };
        let records: Vec<LawRecord> = runs.iter().map(record).collect::<Result<_, LawError>>()?;
        let records = if let [record] = &records[..] {
            reversal_curves(record)
        } else {
            records
        };
        let mut data = Self::of_records(source.clone(), input, output, records)?;
        data.doubts = runs.iter().flat_map(|run| run.doubts.clone()).collect();
        data.doubts.dedup();
        if output == Quantity::Strain && in_all(&Quantity::Magnetization) {
            data.beneath = Some(Box::new(Self::of(runs, Some(input), Some(Quantity::Magnetization))?));
        }
        Ok(data)
    }

    /// Of records that are in memory; `source` is what to call them.
    ///
    /// # Errors
    /// Too few samples, or a series that stands still.
    pub fn of_records(
        source: String,
        input: Quantity,
        output: Quantity,
        records: Vec<LawRecord>,
    ) -> Result<Self, LawError> {
        let samples: usize = records.iter().map(LawRecord::len).sum();
        if samples < LEAST_SAMPLES {
            return Err(LawError::TooFew {
                source_of_data: source,
                samples,
                least: LEAST_SAMPLES,
            });
        }
        let of = |series: fn(&LawRecord) -> &Vec<f64>| extent(records.iter().flat_map(series));
        let (input_extent, output_extent) = (of(|record| &record.input), of(|record| &record.output));
        for (quantity, [low, high]) in [(input, input_extent), (output, output_extent)] {
            if low >= high {
                return Err(LawError::Still {
                    source_of_data: source,
                    quantity,
                    value: low,
                });
            }
        }
        Ok(LawData {
            source,
            input,
            output,
            records,
            input_extent,
            output_extent,
            beneath: None,
            doubts: Vec::new(),
        })
    }

    /// The output falls as the input rises: a wire that shortens with heat, a sensor that looks from the other side.
    pub fn falls(&self) -> bool {
        let mut product = 0.0;
        for record in &self.records {
            let mean = |series: &[f64]| series.iter().sum::<f64>() / series.len() as f64;
            let (of_input, of_output) = (mean(&record.input), mean(&record.output));
            let each = record.input.iter().zip(&record.output);
            product += each
                .map(|(input, output)| (input - of_input) * (output - of_output))
                .sum::<f64>();
        }
        product < 0.0
    }

    /// With the output turned round.
    pub(super) fn turned(&self) -> LawData {
        let [low, high] = self.output_extent;
        let mut turned = self.clone();
        turned.output_extent = [-high, -low];
        for record in &mut turned.records {
            record.output.iter_mut().for_each(|output| *output = -*output);
        }
        turned
    }

    /// All ways of the input, in parts of its extent.
    pub(super) fn input_way(&self) -> f64 {
        let of = |record: &LawRecord| -> f64 { record.input.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum() };
        self.records.iter().map(of).sum::<f64>() / (self.input_extent[1] - self.input_extent[0])
    }

    /// Samples in all.
    pub fn samples(&self) -> usize {
        self.records.iter().map(LawRecord::len).sum()
    }

    /// Output, highest less lowest.
    pub fn output_range(&self) -> f64 {
        self.output_extent[1] - self.output_extent[0]
    }

    /// s between samples of the longest record, on average; none without time.
    pub fn tick_s(&self) -> Option<f64> {
        let longest = self
            .records
            .iter()
            .filter(|_| self.has_time())
            .max_by_key(|record| record.len())?;
        let time_s = longest.time_s.as_ref()?;
        Some((time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64)
    }

    /// The input as the device sees it; `from_rest`: before the first sample it was 0, else as in that.
    pub fn reacted(&self, reaction: Reaction, from_rest: bool) -> LawData {
        if reaction == Reaction::default() {
            return self.clone();
        }
        let record = |record: &LawRecord| {
            let Some(time_s) = &record.time_s else {
                return record.clone();
            };
            let before = if from_rest { 0.0 } else { record.input[0] };
            let (mut seen, mut next) = (before, 0);
            let mut delayed = before;
            let input = (0..record.len()).map(|sample| {
                // What was held since the sample before.
                if reaction.lag_s > 0.0 {
                    seen += SlowLag::share_in(reaction.lag_s, record.passed_s(sample)) * (delayed - seen);
                }
                // A hundredth of a step is no delay.
                let due_s = time_s[sample] - reaction.delay_s + 0.01 * record.passed_s(sample);
                while next <= sample && time_s[next] <= due_s {
                    delayed = record.input[next];
                    next += 1;
                }
                if reaction.lag_s > 0.0 { seen } else { delayed }
            });
            LawRecord {
                input: input.collect(),
                ..record.clone()
            }
        };
        let records: Vec<LawRecord> = self.records.iter().map(record).collect();
        LawData {
            input_extent: extent(records.iter().flat_map(|record| &record.input)),
            records,
            beneath: self
                .beneath
                .as_ref()
                .map(|own| Box::new(own.reacted(reaction, from_rest))),
            ..self.clone()
        }
    }

    /// Time is known in every record.
    pub fn has_time(&self) -> bool {
        self.records.iter().all(|record| record.time_s.is_some())
    }
}
