//! Channels as tables: those of one length that share a clock stand side by side.
//!
//! A group has the clock that stands in it, stored or implied. Groups without one belong to the first table of their length. A header is a
//! channel's name and its unit in brackets, so that the door knows it as it knows `displacement [µm]` in a text file; where two groups of a
//! table have a channel of one name, the group stands before it.

use std::collections::BTreeSet;

use super::Channel;
use crate::columns::ColumnMapping;
use crate::quantity::{Quantity, plain};

/// Columns of one length, under names by which they can be asked for.
pub(crate) struct Table {
    pub headers: Vec<String>,
    /// Other names of each column: alone, and with its group.
    names: Vec<[String; 2]>,
    columns: Vec<Vec<f64>>,
}

/// What becomes one table.
struct Part {
    rows: usize,
    clock: Option<Vec<f64>>,
    groups: BTreeSet<String>,
    channels: Vec<Channel>,
}

/// The tables of a file, in the order of their first channels.
pub(crate) fn tables(channels: Vec<Channel>) -> Vec<Table> {
    let mut parts: Vec<Part> = Vec::new();
    for channel in channels.into_iter().filter(|channel| channel.values.len() > 1) {
        let rows = channel.values.len();
        let own = parts
            .iter_mut()
            .find(|part| part.rows == rows && part.groups.contains(&channel.group));
        let clock = is_clock(&channel).then(|| channel.values.clone());
        match own {
            Some(part) => {
                if part.clock.is_none() {
                    part.clock = clock;
                }
                part.channels.push(channel);
            }
            None => parts.push(Part {
                rows,
                clock,
                groups: BTreeSet::from([channel.group.clone()]),
                channels: vec![channel],
            }),
        }
    }
    merged(parts).into_iter().map(table).collect()
}

/// Parts of one clock, and those without any, belong together.
fn merged(parts: Vec<Part>) -> Vec<Part> {
    let mut tables: Vec<Part> = Vec::new();
    for mut part in parts {
        let home = tables.iter_mut().find(|table| {
            table.rows == part.rows
                && match (&table.clock, &part.clock) {
                    (Some(one), Some(other)) => same_clock(one, other),
                    _ => true,
                }
        });
        let Some(table) = home else {
            tables.push(part);
            continue;
        };
        if table.clock.is_some() {
            part.channels.retain(|channel| !is_clock(channel));
        }
        table.clock = table.clock.take().or(part.clock);
        table.channels.append(&mut part.channels);
    }
    tables
}

/// To a thousandth of a step.
fn same_clock(one: &[f64], other: &[f64]) -> bool {
    let step = (one[1] - one[0]).abs();
    one.iter()
        .zip(other)
        .all(|(one, other)| (one - other).abs() <= 1e-3 * step)
}

fn is_clock(channel: &Channel) -> bool {
    Quantity::Time.known_header(&header(channel)).is_some()
}

/// Name and unit.
fn header(channel: &Channel) -> String {
    match &channel.unit {
        Some(unit) if !plain(&channel.name).ends_with(&format!("_{}", plain(unit))) => {
            format!("{} [{unit}]", channel.name)
        }
        _ => channel.name.clone(),
    }
}

fn table(mut part: Part) -> Table {
    // A clock that was measured is better than one that is implied.
    if part
        .channels
        .iter()
        .any(|channel| is_clock(channel) && !channel.implied)
    {
        part.channels.retain(|channel| !(is_clock(channel) && channel.implied));
    }
    // Time first, whoever wrote it last.
    part.channels.sort_by_key(|channel| !is_clock(channel));
    let within = |channel: &Channel, name: &str| match channel.group.as_str() {
        "" => name.to_owned(),
        group => format!("{group}/{name}"),
    };
    let twice = |channel: &Channel| part.channels.iter().filter(|other| other.name == channel.name).count() > 1;
    let headers = part.channels.iter().map(|channel| match twice(channel) {
        true => within(channel, &header(channel)),
        false => header(channel),
    });
    Table {
        headers: headers.collect(),
        names: part
            .channels
            .iter()
            .map(|channel| [channel.name.clone(), within(channel, &channel.name)])
            .collect(),
        columns: part.channels.into_iter().map(|channel| channel.values).collect(),
    }
}

