//! Is anything missing? The residual is held against every direction in which something unlisted or listed would move it.
//!
//! For a group of directions D (columns, after the fitted columns C are taken out of D and of the residual z) the statistic
//! S = (Dᵀz)ᵀ(DᵀD)⁻¹(Dᵀz) is χ² with rank(D) degrees of freedom if z is white noise of variance one. Groups are the answers
//! of the outputs to each term of the library, and generic bumps: sums of z over boxes of field, rate, magnetization,
//! output, its velocity, temperature and time, and of field by sign of rate. The family of groups shares a false-alarm rate of
//! `FAMILY` by Bonferroni's bound. Whiteness is not asked: an effect can be white and missing, or slow and below the noise.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use anhyst_identify::engine::{Span, dot};

use crate::observation::Observation;
use crate::screening::{Screened, solve};
use crate::statistics::{chi_square_tail, quantile, sorted};
use crate::system::{ChannelKind, Signals};
use crate::term::Term;

/// False alarms of the whole family, where nothing is missing.
pub(crate) const FAMILY: f64 = 0.01;

/// One group of directions and what the residual says to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreGroup {
    /// A term's name, or what the bumps stand over.
    pub name: String,
    pub statistic: f64,
    pub degrees: usize,
    /// Probability of as much by chance, for this group alone.
    pub tail: f64,
}

/// The test as a whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScoreTest {
    /// Most telling first.
    pub groups: Vec<ScoreGroup>,
    /// Smallest tail times the number of groups, at most 1.
    pub family_tail: f64,
}

impl ScoreTest {
    /// Something is missing.
    pub fn alarmed(&self) -> bool {
        self.family_tail < FAMILY
    }

    fn of(mut groups: Vec<ScoreGroup>) -> Self {
        groups.sort_by(|one, other| {
            // Tails underflow together; then the larger excess tells more.
            let excess = |group: &ScoreGroup| group.statistic - group.degrees as f64;
            one.tail
                .total_cmp(&other.tail)
                .then(excess(other).total_cmp(&excess(one)))
        });
        let smallest = groups.first().map_or(1.0, |group| group.tail);
        ScoreTest {
            family_tail: (smallest * groups.len() as f64).min(1.0),
            groups,
        }
    }
}

/// What the test looks at.
pub(crate) struct Scored<'a> {
    pub observation: &'a Observation,
    /// Whitened residual on all rows.
    pub residual: &'a [f64],
    /// What the fit behind it could move.
    pub columns: &'a [Vec<f64>],
    pub signals: &'a [Signals],
}

/// The directed test over the library's directions and generic bumps.
pub(crate) fn score(scored: &Scored, library: &[Screened]) -> ScoreTest {
    let fitted = Span::of(scored.columns, &scored.observation.training);
    let residual = fitted.without(scored.residual.to_vec());
    let mut groups = Vec::new();
    for screened in library {
        for (number, directions) in screened.directions.iter().enumerate() {
            if let Some(mut group) = directed(scored, &fitted, &residual, directions) {
                group.name = screened.term.name().to_owned();
                if screened.term.is_line() {
                    // Its frequency was chosen among as many as there are rows, because the residual is high there.
                    group.tail = (group.tail * scored.observation.training_rows() as f64).min(1.0);
                }
                if number > 0 {
                    group.name += &format!(" ({})", number + 1);
                }
                groups.push(group);
            }
        }
    }
    groups.extend(bumps(scored));
    ScoreTest::of(groups)
}

/// Statistic of each direction group of the library, by term.
pub(crate) fn library_statistics(scored: &Scored, library: &[Screened]) -> Vec<(Term, f64)> {
    let training = &scored.observation.training;
    let fitted = Span::of(scored.columns, training);
    let residual = fitted.without(scored.residual.to_vec());
    let mut statistics = Vec::new();
    for screened in library {
        for directions in &screened.directions {
            let group = directed(scored, &fitted, &residual, directions);
            statistics.extend(group.map(|group| (screened.term, group.statistic)));
        }
    }
    statistics
}

