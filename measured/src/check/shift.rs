//! Are command and field of the same time, and which is which?
//!
//! ρ(n): correlation of the field with the command n rows before. A coil's field never comes before its command; where it comes
//! after it, the displacement comes late too, or only the field's column is shifted. The command is what was computed, so the measured
//! one of the two is the one with noise that the other has not.

use std::collections::BTreeMap;

use super::finding::{Expected, Finding, FindingKind, exchanged, pasted};
use crate::quantity::Quantity;
use crate::run::{MeasuredRun, correlation};

/// Farthest that is looked for, rows.
const MAX_SHIFT: usize = 60;
/// Over which a rate is taken, rows.
const RATE_ROWS: usize = 8;
/// Least shift of a field behind its command that is no amplifier's, rows.
const MIN_LATE: i64 = 2;
/// What a shift leaves of 1 − ρ, at most: half the amplitude.
const LEFT: f64 = 0.25;
/// An output is in time if a shift of the command would leave this much more of its 1 − ρ: its own lag is below 0.4 of the shift.
const IN_TIME: f64 = 0.5;
/// A measured series is louder than a computed one by this factor.
const LOUDER: f64 = 5.0;
/// A share of the louder one's noise, as energy, that the other one cannot have.
const OWN_NOISE: f64 = 0.5;

/// Correlation of `late` with `early` n rows before; n below 0: behind.
fn correlation_at(late: &[f64], early: &[f64], rows: i64) -> f64 {
    let shift = rows.unsigned_abs() as usize;
    let length = late.len().saturating_sub(shift);
    if rows >= 0 {
        correlation(&late[shift..], &early[..length])
    } else {
        correlation(&late[..length], &early[shift..])
    }
}

fn rates(series: &[f64]) -> Vec<f64> {
    series
        .windows(RATE_ROWS + 1)
        .map(|rows| rows[RATE_ROWS] - rows[0])
        .collect()
}

/// Rows by which the field comes after the command, and 1 − ρ there and unshifted.
fn best(field: &[f64], command: &[f64]) -> (i64, f64, f64) {
    let most = MAX_SHIFT.min(field.len() / 8) as i64;
    let off = |rows: i64| 1.0 - correlation_at(field, command, rows);
    let all = (-most..=most).map(|rows| (rows, off(rows)));
    let (rows, least) = all.min_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((0, 1.0));
    (rows, least, off(0))
}

/// The field is the quiet one of the two, and what is loud in the command is not in it.
pub(super) fn swapped(run: &MeasuredRun) -> Option<Finding> {
    let (command, field) = (run.series(Quantity::FieldCommand)?, run.series(Quantity::Field)?);
    run.tick_s?;
    let [of_command, of_field] = [Quantity::FieldCommand, Quantity::Field].map(|own| run.noise(own).map(|own| own.rms));
    let (of_command, of_field) = (of_command?, of_field?);
    if of_command <= LOUDER * of_field {
        return None;
    }
    let rough = |values: &mut dyn Iterator<Item = f64>| {
        let values: Vec<f64> = values.collect();
        let third = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).powi(2);
        values.windows(4).map(third).sum::<f64>()
    };
    let own = rough(&mut command.iter().zip(field).map(|(command, field)| command - field));
    let all = rough(&mut command.iter().copied());
    let (rows, ..) = best(field, command);
    if own < OWN_NOISE * all || rows > 0 {
        return None;
    }
    let amended_columns = exchanged(run, Quantity::FieldCommand, Quantity::Field);
    Some(Finding {
        kind: FindingKind::Swapped,
        channel: Quantity::FieldCommand,
        sentence: format!(
            "field command and field changed places: the command has {of_command:.2e} A/m of noise that the field has not ({of_field:.2e} A/m). \
             Read them with {}",
            pasted(&amended_columns)
        ),
        amended_columns,
        evidence: BTreeMap::from([
            ("noise_of_command_a_per_m", of_command),
            ("noise_of_field_a_per_m", of_field),
        ]),
    })
}

pub(super) fn check(run: &MeasuredRun, expected: &[Expected]) -> Option<Finding> {
    let (command, field) = (run.series(Quantity::FieldCommand)?, run.series(Quantity::Field)?);
    let tick_s = run.tick_s?;
    let (rows, shifted, unshifted) = best(field, command);
    if shifted > LEFT * unshifted {
        return None;
    }
    // 1 − ρ of the outputs, if the command is right and if it is as late as the field says.
    let outputs = expected.iter().filter(|own| own.of != Quantity::Field);
    // Of their rates, which creep, drift and an unknown start do not touch.
    let pairs: Vec<[Vec<f64>; 2]> = outputs
        .filter_map(|own| Some([rates(run.series(own.of)?), rates(&own.series)]))
        .collect();
    let off = |rows: i64| {
        let each = pairs.iter().map(|[own, model]| 1.0 - correlation_at(own, model, rows));
        each.sum::<f64>()
    };
    let (in_time, with_field) = (off(0), off(rows));
    let by = format!(
        "{} row{} ({:.2e} s)",
        rows.abs(),
        if rows.abs() == 1 { "" } else { "s" },
        rows.abs() as f64 * tick_s
    );
    let output = expected.iter().rfind(|own| own.of != Quantity::Field);
    let output = output.map_or("output", |own| own.of.name());
    let (channel, said) = if rows < 0 && !pairs.is_empty() && with_field < in_time {
        (
            Quantity::FieldCommand,
            format!("field and {output} come {by} before the command that makes them: the command's column is late"),
        )
    } else if rows < 0 {
        (
            Quantity::Field,
            format!("the field comes {by} before the command that makes it: its column is early"),
        )
    } else if rows >= MIN_LATE && !pairs.is_empty() && in_time < IN_TIME * with_field {
        (
            Quantity::Field,
            format!("the field comes {by} behind the command, and the {output} does not: the field's column is late"),
        )
    } else {
        return None;
    };
    let amended_columns = vec![format!("{}=-", channel.key())];
    Some(Finding {
        kind: FindingKind::Shifted,
        channel,
        sentence: format!(
            "{said}. Shift it in the file, or leave it out with {}",
            pasted(&amended_columns)
        ),
        amended_columns,
        evidence: BTreeMap::from([
            ("rows", rows as f64),
            ("one_less_correlation", unshifted),
            ("one_less_correlation_shifted", shifted),
        ]),
    })
}
