//! Sign, unit and place of each column: which single change of how the file is read makes command, field and outputs agree?
//!
//! Badness of a run: Σ (1 − ρ) + max(0, abs(log₁₀ r) − ½)² over the field against the command and every output against the
//! model's, ρ their correlation, r the ratio of their standard deviations. An effect moves ρ by tenths and r by a factor of two; another
//! sign moves ρ by two, another unit r by three decades. A change is accepted if it takes a whole point off, and what is left is small.

use std::collections::BTreeMap;

use super::finding::{Expected, Finding, FindingKind, as_read, exchanged, pasted, rescaled};
use crate::quantity::{OERSTED_A_PER_M, Quantity};
use crate::run::{MeasuredRun, correlation};
use crate::units;

/// What a nominal model makes of a run: outputs by quantity, sample by sample; none if it cannot be run on it.
pub type Simulate<'a> = dyn Fn(&MeasuredRun) -> Option<Vec<(Quantity, Vec<f64>)>> + 'a;

/// Decades by which a unit may be off for reasons of physics.
const DECADES: f64 = 0.5;
/// A change that takes less than this off the badness changes nothing.
const GAIN: f64 = 1.0;
/// Badness a relation with which a run is understood.
const UNDERSTOOD: f64 = 0.4;
/// Changes nearer than this are equally good: an output is taken before what drives it, a usual unit before a rare one.
const TIE: f64 = 0.05;
/// A column e times farther from what is usual speaks against a change.
const OF_ODD: f64 = 0.05;
/// Two mistakes at once must explain this much more than one.
const OF_TWO: f64 = 0.3;
/// Shapes are not told apart below this 1 − ρ.
const LIKE_ENOUGH: f64 = 1e-4;
/// An output that the model cannot be run to.
const UNKNOWN: f64 = 2.0;
/// Beyond any coil, A/m: a model is not run there for minutes.
const MAX_FIELD_A_PER_M: f64 = 1e6;
/// Wrong columns that are told at once.
const MAX_CHANGES: usize = 3;
/// The longest delay that is thought of as one, s.
const MAX_DELAY_S: f64 = 0.05;

/// What was found, and the run as it should have been read.
pub(super) struct Labels {
    pub findings: Vec<Finding>,
    pub run: MeasuredRun,
    pub expected: Vec<Expected>,
}

/// One way to read the file otherwise.
#[derive(Clone, Debug)]
enum Change {
    /// Columns whose values are multiplied.
    Multiply(Vec<Quantity>, f64),
    Exchange(Quantity, Quantity),
}

/// A reading and how well it agrees.
struct Reading {
    run: MeasuredRun,
    outputs: Vec<(Quantity, Vec<f64>)>,
    relations: Vec<Relation>,
}

/// How a measured series agrees with what it should be like.
struct Relation {
    of: Quantity,
    correlation: f64,
    ratio: f64,
}

impl Relation {
    fn of(of: Quantity, measured: &[f64], expected: &[f64]) -> Self {
        let correlation = correlation(measured, expected);
        Relation {
            of,
            correlation: if correlation.is_finite() { correlation } else { 0.0 },
            ratio: deviation(measured) / deviation(expected),
        }
    }

    fn badness(&self) -> f64 {
        let decades = self.ratio.log10().abs();
        // A model that does not move says nothing of units.
        let excess = if decades.is_finite() {
            (decades - DECADES).max(0.0)
        } else {
            0.0
        };
        1.0 - self.correlation + excess * excess
    }
}

impl Reading {
    fn of(run: MeasuredRun, outputs: Vec<(Quantity, Vec<f64>)>) -> Self {
        let mut relations = Vec::new();
        if let (Some(field), Some(command)) = (run.series(Quantity::Field), run.series(Quantity::FieldCommand)) {
            relations.push(Relation::of(Quantity::Field, field, command));
        }
        for (quantity, expected) in &outputs {
            let measured = run.series(*quantity).filter(|own| own.len() == expected.len());
            relations.extend(measured.map(|own| Relation::of(*quantity, own, expected)));
        }
        Reading {
            run,
            outputs,
            relations,
        }
    }

    fn badness(&self) -> f64 {
        let known: f64 = self.relations.iter().map(Relation::badness).sum();
        known + UNKNOWN * (self.wanted().count() - self.outputs.len()) as f64
    }

    /// How alike the shapes are, for changes that all bring signs and sizes right: a tenth of Σ ln(1 − ρ).
    fn shape(&self) -> f64 {
        let unlike = |relation: &Relation| (1.0 - relation.correlation).max(LIKE_ENOUGH).ln();
        0.1 * self.relations.iter().map(unlike).sum::<f64>()
    }

    /// Outputs that a model could be held against.
    fn wanted(&self) -> impl Iterator<Item = Quantity> {
        self.run.outputs().filter(|own| *own != Quantity::FluxDensity)
    }

    fn understood(&self) -> bool {
        self.badness() < UNDERSTOOD * self.relations.len() as f64
    }

