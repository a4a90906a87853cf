//! A run of the loop as the table that `anhyst diagnose` and `anhyst estimate` read.
//!
//! Row k is the instant t_k. What the guard let through at t_k-2 is what was asked of the amplifier for t_k (one tick of
//! computing, one of hold), so it stands in row k.

use anhyst_ipc::{Measurement, SafeField};
use anhyst_scenario::Units;
use std::fmt::Write as _;

/// From the tick in which the guard speaks to the instant it speaks of.
const TICKS_AHEAD: u64 = 2;

/// Headers of command, measured input and output. Of a voltage or a current there is no second one that a reader would take.
fn headers(units: &Units) -> (&'static str, Option<&'static str>, &'static str) {
    let (command, measured) = match units.input.as_str() {
        "V" => ("voltage_V", None),
        "A" => ("current_A", None),
        _ => ("field_command_A_per_m", Some("field_A_per_m")),
    };
    let output = match units.output.as_str() {
        "T" => "flux_density_T",
        "m/m" => "strain",
        "A/m" => "magnetization_A_per_m",
        _ => "displacement_m",
    };
    (command, measured, output)
}

/// Named columns of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredTable {
    pub columns: Vec<(String, Vec<f64>)>,
}

impl MeasuredTable {
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }

    /// As CSV, every number to its last bit.
    pub fn csv(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|(name, _)| name.as_str()).collect();
        let mut text = names.join(",") + "\n";
        for row in 0..self.rows() {
            for (place, (_, values)) in self.columns.iter().enumerate() {
                let comma = if place > 0 { "," } else { "" };
                // Writing to a String cannot fail.
                let _ = write!(text, "{comma}{}", values[row]);
            }
            text.push('\n');
        }
        text
    }
}

/// The measured run. Where ticks are missing, so are their rows and the two after them.
pub fn measured_table(measured: &[Measurement], asked: &[SafeField], tick_s: f64, units: &Units) -> MeasuredTable {
    let (command, field, output) = headers(units);
    let mut asked = asked.iter().peekable();
    let mut asked_for = |tick: u64| {
        let Some(spoken) = tick.checked_sub(TICKS_AHEAD) else {
            return Some(0.0);
        };
        while asked.next_if(|token| token.tick < spoken).is_some() {}
        let token = asked.peek().filter(|token| token.tick == spoken);
        token.map(|token| token.field_a_per_m)
    };
    let rows = measured.iter().filter_map(|row| Some((row, asked_for(row.tick)?)));
    let (rows, commands): (Vec<&Measurement>, Vec<f64>) = rows.unzip();
    let of = |value: fn(&Measurement) -> f64| rows.iter().map(|row| value(row)).collect();
    let times = rows.iter().map(|row| row.tick as f64 * tick_s).collect();
    let mut columns = vec![("time_s".to_owned(), times), (command.to_owned(), commands)];
    columns.extend(field.map(|name| (name.to_owned(), of(|row| row.coil_field_a_per_m))));
    columns.push((output.to_owned(), of(|row| row.displacement_m)));
    if rows.iter().any(|row| row.temperature_k != 0.0) {
        columns.push(("temperature_K".to_owned(), of(|row| row.temperature_k)));
    }
    MeasuredTable { columns }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the two ticks between a command and the instant it is for: shifted by one, every diagnosis would find a delay.
    #[test]
    fn the_command_stands_at_the_instant_it_is_for() {
        let measured: Vec<Measurement> = (0..4)
            .map(|tick: u32| Measurement {
                tick: u64::from(tick),
                displacement_m: 0.1 * f64::from(tick),
                ..Measurement::default()
            })
            .collect();
        let asked: Vec<SafeField> = (0..4)
            .map(|tick: u32| SafeField {
                tick: u64::from(tick),
                field_a_per_m: f64::from(tick) + 1.0,
                ..SafeField::default()
            })
            .collect();
        let text = measured_table(&measured, &asked, 0.5, &Units::default()).csv();
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "time_s,field_command_A_per_m,field_A_per_m,displacement_m");
        assert_eq!(
            &rows[1..],
            ["0,0,0,0", "0.5,0,0,0.1", "1,1,0,0.2", "1.5,2,0,0.30000000000000004"]
        );
        let gap: Vec<Measurement> = [0, 1, 3].map(|k| measured[k]).into();
        let text = measured_table(&gap, &[asked[0], asked[3]], 0.5, &Units::default()).csv();
        assert_eq!(text.lines().skip(1).collect::<Vec<_>>(), ["0,0,0,0", "0.5,0,0,0.1"]);
        let volts = Units {
            input: "V".into(),
            ..Units::default()
        };
        let text = measured_table(&measured[..1], &asked, 0.5, &volts).csv();
        assert_eq!(text, "time_s,voltage_V,displacement_m\n0,0,0\n");
    }
}
