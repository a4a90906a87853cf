//! `anhyst export RUN`: a recorded run as a measured table and an actuator model, as `anhyst diagnose` and `anhyst estimate`
//! take them.
//!
//! Row k is the instant t_k. What the guard let through at t_k-2 is what was asked of the amplifier for t_k (one tick of
//! computing, one of hold), so it stands in row k. Nothing that only a simulation knows is written.

use super::Ending;
use anhyst_ipc::{Measurement, SafeField};
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_model::{ActuatorModel, rod_per_magnetization};
use anhyst_recorder::Recording;
use anhyst_scenario::{Scenario, load, to_ron};
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// From the tick in which the guard speaks to the instant it speaks of.
const TICKS_AHEAD: usize = 2;

/// `export`
#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Folder of the recorded run.
    pub run: PathBuf,
    /// Folder of the results: run.csv, model.ron (default: the run's own).
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A run without recording, a folder that cannot be written.
pub fn run(arguments: &ExportArguments) -> miette::Result<Ending> {
    let folder = RunFolder::open(&arguments.run);
    let scenario = load(&folder.scenario(), &[])?;
    let recording = Recording::open(&folder.recording()).map_err(RunError::from)?;
    let measured: Vec<Measurement> = recording.tokens().map_err(RunError::from)?;
    let asked: Vec<SafeField> = recording.tokens().map_err(RunError::from)?;
    let out = arguments.out.as_deref().unwrap_or(&arguments.run);
    let table = table(&measured, &asked, scenario.tick_s);
    let model = model(&scenario)?;
    save(out, "run.csv", &table)?;
    save(out, "model.ron", &model)?;
    let rows = measured.len();
    crate::say!("{} rows: {}", rows, out.join("run.csv").display());
    crate::say!(
        "what the controller's side believes: {}",
        out.join("model.ron").display()
    );
    Ok(Ending::Held)
}

fn save(out: &Path, file: &str, text: &str) -> Result<(), RunError> {
    let path = out.join(file);
    std::fs::create_dir_all(out)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|cause| RunError::Write { path, cause })
}

/// The measured run as CSV, every number to its last bit.
fn table(measured: &[Measurement], asked: &[SafeField], tick_s: f64) -> String {
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

fn model(scenario: &Scenario) -> miette::Result<String> {
    let setup = |error: &dyn std::fmt::Display| RunError::Setup(error.to_string());
    let material = scenario.material().map_err(|error| setup(&error))?.clone();
    let by_strain = scenario.two_pole().map_err(|error| setup(&error))?;
    let model = ActuatorModel {
        name: format!("{} of scenario {}", material.name, scenario.name),
        source: material.source.clone(),
        amplifier: scenario.amplifier,
        rod: Some(rod_per_magnetization(by_strain, &material)),
        material,
        effects: scenario.effects.clone(),
        coil: true,
        ambient_temperature_k: scenario.plant.start_temperature_k,
    };
    let text = to_ron(&model).map_err(|error| setup(&error))?;
    Ok(format!(
        "// What the controller's side of scenario \"{}\" believes: material, amplifier, and the rod's two poles.\n{text}\n",
        scenario.name
    ))
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
        let text = table(&measured, &asked, 0.5);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "time_s,field_command_A_per_m,field_A_per_m,displacement_m");
        assert_eq!(
            &rows[1..],
            ["0,0,0,0", "0.5,0,0,0.1", "1,1,0,0.2", "1.5,2,0,0.30000000000000004"]
        );
    }
}