    fn relation(&self, of: Quantity) -> Option<&Relation> {
        // The magnetization is the flux density's witness.
        let own = if of == Quantity::FluxDensity {
            Quantity::Magnetization
        } else {
            of
        };
        self.relations.iter().find(|relation| relation.of == own)
    }

    /// Everything that could be read otherwise.
    fn changes(&self) -> Vec<Change> {
        let run = &self.run;
        let own = |quantity: &Quantity| run.series(*quantity).is_some() && !run.is_derived(*quantity);
        let drives: Vec<Quantity> = [Quantity::FieldCommand, Quantity::Field]
            .into_iter()
            .filter(own)
            .collect();
        let outputs: Vec<Quantity> = run.outputs().filter(own).collect();
        let mut changes = Vec::new();
        let mut multiply = |quantities: &[Quantity]| {
            for factor in factors(quantities[0]) {
                changes.push(Change::Multiply(quantities.to_vec(), factor));
            }
        };
        let channels: Vec<Quantity> = outputs.iter().chain(&drives).copied().collect();
        channels.iter().for_each(|quantity| multiply(&[*quantity]));
        if drives.len() > 1 {
            multiply(&drives);
        }
        if run.tick_s.is_some() {
            multiply(&[Quantity::Time]);
        }
        for (at, one) in channels.iter().enumerate() {
            let others = channels[at + 1..]
                .iter()
                .filter(|other| !drives.contains(one) || !drives.contains(other));
            changes.extend(others.map(|other| Change::Exchange(*one, *other)));
        }
        changes
    }

    fn with(&self, change: &Change, simulate: &Simulate) -> Option<Self> {
        let mut run = self.run.clone();
        let changed = match change {
            Change::Multiply(quantities, factor) => {
                quantities.iter().for_each(|quantity| run.multiply(*quantity, *factor));
                quantities.clone()
            }
            Change::Exchange(one, other) => {
                let [scale, other_scale] = [one, other].map(|own| as_read(&self.run, *own).1);
                run.exchange(*one, *other, scale / other_scale);
                vec![*one, *other]
            }
        };
        // A sweep begins at its magnetization.
        let simulated = run.tick_s.is_none() || changed.contains(&driven_by(&run)) || changed.contains(&Quantity::Time);
        let outputs = if simulated {
            possible(&run).then(|| simulate(&run))??
        } else {
            self.outputs.clone()
        };
        Some(Reading::of(run, outputs))
    }
}

pub(super) fn check(run: &MeasuredRun, simulate: &Simulate) -> Labels {
    let outputs = possible(run).then(|| simulate(run)).flatten();
    let given = Reading::of(run.clone(), outputs.unwrap_or_default());
    let (mut best, mut findings) = (None, Vec::new());
    for _ in 0..MAX_CHANGES {
        let now = best.as_ref().unwrap_or(&given);
        let Some((change, next)) = better(now, simulate) else {
            break;
        };
        findings.push(finding(now, &next, &change));
        best = Some(next);
    }
    // Half an explanation is none.
    let last = match best {
        Some(best) if best.understood() => best,
        _ => {
            findings.clear();
            given
        }
    };
    let mut expected: Vec<Expected> = Vec::new();
    if let (Some(_), Some(command)) = (
        last.run.series(Quantity::Field),
        last.run.series(Quantity::FieldCommand),
    ) {
        expected.push(Expected {
            of: Quantity::Field,
            series: command.to_vec(),
        });
    }
    expected.extend(last.outputs.into_iter().map(|(of, series)| Expected { of, series }));
    Labels {
        findings,
        run: last.run,
        expected,
    }
}

/// The change that explains most, if any explains anything.
fn better(now: &Reading, simulate: &Simulate) -> Option<(Change, Reading)> {
    let worst = now.badness();
    if worst < GAIN {
        return None;
    }
    let tried = now.changes().into_iter().filter_map(|change| {
        let next = now.with(&change, simulate)?;
        (next.badness() + GAIN < worst).then_some((change, next))
    });
    let tried: Vec<(Change, Reading)> = tried.collect();
    let cost = |(change, next): &(Change, Reading)| {
        next.badness() + next.shape() + change.mistakes() * OF_TWO + oddity(&next.run) * OF_ODD
    };
    let least = tried.iter().map(cost).fold(f64::INFINITY, f64::min);
    tried.into_iter().find(|own| cost(own) < least + TIE)
}

impl Change {
    /// Beyond the first.
    fn mistakes(&self) -> f64 {
        match self {
            Change::Multiply(quantities, factor) if quantities.len() > 1 || *factor < 0.0 && *factor != -1.0 => 1.0,
            _ => 0.0,
        }
    }
}

fn driven_by(run: &MeasuredRun) -> Quantity {
    match run.series(Quantity::FieldCommand) {
        Some(_) => Quantity::FieldCommand,
        None => Quantity::Field,
    }
}

/// A drive that a coil can make.
fn possible(run: &MeasuredRun) -> bool {
    let drive = run.series(driven_by(run)).unwrap_or_default();
    drive.iter().all(|value| value.abs() < MAX_FIELD_A_PER_M)
}