fn directed(scored: &Scored, fitted: &Span, residual: &[f64], directions: &[Vec<f32>]) -> Option<ScoreGroup> {
    let training = &scored.observation.training;
    let columns: Vec<Vec<f64>> = directions
        .iter()
        .map(|direction| {
            let column: Vec<f64> = direction.iter().map(|z| f64::from(*z)).collect();
            let before = dot(training, &column, &column);
            let column = fitted.without(column);
            // What is left of a direction that the fit already had is rounding.
            if dot(training, &column, &column) > 1e-6 * before {
                column
            } else {
                vec![0.0; column.len()]
            }
        })
        .collect();
    let product = |row: usize, column: usize| dot(training, &columns[row], &columns[column]);
    let degrees = (0..columns.len()).filter(|index| product(*index, *index) > 0.0).count();
    let (_, statistic) = solve(product, |row| dot(training, &columns[row], residual), columns.len())?;
    Some(ScoreGroup {
        name: String::new(),
        statistic,
        degrees,
        tail: chi_square_tail(statistic, degrees.max(1)),
    })
}

/// Boxes of each signal: coarse ones see smooth gaps, fine ones see ripples.
const BOXES: [usize; 3] = [8, 32, 160];

fn bumps(scored: &Scored) -> Vec<ScoreGroup> {
    let mut groups = Vec::new();
    for (run, signals) in scored.signals.iter().enumerate() {
        let named = |name: &str| {
            if scored.signals.len() > 1 {
                format!("{name} of run {}", run + 1)
            } else {
                name.to_owned()
            }
        };
        for channel in scored.observation.channels.iter().filter(|channel| channel.run == run) {
            let rows: Vec<Range<usize>> = scored
                .observation
                .rows_in(channel, &scored.observation.training)
                .collect();
            let start = channel.rows.start;
            for (name, signal) in places(signals, channel.kind) {
                let all = sorted(signal.iter().copied());
                for boxes in BOXES {
                    let edges: Vec<f64> = (1..boxes)
                        .map(|edge| quantile(&all, edge as f64 / boxes as f64))
                        .collect();
                    let (statistic, degrees) = boxed(
                        scored.residual,
                        &rows,
                        |row| edges.partition_point(|edge| *edge <= signal[row - start]),
                        boxes,
                    );
                    groups.push(ScoreGroup {
                        name: named(&format!("{}, {boxes} boxes of {name}", kind_name(channel.kind))),
                        statistic,
                        degrees,
                        tail: chi_square_tail(statistic, degrees.max(1)),
                    });
                }
            }
        }
    }
    groups
}

pub(crate) fn kind_name(kind: ChannelKind) -> &'static str {
    match kind {
        ChannelKind::Field => "field",
        ChannelKind::Output => "output",
        ChannelKind::Magnetization => "magnetization",
    }
}

/// Over what the bumps of a channel stand.
fn places(signals: &Signals, kind: ChannelKind) -> Vec<(&'static str, Vec<f64>)> {
    let change = |series: &[f64]| -> Vec<f64> {
        (0..series.len())
            .map(|k| series[k] - series[k.saturating_sub(1)])
            .collect()
    };
    let field_rate = change(&signals.field);
    let mut places = vec![
        ("time", (0..signals.field.len()).map(|k| k as f64).collect()),
        ("field", signals.field.clone()),
        ("rate of field", field_rate.clone()),
        // Boxes of field apart for a rising and a falling field.
        ("field by direction", by_direction(&signals.field, &field_rate)),
    ];
    if kind == ChannelKind::Field {
        return places;
    }
    places.push(("magnetization", signals.magnetization.clone()));
    places.push(("output itself", signals.output.clone()));
    let velocity = change(&signals.output);
    places.push(("output by direction", by_direction(&signals.output, &velocity)));
    places.push(("velocity", velocity));
    if let Some(temperature) = &signals.temperature {
        places.push(("temperature", temperature.clone()));
    }
    places
}

/// The signal where it rises, and far above it where it falls.
fn by_direction(signal: &[f64], rate: &[f64]) -> Vec<f64> {
    let largest = signal.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    signal
        .iter()
        .zip(rate)
        .map(|(value, rate)| if *rate < 0.0 { value + 4.0 * largest } else { *value })
        .collect()
}

/// Σ over boxes of (Σ z)²/n, and the number of boxes with rows in them.
fn boxed(residual: &[f64], rows: &[Range<usize>], of: impl Fn(usize) -> usize, boxes: usize) -> (f64, usize) {
    let mut sums = vec![(0.0_f64, 0.0_f64); boxes];
    for range in rows {
        for row in range.clone() {
            let (sum, count) = &mut sums[of(row)];
            *sum += residual[row];
            *count += 1.0;
        }
    }
    let filled = sums.iter().filter(|(_, count)| *count > 0.0);
    (
        filled.clone().map(|(sum, count)| sum * sum / count).sum(),
        filled.count(),
    )
}
