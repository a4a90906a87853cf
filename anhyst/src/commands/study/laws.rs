//! `anhyst study laws`: every estimation law under every motion, noise and drift, in one table.

use crate::arguments::{JsonArgument, ThreadsArgument};
use crate::commands::{Ending, count_bar, json};
use anhyst_estimator::LawSettings;
use anhyst_identify::parallel;
use anhyst_launch::error::RunError;
use anhyst_report::table::Table;
use anhyst_studies::laws::{Case, Excitation, LawPerformance, run as run_case};
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use serde::Serialize;

/// `laws`
#[derive(Debug, Args)]
pub struct LawsArguments {
    /// Which laws.
    #[arg(long, value_name = "LAW,…", value_delimiter = ',', default_values = LawSettings::ADAPTIVE, value_parser = PossibleValuesParser::new(LawSettings::ADAPTIVE))]
    pub law: Vec<String>,
    /// Which motions.
    #[arg(long, value_name = "MOTION,…", value_delimiter = ',', value_enum, default_values_t = [Excitation::Ramp, Excitation::Sine, Excitation::Milling])]
    pub excitation: Vec<Excitation>,
    /// rms noise of the displacement sensor.
    #[arg(long, value_name = "NM,…", value_delimiter = ',', default_values_t = [0.0, 10.0, 50.0])]
    pub noise_nm: Vec<f64>,
    /// Drifts of the true `a`.
    #[arg(long, value_name = "A_PER_M_S,…", value_delimiter = ',', default_values_t = [0.0, 200.0])]
    pub drift_a_per_m_s: Vec<f64>,
    /// Length of each run.
    #[arg(long, default_value_t = 3.0, value_name = "S")]
    pub duration_s: f64,
    /// Of the noise.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print the table as Markdown.
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// For the runs.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// With biases and shares of held ticks.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// One figure of the table.
#[derive(Debug, Serialize)]
struct Entry<'a> {
    law: &'a str,
    excitation: Excitation,
    noise_nm: f64,
    drift_a_per_m_s: f64,
    #[serde(flatten)]
    reached: LawPerformance,
}

/// Runs the command.
///
/// # Errors
/// A law that does not exist, or a number that cannot be used.
pub fn run(arguments: &LawsArguments) -> miette::Result<Ending> {
    check(arguments)?;
    let mut work = Vec::new();
    for &excitation in &arguments.excitation {
        for &noise_nm in &arguments.noise_nm {
            for &drift_a_per_m_s in &arguments.drift_a_per_m_s {
                let case = Case {
                    excitation,
                    noise_m: noise_nm * 1e-9,
                    drift_a_per_m_s,
                    seconds: arguments.duration_s,
                    seed: arguments.seed,
                };
                for name in &arguments.law {
                    work.push((case, noise_nm, name.as_str(), law(name)?));
                }
            }
        }
    }
    let bar = count_bar(work.len() as u64, "laws");
    let found = parallel::map(arguments.threads.count(), &work, |(case, noise_nm, name, law)| {
        let reached = run_case(case, *law);
        bar.inc(1);
        reached.map(|reached| Entry {
            law: name,
            excitation: case.excitation,
            noise_nm: *noise_nm,
            drift_a_per_m_s: case.drift_a_per_m_s,
            reached,
        })
    });
    bar.finish_and_clear();
    let entries = found.into_iter().collect::<Result<Vec<_>, RunError>>()?;
    if arguments.json.json {
        crate::say!("{}", json(&entries)?);
    } else {
        print_table(arguments, &entries);
    }
    Ok(Ending::Held)
}

fn law(name: &str) -> miette::Result<LawSettings> {
    LawSettings::named(name).ok_or_else(|| {
        let known = LawSettings::ADAPTIVE.join(", ");
        miette::miette!("--law {name}: there is no such law; there are {known}")
    })
}

fn check(arguments: &LawsArguments) -> miette::Result<()> {
    let seconds = arguments.duration_s;
    if !(0.1..=100.0).contains(&seconds) {
        return Err(miette::miette!(
            "--duration-s {seconds}: a run is between 0.1 and 100 s long"
        ));
    }
    for noise in &arguments.noise_nm {
        if !(0.0..=1e6).contains(noise) {
            return Err(miette::miette!("--noise-nm {noise}: noise is between 0 and 1e6 nm"));
        }
    }
    // What drifts must stay within the laws' range, [6300, 7300] A/m, around its middle.
    let most = 750.0 / seconds;
    for drift in &arguments.drift_a_per_m_s {
        if drift.is_nan() || drift.abs() > most {
            return Err(miette::miette!(
                "--drift-a-per-m-s {drift}: within {seconds} s `a` would leave the laws' range; at most {most:.0} A/m per s"
            ));
        }
    }
    Ok(())
}

fn print_table(arguments: &LawsArguments, entries: &[Entry<'_>]) {
    let header = ["motion", "noise, nm", "drift, A/m per s"].map(str::to_owned);
    let mut table = Table::new(header.into_iter().chain(arguments.law.iter().cloned()));
    for row in entries.chunks(arguments.law.len()) {
        let Some(first) = row.first() else { continue };
        let motion = first
            .excitation
            .to_possible_value()
            .map_or_else(String::new, |name| name.get_name().to_owned());
        let case = [motion, first.noise_nm.to_string(), first.drift_a_per_m_s.to_string()];
        table.push(case.into_iter().chain(row.iter().map(|entry| cell(&entry.reached))));
    }
    let text = if arguments.markdown {
        table.markdown()
    } else {
        table.terminal()
    };
    crate::say!("{}", text.trim_end());
    crate::say!(
        "\nrms of estimated minus true a in A/m over the second half of {} s at 20 kHz; start 6800, truth 7012 A/m or drifting \
         around 6900; (h): held for more than half of that time",
        arguments.duration_s
    );
}

fn cell(reached: &LawPerformance) -> String {
    let held = if reached.held_share > 0.5 { " (h)" } else { "" };
    format!("{:.2}{held}", reached.error_rms_a_per_m)
}
