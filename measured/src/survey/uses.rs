//! What the commands that read measurements make of a table, and what looks odd in it.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::check::{Finding, FindingKind, first_things};
use crate::error::MeasuredError;
use crate::quantity::Quantity;
use crate::run::{LAW_INPUTS, LAW_OUTPUTS, MeasuredRun, OF_LOOPS, OUTPUTS, RunReadOptions};
use crate::sheet::Sheet;

/// Either drives the domain wall model.
const INPUTS_OF_ESTIMATE: [Quantity; 2] = [Quantity::FieldCommand, Quantity::Field];

/// A command, and what it reads or why not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Use {
    pub commands: &'static str,
    /// It is read.
    pub reads: bool,
    pub says: String,
}

impl Use {
    fn of<Read>(
        commands: &'static str,
        read: &Result<Read, MeasuredError>,
        says: impl FnOnce(&Read) -> String,
    ) -> Self {
        Use {
            commands,
            reads: read.is_ok(),
            says: match read {
                Ok(read) => says(read),
                Err(refusal) => refusal.to_string(),
            },
        }
    }
}

/// What is said of a table that is read as proposed.
pub(super) struct Said {
    pub uses: Vec<Use>,
    pub remarks: Vec<String>,
    /// Columns with the other sign, as they are to be read instead.
    pub turned: Vec<String>,
}

/// Of a table with its mappings.
pub(super) fn uses(mut sheet: Sheet, options: &RunReadOptions) -> Said {
    let run = MeasuredRun::of(&sheet, options);
    let records = MeasuredRun::records_of(&sheet, options);
    // Who fits loops names no others.
    sheet.mappings.retain(|mapping| OF_LOOPS.contains(&mapping.quantity));
    let loops = MeasuredRun::loops_of(&sheet, options);
    let has_field = |run: &MeasuredRun| INPUTS_OF_ESTIMATE.into_iter().any(|own| run.series(own).is_some());
    let without_field = run.as_ref().is_ok_and(|run| !has_field(run));
    let by = if without_field {
        "diagnose"
    } else {
        "estimate, diagnose"
    };
    let mut uses = vec![
        Use::of(by, &run, |run| one(run, &all_sides(run))),
        Use::of("fit --law, predict", &records, |records| match &records[..] {
            [record] => one(record, &law_sides(record)),
            several => format!("{} records, {}", several.len(), law_sides(&several[0])),
        }),
        Use::of("fit", &loops, |loops| {
            let s = if loops.len() == 1 { "" } else { "s" };
            format!("{} loop{s} of magnetization over field", loops.len())
        }),
    ];
    if without_field {
        uses.push(Use {
            commands: "estimate",
            reads: false,
            says: "neither a field command nor a measured field".to_owned(),
        });
    }
    let mut remarks = BTreeSet::new();
    for record in records.iter().flatten() {
        remarks.extend(record.doubts.iter().cloned());
    }
    let odd = run.as_ref().map(odd).unwrap_or_default();
    let of_sign = odd.iter().filter(|finding| finding.kind == FindingKind::Sign);
    let turned = of_sign.flat_map(|finding| finding.amended_columns.clone()).collect();
    remarks.extend(odd.into_iter().map(|finding| finding.sentence));
    Said {
        uses,
        remarks: remarks.into_iter().collect(),
        turned,
    }
}

/// What is wrong with a run if its outputs follow what drives it; a sign, a stuck channel, a shift.
fn odd(run: &MeasuredRun) -> Vec<Finding> {
    let Some(drive) = run.inputs().next() else {
        return Vec::new();
    };
    // A model that is not there: the drive itself, as large as the output.
    let follows = |run: &MeasuredRun| {
        let drive = [Quantity::FieldCommand, Quantity::Field]
            .into_iter()
            .find_map(|quantity| run.series(quantity))?;
        let (own, middle) = spread(drive);
        let like = |output: Quantity| {
            let series = run.series(output)?;
            let (size, centre) = spread(series);
            let scaled = drive.iter().map(|value| centre + (value - middle) * size / own);
            Some((output, scaled.collect::<Vec<f64>>()))
        };
        Some(run.outputs().filter_map(like).collect::<Vec<_>>())
    };
    let driven = match drive {
        Quantity::Voltage | Quantity::Current => run.clone().driven_by(drive),
        _ => run.clone(),
    };
    let found = first_things(&driven, &follows).into_iter();
    // An output may come late, and a size says nothing without a model.
    let told = found.filter(|finding| {
        let of_output = OUTPUTS.contains(&finding.channel);
        !(finding.kind == FindingKind::Scale && of_output) && (of_output || driven == *run)
    });
    told.collect()
}

/// Standard deviation and mean.
fn spread(series: &[f64]) -> (f64, f64) {
    let count = series.len() as f64;
    let mean = series.iter().sum::<f64>() / count;
    let squares: f64 = series.iter().map(|value| (value - mean) * (value - mean)).sum();
    ((squares / count).sqrt(), mean)
}

fn one(run: &MeasuredRun, sides: &str) -> String {
    let rate = match run.tick_s {
        Some(tick_s) => format!(" at {} Hz", six_digits(1.0 / tick_s)),
        None => ", no uniform clock".to_owned(),
    };
    let repair = run
        .repair
        .as_ref()
        .map_or_else(String::new, |repair| format!("; {repair}"));
    format!("{} samples{rate}, {sides}{repair}", run.len())
}

/// Without digits that say nothing.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// "field command and field to displacement".
fn all_sides(run: &MeasuredRun) -> String {
    let names = |list: &mut dyn Iterator<Item = Quantity>| list.map(Quantity::name).collect::<Vec<_>>().join(" and ");
    format!("{} to {}", names(&mut run.inputs()), names(&mut run.outputs()))
}

/// What a law is fitted between, if nothing else is asked for.
fn law_sides(run: &MeasuredRun) -> String {
    let there = |quantity: &Quantity| run.series(*quantity).is_some();
    let input = LAW_INPUTS.into_iter().find(there);
    let output = LAW_OUTPUTS
        .into_iter()
        .find(|quantity| there(quantity) && Some(*quantity) != input);
    let name = |quantity: Option<Quantity>| quantity.map_or("nothing", Quantity::name);
    format!("{} to {}", name(input), name(output))
}