impl Table {
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    pub fn value(&self, row: usize, column: usize) -> f64 {
        self.columns[column][row]
    }

    /// The header of the column that has this name, if only one has.
    fn header_of(&self, name: &str) -> Option<&String> {
        if let Some(header) = self.headers.iter().find(|header| *header == name) {
            return Some(header);
        }
        let known = |names: &[String; 2]| names.iter().any(|own| own == name);
        let mut columns = (0..self.headers.len()).filter(|column| known(&self.names[*column]));
        let column = columns.next().filter(|_| columns.next().is_none());
        column.map(|column| &self.headers[column])
    }

    /// Mappings with the headers that their names stand for.
    pub fn resolved(&self, mappings: &[ColumnMapping]) -> Vec<ColumnMapping> {
        let resolved = mappings.iter().map(|mapping| ColumnMapping {
            header: self.header_of(&mapping.header).unwrap_or(&mapping.header).clone(),
            ..mapping.clone()
        });
        resolved.collect()
    }

    /// What is named in it, what is known in it, and its length: the table that has most is meant.
    fn worth(&self, mappings: &[ColumnMapping]) -> (usize, usize, usize) {
        let named = mappings
            .iter()
            .filter(|mapping| self.header_of(&mapping.header).is_some())
            .count();
        let is_known = |quantity: &&Quantity| {
            self.headers
                .iter()
                .any(|header| quantity.known_header(header).is_some())
        };
        (named, Quantity::ALL.iter().filter(is_known).count(), self.rows())
    }
}

/// Which of a file's tables is meant; the first of equals.
pub(crate) fn meant(tables: &[Table], mappings: &[ColumnMapping]) -> usize {
    let worths: Vec<_> = tables.iter().map(|table| table.worth(mappings)).collect();
    let best = worths.iter().max();
    worths.iter().position(|worth| Some(worth) == best).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    //! Guards which channels stand side by side: two clocks mixed would shift one signal against another.
    use super::*;

    fn channel(group: &str, name: &str, unit: &str, values: &[f64]) -> Channel {
        Channel::stored(
            group,
            name,
            Some(unit.to_owned()).filter(|unit| !unit.is_empty()),
            values.to_vec(),
        )
    }

    #[test]
    fn channels_of_one_clock_are_one_table() {
        let tables = tables(vec![
            channel("in", "t", "s", &[0.0, 1.0, 2.0]),
            channel("in", "field", "A/m", &[1.0, 2.0, 3.0]),
            channel("out", "t", "s", &[0.0, 1.0, 2.0]),
            channel("out", "displacement", "µm", &[4.0, 5.0, 6.0]),
            channel("late", "t", "s", &[0.5, 1.5, 2.5]),
            channel("late", "displacement", "µm", &[7.0, 8.0, 9.0]),
            channel("slow", "temperature", "°C", &[20.0, 21.0]),
        ]);
        let headers: Vec<&[String]> = tables.iter().map(|table| &table.headers[..]).collect();
        assert_eq!(headers[0], ["t [s]", "field [A/m]", "displacement [µm]"]);
        assert_eq!(headers[1], ["t [s]", "displacement [µm]"]);
        assert_eq!(headers[2], ["temperature [°C]"]);
        let asked = |text: &str| meant(&tables, &[text.parse().unwrap()]);
        assert_eq!(
            (
                meant(&tables, &[]),
                asked("displacement=late/displacement"),
                asked("temperature=temperature")
            ),
            (0, 1, 2)
        );
    }

    #[test]
    fn a_measured_clock_replaces_an_implied_one_and_names_are_told_apart() {
        let tables = tables(vec![
            channel("a", "x", "", &[1.0, 2.0]),
            channel("b", "x", "", &[3.0, 4.0]),
            Channel::clock("a", 0.0, 1.0, 2),
            channel("a", "time_s", "", &[0.0, 1.1]),
        ]);
        assert_eq!(tables[0].headers, ["time_s", "a/x", "b/x"]);
        assert_eq!(tables[0].value(1, 0), 1.1);
    }
}
