//! `anhyst check`: is this scenario usable, and what is its loop like?

use super::Ending;
use crate::arguments::{JsonArgument, ScenarioArguments};
use anhyst_launch::claim::claimed;
use anhyst_launch::error::RunError;
use anhyst_launch::loop_section::{loop_section, margins_table};
use anhyst_report::page::Page;
use anhyst_scenario::{Scenario, load, to_ron};
use clap::Args;
use std::path::{Path, PathBuf};

/// `check`
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// What to check.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Print the effective scenario.
    #[arg(long, conflicts_with = "json")]
    pub print: bool,
    /// Draw the loop's shape as a page, check.html, in this folder.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
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
    if let Some(out) = &arguments.out {
        draw(&scenario, out)?;
    }
    if arguments.print {
        let effective = to_ron(&scenario).map_err(|error| RunError::Setup(error.to_string()))?;
        crate::say!("{effective}");
        return Ok(Ending::Held);
    }
    let ticks = scenario.ticks();
    let processes = scenario.placement.processes().len();
    let feedback = scenario.controller.feedback.as_ref();
    let margins = feedback.map(|_| scenario.loop_shape()).transpose();
    let margins = margins.map_err(RunError::from)?.map(|shape| shape.margins());
    if arguments.json.json {
        let finding = serde_json::json!({
            "scenario": scenario.name,
            "ticks": ticks,
            "tick_s": scenario.tick_s,
            "processes": processes,
            "margins": margins,
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
    match margins {
        Some(margins) => crate::say!("{}", margins_table(&margins).terminal()),
        None => crate::say!("no feedback: no loop is closed"),
    }
    for warning in scenario.warnings() {
        crate::say!("warning: {warning}");
    }
    Ok(Ending::Held)
}

fn draw(scenario: &Scenario, out: &Path) -> miette::Result<()> {
    let section = loop_section(scenario);
    let section = section.ok_or_else(|| miette::miette!("--out draws the loop, and this scenario has no feedback"))?;
    let page = Page::new(
        &format!("Loop of {}", scenario.name),
        "How far the loop is from its edge of stability, before it runs.",
    );
    let results = claimed(Some(out), &scenario.name)?;
    super::save(&results.path, "check.html", &page.section(section).html())?;
    Ok(())
}