/// How far the columns lie from what is usual.
fn oddity(run: &MeasuredRun) -> f64 {
    let time = run
        .time_s
        .as_deref()
        .map_or(0.0, |values| units::oddity(Quantity::Time, values));
    let drives = [Quantity::FieldCommand, Quantity::Field].into_iter();
    let all = drives.chain(run.outputs());
    let of = |quantity: Quantity| {
        run.series(quantity)
            .map_or(0.0, |values| units::oddity(quantity, values))
    };
    time + all.map(of).sum::<f64>()
}

/// By what a column of this quantity may be wrong.
fn factors(quantity: Quantity) -> Vec<f64> {
    let units: &[f64] = match quantity {
        Quantity::FieldCommand | Quantity::Field => &[1e3, OERSTED_A_PER_M],
        Quantity::Displacement => &[1e3, 1e6, 1e9],
        Quantity::FluxDensity => &[1e3, 1e4],
        _ => &[1e3, 1e6],
    };
    let either = |unit: &f64| [*unit, 1.0 / unit];
    let scales: Vec<f64> = units.iter().flat_map(either).collect();
    if quantity == Quantity::Time {
        return scales;
    }
    let signs = std::iter::once(&1.0).chain(&scales).map(|scale| -scale);
    signs.chain(scales.iter().copied()).collect()
}

fn finding(now: &Reading, next: &Reading, change: &Change) -> Finding {
    let run = &now.run;
    let (kind, channel, said, amended_columns) = match change {
        Change::Exchange(one, other) => (
            FindingKind::Swapped,
            *one,
            format!("{} and {} changed places", one.name(), other.name()),
            exchanged(run, *one, *other),
        ),
        Change::Multiply(quantities, factor) => {
            let names: Vec<&str> = quantities.iter().map(|quantity| quantity.name()).collect();
            let names = names.join(" and ");
            let amended = quantities
                .iter()
                .map(|quantity| rescaled(run, *quantity, *factor))
                .collect();
            let (kind, said) = match (factor.abs() == 1.0, *factor < 0.0) {
                (true, _) => (FindingKind::Sign, format!("{names} has the other sign")),
                (false, true) => {
                    let scale = looks_like(run, quantities[0], factor.abs());
                    (FindingKind::Scale, format!("{names} has the other sign, and {scale}"))
                }
                (false, false) => {
                    let scale = looks_like(run, quantities[0], *factor);
                    (FindingKind::Scale, format!("{names} {scale}"))
                }
            };
            (kind, quantities[0], said, amended)
        }
    };
    let mut evidence = BTreeMap::from([("badness", now.badness()), ("badness_amended", next.badness())]);
    let mut figures = String::new();
    let shown = now.relation(channel).or(now.relations.last());
    if let Some(before) = shown
        && let Some(after) = next.relation(before.of)
    {
        evidence.extend([
            ("correlation", before.correlation),
            ("correlation_amended", after.correlation),
            ("ratio", before.ratio),
            ("ratio_amended", after.ratio),
        ]);
        let against = if before.of == Quantity::Field {
            "command"
        } else {
            "model's"
        };
        figures = format!(
            "the correlation of the {} with the {against} is {:.3} and its size {:.3e} of that one, amended {:.3} and {:.3}",
            before.of.name(),
            before.correlation,
            before.ratio,
            after.correlation,
            after.ratio
        );
    }
    if kind == FindingKind::Sign
        && let Some(delay_s) = as_delay(now, channel)
    {
        evidence.insert("delay_s", delay_s);
        figures += &format!("; a delay of {:.1} ms would look alike", 1e3 * delay_s);
    }
    Finding {
        kind,
        channel,
        sentence: format!("{said}: {figures}. Read it with {}", pasted(&amended_columns)),
        amended_columns,
        evidence,
    }
}

/// The unit that a column is in if its values are to be multiplied.
fn looks_like(run: &MeasuredRun, quantity: Quantity, factor: f64) -> String {
    let (_, scale, _) = as_read(run, quantity);
    match quantity.unit_of(scale * factor) {
        Some(symbol) => format!("looks like {symbol}"),
        None if factor > 1.0 => format!("is {factor} times too small"),
        None => format!("is {:.0} times too large", 1.0 / factor),
    }
}

/// A delay of the channel that would explain another sign as well.
fn as_delay(now: &Reading, channel: Quantity) -> Option<f64> {
    let tick_s = now.run.tick_s?;
    let measured = now.run.series(channel)?;
    let (_, expected) = now.outputs.iter().find(|(of, _)| *of == channel)?;
    let most = ((MAX_DELAY_S / tick_s) as usize).min(measured.len() / 4);
    let against = now.relation(channel)?.correlation;
    let alike = |lag: &usize| correlation(&measured[*lag..], &expected[..expected.len() - lag]) > 0.98 * against.abs();
    (1..most).find(alike).map(|lag| lag as f64 * tick_s)
}

fn deviation(series: &[f64]) -> f64 {
    let count = series.len() as f64;
    let mean = series.iter().sum::<f64>() / count;
    (series.iter().map(|own| (own - mean) * (own - mean)).sum::<f64>() / count).sqrt()
}
