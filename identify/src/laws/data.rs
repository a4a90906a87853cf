//! Measured runs and sweeps as what a law sees: one input, one output, and time where there is one.

use anhyst_measured::{INPUTS, MeasuredRun, OUTPUTS, Quantity};
use anhyst_model::SlowLag;
use serde::{Deserialize, Serialize};

use super::LawError;

/// Fewer samples in all hold no law.
const LEAST_SAMPLES: usize = 20;
/// A sweep that ends where it began, to this share of the spans, has come round.
const CLOSED: f64 = 0.05;

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
}

impl LawData {
    /// The first input of the runs (command, field, current, voltage) and the first output that was measured (displacement,
    /// magnetization, flux density, strain), unless they are named.
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
        let input = match input {
            Some(input) => input,
            None => INPUTS.into_iter().find(in_all).ok_or_else(none)?,
        };
        // Strain last: over a field it is no hysteresis of one input but the square of one.
        let preferred = [
            Quantity::Displacement,
            Quantity::Magnetization,
            Quantity::FluxDensity,
            Quantity::Strain,
        ];
        let output = match output {
            Some(output) => output,
            None => {
                let first = preferred.into_iter().find(measured);
                first.or_else(|| OUTPUTS.into_iter().find(in_all)).ok_or_else(none)?
            }
        };
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
        let mut data = Self::of_records(source.clone(), input, output, records)?;
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
        })
    }

    /// Refuses an output that falls as the input rises, as an inverted sensor gives it.
    ///
    /// # Errors
    /// [`LawError::Falls`].
    pub fn refuse_falling(&self) -> Result<(), LawError> {
        let mut sums = [0.0; 3];
        for record in &self.records {
            let mean = |series: &[f64]| series.iter().sum::<f64>() / series.len() as f64;
            let (of_input, of_output) = (mean(&record.input), mean(&record.output));
            for (input, output) in record.input.iter().zip(&record.output) {
                let (input, output) = (input - of_input, output - of_output);
                sums[0] += input * input;
                sums[1] += input * output;
                sums[2] += output * output;
            }
        }
        let correlation = sums[1] / (sums[0] * sums[2]).sqrt();
        if correlation < -0.3 {
            return Err(LawError::Falls {
                source_of_data: self.source.clone(),
                input: self.input,
                output: self.output,
                correlation,
            });
        }
        Ok(())
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
