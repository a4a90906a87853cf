//! `anhyst graph`: the wiring, drawn from the blocks' types and the scenario's placement.

use super::Ending;
use crate::arguments::{JsonArgument, ScenarioArguments};
use anhyst_scenario::{Scenario, load, wires};
use clap::Args;
use std::fmt::Write;

/// `graph`
#[derive(Debug, Args)]
pub struct GraphArguments {
    /// Whose wiring.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Processes and links as data instead of a drawing.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A bad scenario.
pub fn run(arguments: &GraphArguments) -> miette::Result<Ending> {
    let scenario = load(&arguments.scenario.scenario, &arguments.scenario.set.settings)?;
    if arguments.json.json {
        crate::say!("{:#}", data(&scenario));
    } else {
        crate::say!("{}", mermaid(&scenario).trim_end());
    }
    Ok(Ending::Held)
}

/// Every process with its nodes, every link with its delay in ticks.
fn data(scenario: &Scenario) -> serde_json::Value {
    let processes = scenario.placement.processes().into_iter();
    let processes = processes.map(|(name, nodes)| serde_json::json!({ "name": name, "nodes": nodes }));
    let links = wires().into_iter().map(|wire| {
        serde_json::json!({
            "from": wire.channel.producer(),
            "channel": wire.channel,
            "to": wire.reader,
            "delay_ticks": wire.delay,
        })
    });
    serde_json::json!({ "processes": processes.collect::<Vec<_>>(), "links": links.collect::<Vec<_>>() })
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
