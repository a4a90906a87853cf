//! Runs in a folder: a CSV file each, and `labels.json` with what is true of them.

use crate::drawn::{Made, Truth};
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

/// Writes `NAME.csv` for every run, as it comes, and `labels.json` at the end.
///
/// # Errors
/// The folder cannot be made or written to.
pub fn write_runs(folder: &Path, runs: impl Iterator<Item = (String, Made)>) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut labels = Vec::new();
    for (name, made) in runs {
        fs::write(folder.join(format!("{name}.csv")), table(&made))?;
        labels.push(format!(" \"{name}\": {}", label(&made.truth)));
    }
    fs::write(folder.join("labels.json"), format!("{{\n{}\n}}\n", labels.join(",\n")))
}

fn table(made: &Made) -> String {
    let mut text = String::from("time_s,field_command_A_per_m,field_A_per_m,displacement_m\n");
    let (command, field) = (&made.record.command_a_per_m, &made.record.field_a_per_m);
    for (row, time_s) in made.time_s.iter().enumerate() {
        let y = made.record.displacement_m[row];
        // Writing into a string cannot fail. Digits of a hundredth of the steps.
        let _ = writeln!(text, "{time_s:.4},{:.2},{:.2},{y:.10}", command[row], field[row]);
    }
    text
}

fn label(truth: &Truth) -> String {
    let joined = |items: Vec<String>| items.join(", ");
    let number = |value: f64| format!("{value:.6e}");
    let values = truth.parts.iter().map(|part| {
        let own = part.values.iter();
        let own = own.map(|value| format!("\"{}\": {}", value.name, number(value.value)));
        format!("\"{}\": {{{}}}", part.effect.name(), joined(own.collect()))
    });
    let shares = truth.parts.iter().map(|part| number(part.share));
    let gaps = truth.parts.iter().map(|part| number(part.gap_m));
    let least = truth.parts.iter().map(|part| part.gap_m).fold(f64::INFINITY, f64::min);
    let of_effect = if least.is_finite() { least } else { 0.0 };
    [
        format!("{{\n  \"hidden\": \"{}\"", truth.name()),
        format!("\"nuisance\": \"{}\"", truth.nuisance.name()),
        format!("\"gap_of_the_effect_m\": {}", number(of_effect)),
        format!(
            "\"gap_to_the_nominal_model_m\": {}",
            number(truth.gap_to_the_nominal_model_m)
        ),
        format!("\"gap_of_the_nuisance_m\": {}", number(truth.gap_of_the_nuisance_m)),
        format!("\"gaps_m\": [{}]", joined(gaps.collect())),
        format!("\"shares\": [{}]", joined(shares.collect())),
        format!("\"values\": {{{}}}", joined(values.collect())),
        format!("\"noise_m\": {}", number(truth.noise_m)),
        format!("\"drive\": \"{}\"\n }}", truth.drive.name()),
    ]
    .join(",\n  ")
}
