//! The command line.

use crate::arguments::{
    BridgeArguments, CheckArguments, CompareArguments, DoctorArguments, GraphArguments, NodeArguments, ReplayArguments,
    RunArguments, ViewArguments,
};
use anhyst_ipc::NodeId;
use clap::{Parser, Subcommand};

/// Hybrid feedforward/feedback control of actuators with hysteresis.
#[derive(Debug, Parser)]
#[command(name = "anhyst", version, about, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scenario: start its processes, cut, judge, record.
    Run(RunArguments),
    /// Validate a scenario without running it.
    Check(CheckArguments),
    /// Print the wiring of a scenario's processes as a Mermaid graph.
    Graph(GraphArguments),
    /// Run several scenarios and print one table.
    Compare(CompareArguments),
    /// Feed a recorded run's tokens to one node and compare its outputs bit by bit.
    Replay(ReplayArguments),
    /// Open a run's recording in the Rerun viewer.
    View(ViewArguments),
    /// Write a recorded run as a measured table and an actuator model, for `diagnose` and `estimate`.
    #[cfg(feature = "recorder")]
    Export(crate::commands::export::ExportArguments),
    /// Fit a material to measured loops.
    Fit(Box<crate::commands::fit::FitArguments>),
    /// Estimate parameters of a model from a measured run.
    Estimate(Box<crate::commands::estimate::EstimateArguments>),
    /// Compute the paper's figures and put them on one page.
    Paper(crate::commands::paper::PaperArguments),
    /// Find what a model lacks on measured runs, name it, add it.
    Diagnose(Box<crate::commands::diagnose::DiagnoseArguments>),
    /// Hide effects in made runs, diagnose them, and count what is named rightly.
    Study(Box<crate::commands::study::StudyArguments>),
    /// Compare the estimation laws under motions, noise and drift.
    Laws(crate::commands::laws::LawsArguments),
    /// Print what a driver in any language must know: services, layouts, rules.
    Interface(crate::commands::interface::InterfaceArguments),
    /// Verify whatever process is plugged in as amplifier.
    VerifyAmplifier(Box<crate::commands::verify_amplifier::VerifyAmplifierArguments>),
    /// Look at shared memory, leftovers of crashed runs, rights and cores.
    Doctor(DoctorArguments),
    /// Stand on this host for the processes of another one and carry their tokens over Zenoh (cargo feature `bridge`).
    Bridge(BridgeArguments),
    /// Print shell completions.
    Completions {
        /// For which shell.
        shell: clap_complete::Shell,
    },
    /// Run the simulated plant's process alone.
    PlantSim(NodeArguments),
    /// Run the estimator's process alone.
    Estimator(NodeArguments),
    /// Run the controller's process alone.
    Controller(NodeArguments),
    /// Run the inverse compensator's process alone.
    Inverse(NodeArguments),
    /// Run the guard's process alone.
    Guard(NodeArguments),
    /// Run the simulated amplifier's process alone.
    Amplifier(NodeArguments),
    /// Run the recorder's process alone.
    Recorder(NodeArguments),
}

impl Command {
    /// The node of a process subcommand.
    pub fn node(&self) -> Option<(NodeId, &NodeArguments)> {
        Some(match self {
            Command::PlantSim(arguments) => (NodeId::Plant, arguments),
            Command::Estimator(arguments) => (NodeId::Estimator, arguments),
            Command::Controller(arguments) => (NodeId::Controller, arguments),
            Command::Inverse(arguments) => (NodeId::Inverse, arguments),
            Command::Guard(arguments) => (NodeId::Guard, arguments),
            Command::Amplifier(arguments) => (NodeId::Amplifier, arguments),
            Command::Recorder(arguments) => (NodeId::Recorder, arguments),
            _ => return None,
        })
    }
}
