//! A run of the loop as the table that `anhyst diagnose` and `anhyst estimate` read.
//!
//! Row k is the instant t_k. What the guard let through at t_k-2 is what was asked of the amplifier for t_k (one tick of
//! computing, one of hold), so it stands in row k.

use anhyst_ipc::{Measurement, SafeField};
use std::fmt::Write as _;

/// From the tick in which the guard speaks to the instant it speaks of.
const TICKS_AHEAD: usize = 2;

/// The measured run as CSV, every number to its last bit.
pub fn measured_table(measured: &[Measurement], asked: &[SafeField], tick_s: f64) -> String {
    let warm = measured.iter().any(|row| row.temperature_k != 0.0);
    let mut text = String::from("time_s,field_command_A_per_m,field_A_per_m,displacement_m");
    text.push_str(if warm { ",temperature_K\n" } else { "\n" });
    for (k, row) in measured.iter().enumerate() {
        let command = k.checked_sub(TICKS_AHEAD).and_then(|k| asked.get(k));
        let command = command.map_or(0.0, |token| token.field_a_per_m);
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{},{command},{},{}",
            k as f64 * tick_s,
            row.coil_field_a_per_m,
            row.displacement_m
        );
        if warm {
            let _ = write!(text, ",{}", row.temperature_k);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the two ticks between a command and the instant it is for: shifted by one, every diagnosis would find a delay.
    #[test]
    fn the_command_stands_at_the_instant_it_is_for() {
        let measured: Vec<Measurement> = (0..4)
            .map(|tick| Measurement {
                displacement_m: 0.1 * f64::from(tick),
                ..Measurement::default()
            })
            .collect();
        let asked: Vec<SafeField> = (0..4)
            .map(|tick| SafeField {
                field_a_per_m: f64::from(tick) + 1.0,
                ..SafeField::default()
            })
            .collect();
        let text = measured_table(&measured, &asked, 0.5);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "time_s,field_command_A_per_m,field_A_per_m,displacement_m");
        assert_eq!(
            &rows[1..],
            ["0,0,0,0", "0.5,0,0,0.1", "1,1,0,0.2", "1.5,2,0,0.30000000000000004"]
        );
    }
}
