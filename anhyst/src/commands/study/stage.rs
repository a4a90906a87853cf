//! `anhyst study stage`: a piezo stage followed by feedback, by a line, by a fixed, an adaptive and a learning inverse, side by side.

use crate::arguments::{JsonArgument, OutArgument, ThreadsArgument};
use crate::commands::{Ending, count_bar, json, save};
use anhyst_identify::parallel;
use anhyst_launch::error::RunError;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::table::Table;
use anhyst_studies::stage::{Compensation, Motion, StageRun, follow};
use clap::Args;

/// `stage`
#[derive(Debug, Args)]
pub struct StageArguments {
    /// Length of each run; the last two seconds are judged.
    #[arg(long, default_value_t = 20.0, value_name = "S", value_parser = duration_s)]
    pub duration_s: f64,
    /// Of the sensor's noise, and of how the first weights are wrong.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the runs.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How stage.json is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

fn duration_s(text: &str) -> Result<f64, String> {
    let duration_s: f64 = text.parse().map_err(|_| format!("{text} is no number"))?;
    if (4.0..=600.0).contains(&duration_s) {
        Ok(duration_s)
    } else {
        Err(format!("{duration_s} s is outside [4, 600] s"))
    }
}

/// Runs the command.
///
/// # Errors
/// A result that cannot be written.
pub fn run(arguments: &StageArguments) -> miette::Result<Ending> {
    let of_motion = |motion| Compensation::ALL.map(|compensation| (motion, compensation));
    let work: Vec<(Motion, Compensation)> = Motion::ALL.into_iter().flat_map(of_motion).collect();
    let bar = count_bar(work.len() as u64, "stage");
    let runs = parallel::map(arguments.threads.count(), &work, |(motion, compensation)| {
        let run = follow(*motion, *compensation, arguments.duration_s, arguments.seed);
        bar.inc(1);
        run
    });
    bar.finish_and_clear();
    let runs: Result<Vec<StageRun>, _> = runs.into_iter().collect();
    let runs = runs.map_err(|error| miette::miette!("{error}"))?;
    let results = arguments.out.claim("study-stage")?;
    let drawn = picture(&runs)
        .svg()
        .map_err(|error| RunError::Setup(error.to_string()))?;
    save(&results.path, "stage.json", &(json(&runs)? + "\n"))?;
    save(&results.path, "stage.svg", &drawn)?;
    if arguments.json.json {
        crate::say!("{}", json(&runs)?);
        return Ok(Ending::Held);
    }
    let mut table = Table::new(["motion", "compensation", "rms, nm", "largest, nm", "rms, % of stroke"]);
    for run in &runs {
        table.push([
            run.motion.name().to_owned(),
            run.compensation.name().to_owned(),
            format!("{:.1}", 1e9 * run.rms_m),
            format!("{:.1}", 1e9 * run.max_m),
            format!("{:.3}", 100.0 * run.rms_of_stroke),
        ]);
    }
    crate::say!("{}", table.terminal());
    crate::say!("\nresults: {}", results.path.display());
    Ok(Ending::Held)
}

/// The error's course of each compensation, one chart a motion.
fn picture(runs: &[StageRun]) -> Figure {
    let roles = [
        Role::Measured,
        Role::Truth,
        Role::Nominal,
        Role::Amended,
        Role::Remainder,
    ];
    let chart = |motion: Motion| {
        let error = Axis::new("log10 of rms error of a tenth of a second", "m");
        let mut chart = Chart::new(motion.name(), Axis::new("time", "s"), error);
        let of = runs.iter().filter(|run| run.motion == motion);
        for (run, role) in of.zip(roles) {
            let time_s: Vec<f64> = (1..=run.course_m.len()).map(|tenth| 0.1 * tenth as f64).collect();
            let course: Vec<f64> = run.course_m.iter().map(|rms_m| rms_m.max(1e-12).log10()).collect();
            chart
                .curves
                .push(Curve::over(&time_s, &course, role).named(run.compensation.name()));
        }
        chart
    };
    Figure::new("a piezo stage", Motion::ALL.map(chart).to_vec())
}
