//! The command line: the commands, and how the help groups them.

use crate::commands::{
    bench, benchmark, check, data, diagnose, doctor_arguments, estimate, explain, fit_arguments, graph, interface,
    live, man, new, node, predict, replay, run_arguments, study, sweep, tune, verify_amplifier,
};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::fmt::Write as _;

/// Hybrid feedforward/feedback control of actuators with hysteresis.
#[derive(Debug, Parser)]
#[command(name = "anhyst", version, about, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a scenario for your own actuator: asks, or takes options; it passes `check` and holds when run.
    New(Box<new::NewArguments>),
    /// Run a scenario: start its processes, cut, judge, record; of several scenarios print one table.
    Run(Box<run_arguments::RunArguments>),
    /// Run a scenario under values that vary and under many seeds, on all cores.
    ///
    /// Results: sweep.csv, sweep.parquet, sweep.html; rows.jsonl has every run that is done.
    Sweep(Box<sweep::SweepArguments>),
    /// Put the shards of a sweep together.
    Gather(sweep::GatherArguments),
    /// Bring a rig that nobody knows into the loop: small, whole, diagnosed, again while it gets better.
    ///
    /// Results: commissioned.ron, commission.json, commission.html, a folder for each cut.
    #[cfg(feature = "recorder")]
    Commission(Box<crate::commands::commission::CommissionArguments>),
    /// Validate a scenario without running it.
    Check(check::CheckArguments),
    /// Change settings of a run that goes on: gains, learning, amplitude, tolerance.
    Tune(tune::TuneArguments),
    /// Pass the channels of a run that goes on to Foxglove or PlotJuggler.
    Live(live::LiveArguments),
    /// Print the wiring of a scenario's processes as a Mermaid graph.
    Graph(graph::GraphArguments),
    /// Feed a recorded run's tokens to its nodes and compare their outputs bit by bit.
    Replay(replay::ReplayArguments),
    /// Open a run's recording in the Rerun viewer.
    #[cfg(feature = "recorder")]
    View(crate::commands::view::ViewArguments),
    /// Write a recorded run as a measured table and an actuator model, for `diagnose` and `estimate`.
    #[cfg(feature = "recorder")]
    Export(crate::commands::export::ExportArguments),
    /// Say what a measured file holds, what each channel may be, and with which options the other commands read it.
    Data(data::DataArguments),
    /// Fit a material to measured loops, or with --law any hysteresis law to any input and output.
    ///
    /// Results: material.ron (without strain hysteresis.ron; with --law law.ron), fit.json, fit.svg.
    Fit(Box<fit_arguments::FitArguments>),
    /// Run any model freely along a measured file, and tell how far it is.
    ///
    /// Results: predict.json, predict.csv, predict.svg.
    Predict(Box<predict::PredictArguments>),
    /// Judge every hysteresis law on open data, beside a line and what others have published.
    ///
    /// Results: benchmark.json, benchmark.md.
    Benchmark(benchmark::BenchmarkArguments),
    /// Estimate parameters of a model from a measured run.
    ///
    /// Results: estimate.json, estimate.svg, estimate.rrd.
    Estimate(Box<estimate::EstimateArguments>),
    /// Find what a model lacks on measured runs, name it, add it.
    ///
    /// Results: diagnosis.json, amended.ron, report.html, diagnosis.rrd; experiment.ron where another run would tell more.
    Diagnose(Box<diagnose::DiagnoseArguments>),
    /// Studies: the blind study of the diagnosis, the estimation laws side by side, the paper's figures.
    #[command(subcommand)]
    Study(study::StudyCommand),
    /// Run one process of a scenario alone: a node by its name.
    Node(node::NodeArguments),
    /// Stand on this host for the processes of another one and carry their tokens over Zenoh.
    #[cfg(feature = "bridge")]
    Bridge(Box<crate::commands::bridge::BridgeArguments>),
    /// Print what a driver in any language must know: services, layouts, rules.
    Interface(interface::InterfaceArguments),
    /// Verify whatever process is plugged in as amplifier.
    ///
    /// Results: amplifier.json, report.html, the effective scenario, the process's log.
    VerifyAmplifier(Box<verify_amplifier::VerifyAmplifierArguments>),
    /// Measure what each part of the loop costs on this machine, beside the least that it could.
    Bench(bench::BenchArguments),
    /// Look at shared memory, leftovers of crashed runs, rights and cores.
    Doctor(doctor_arguments::DoctorArguments),
    /// Say what the documentation says of a setting, an event, an effect, a law, a command.
    Explain(explain::ExplainArguments),
    /// Write the manual pages.
    Man(man::ManArguments),
    /// Print shell completions.
    Completions {
        /// For which shell.
        shell: clap_complete::Shell,
    },
}

/// Headings of the help, and the commands below each.
pub const GROUPS: [(&str, &[&str]); 5] = [
    (
        "Scenarios",
        &[
            "new",
            "run",
            "sweep",
            "gather",
            "tune",
            "live",
            "commission",
            "check",
            "graph",
            "replay",
            "view",
            "export",
        ],
    ),
    ("Measurements", &["data", "fit", "predict", "estimate", "diagnose"]),
    ("Studies", &["study", "benchmark"]),
    (
        "Processes and drivers",
        &["node", "bridge", "interface", "verify-amplifier"],
    ),
    ("This machine", &["doctor", "bench", "explain", "man", "completions"]),
];

/// The command line as clap knows it, its commands grouped.
pub fn command() -> clap::Command {
    let command = with_negative_numbers(Cli::command());
    let mut listed = String::new();
    for (heading, names) in GROUPS {
        // Writing to a String cannot fail.
        let _ = writeln!(listed, "\n{heading}:");
        for known in names.iter().filter_map(|name| command.find_subcommand(name)) {
            let about = known.get_about().map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(listed, "  {:<18}{about}", known.get_name());
        }
    }
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{listed}\nOptions:\n{{options}}"
    ))
}

/// Options take what is below zero as their value, and say themselves what is wrong with it.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let own = command.mut_args(|own| {
        let takes = own.get_action().takes_values() && !own.is_positional();
        let amount = own.get_value_names().is_some_and(|names| names == ["AMOUNT"]);
        own.allow_negative_numbers(takes).allow_hyphen_values(amount)
    });
    own.mut_subcommands(with_negative_numbers)
}

/// Reads the command line.
///
/// # Errors
/// What clap says, help and version among it.
pub fn parse(words: impl IntoIterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let mut command = command();
    let matches = command.try_get_matches_from_mut(words)?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}
