//! `anhyst check`: is this scenario usable?

use super::Ending;
use crate::arguments::{JsonArgument, ScenarioArguments};
use anhyst_launch::error::RunError;
use anhyst_scenario::{load, to_ron};
use clap::Args;

/// `check`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// What to check.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Print the effective scenario.
    #[arg(long, conflicts_with = "json")]
    pub print: bool,
    /// How the finding is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// The first thing that is wrong with the scenario.
pub fn run(arguments: &CheckArguments) -> miette::Result<Ending> {
    let scenario = load(&arguments.scenario.scenario, &arguments.scenario.set.settings)?;
    if arguments.print {
        crate::say!(
            "{}",
            to_ron(&scenario).map_err(|error| RunError::Setup(error.to_string()))?
        );
    } else {
        let ticks = scenario.ticks();
        let processes = scenario.placement.processes().len();
        if arguments.json.json {
            let finding = serde_json::json!({
                "scenario": scenario.name,
                "ticks": ticks,
                "tick_s": scenario.tick_s,
                "processes": processes,
                "samples_per_resonance": scenario.samples_per_resonance(),
                "warnings": scenario.warnings(),
            });
            crate::say!("{finding:#}");
            return Ok(Ending::Held);
        }
        crate::say!(
            "{}: good; {ticks} ticks of {} µs in {processes} {}",
            scenario.name,
            scenario.tick_s * 1e6,
            if processes == 1 { "process" } else { "processes" }
        );
        for warning in scenario.warnings() {
            crate::say!("warning: {warning}");
        }
    }
    Ok(Ending::Held)
}
