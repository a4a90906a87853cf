//! `anhyst graph`: the wiring, drawn from the blocks' types and the scenario's placement.

use super::Ending;
use crate::arguments::ScenarioArguments;
use anhyst_scenario::{Scenario, load, wires};
use clap::Args;
use std::fmt::Write;

/// `graph`
#[derive(Debug, Args)]
pub struct GraphArguments {
    /// Whose wiring.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
}

/// Runs the command.
///
/// # Errors
/// A bad scenario.
pub fn run(arguments: &GraphArguments) -> miette::Result<Ending> {
    let scenario = load(&arguments.scenario.scenario, &arguments.scenario.set.settings)?;
    crate::say!("{}", mermaid(&scenario).trim_end());
    Ok(Ending::Held)
}

/// The graph as Mermaid: a box a process, an arrow a link, dashed where a token is one tick late.
pub fn mermaid(scenario: &Scenario) -> String {
    let mut text = String::from("flowchart LR\n");
    for (process, nodes) in scenario.placement.processes() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  subgraph {}[\"process {process}\"]", process.replace('+', "_"));
        for node in nodes {
            let _ = writeln!(text, "    {}", node.name().replace('-', "_"));
        }
        text.push_str("  end\n");
    }
    for wire in wires() {
        let arrow = if wire.delay == 0 { "-->" } else { "-.->" };
        let (from, to) = (
            wire.channel.producer().name().replace('-', "_"),
            wire.reader.name().replace('-', "_"),
        );
        let _ = writeln!(text, "  {from} {arrow}|{}| {to}", wire.channel);
    }
    text
}
