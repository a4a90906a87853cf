//! `anhyst commission`: brings a rig that nobody knows into the loop, small to large and under the guard.
//!
//! 1. *Rest*, *amplifier*, *response*: what is measured in open loop, one after the other ([`crate::fitness`]). A rig that is not fit ends here, with a sentence;
//!    a lag that the coil shows goes into the scenario, the gains follow the measured margins.
//! 2. *Small*: a fifth of the profile in closed loop, nothing learned, the coil watched.
//! 3. *Cut*: the whole profile with learning and a slow estimator.
//! 4. *Diagnosis* of that cut, and the cut again with the amended model, as long as it gets better.

mod belief;
mod cuts;
mod first_steps;
mod report;

use super::run::{changed, perform};
use super::run_arguments::AloneArguments;
use super::{Ending, json, save};
use crate::arguments::{JsonArgument, OutArgument, ScenarioArguments, ThreadsArgument};
use crate::fitness::rest;
use anhyst_controller::MeasuredResponse;
use anhyst_launch::embedded::as_saved;
use anhyst_launch::error::RunError;
use anhyst_launch::folder::RunFolder;
use anhyst_launch::say::quoted;
use anhyst_launch::signals;
use anhyst_launch::summary::Summary;
use anhyst_model::ActuatorModel;
use anhyst_plant_sim::PlantRod;
use anhyst_scenario::Scenario;
use belief::told;
use clap::Args;
use report::{Commission, page, table};
use std::path::{Path, PathBuf};

/// Which programs the steps were made with.
const PROGRAMS: &str = "programs.txt";

/// `commission`
#[derive(Debug, Args)]
pub struct CommissionArguments {
    /// Which scenario.
    #[command(flatten)]
    pub scenario: ScenarioArguments,
    /// Run all nodes in this process, without iceoryx2.
    #[arg(long)]
    pub embedded: bool,
    /// Cuts at most, the small one not counted.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=20))]
    pub cuts: u32,
    /// How the processes meet, and who takes whose place.
    #[command(flatten)]
    pub alone: AloneArguments,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// For the diagnosis.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// How the result is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or results that cannot be written.
pub fn run(arguments: &CommissionArguments) -> miette::Result<Ending> {
    signals::install();
    let own = &arguments.scenario;
    let mut scenario = changed(&own.scenario, &own.set, arguments.embedded, &arguments.alone)?;
    if arguments.alone.across.is_part() {
        return Err(miette::miette!("--here: a rig is commissioned from one host"));
    }
    scenario.recording.on = true;
    // What is really so stays so, whatever is believed from here on.
    let believed = scenario.believed_model().map_err(told)?;
    let plant = &mut scenario.plant;
    plant.material.get_or_insert(believed.material);
    if plant.rod == PlantRod::TwoPole {
        plant.two_pole = plant.two_pole.or(believed.rod);
    }
    let name = format!("commission-{}", scenario.name);
    let claimed = arguments.out.claim_beside(&name, "scenario.ron", &own.scenario)?;
    let mut work = Work {
        arguments,
        goes_on: goes_on(&claimed.path, &arguments.alone)?,
        out: &claimed.path,
        failed: false,
        rest: rest::Rest::default(),
        response: Vec::new(),
        response_run: None,
        believed: None,
        result: Commission::default(),
    };
    let commissioned = match work.commission(scenario) {
        Err(error) if work.failed => {
            let left = "the same call goes on from there";
            return Ok(crate::commands::failed::failed(&error, left, arguments.json.json));
        }
        commissioned => commissioned?,
    };
    let Work { result, out, .. } = work;
    if let Some(scenario) = &commissioned {
        let text = scenario.to_ron().map_err(|error| RunError::Setup(error.to_string()))?;
        save(out, "commissioned.ron", &format!("// {}\n{text}\n", result.sentence))?;
    }
    save(out, "commission.json", &json(&result)?)?;
    save(out, "commission.html", &page(&result).html())?;
    if arguments.json.json {
        crate::say!("{}", json(&result)?);
    } else {
        crate::say!("\n{}\n", result.sentence);
        if !result.cuts.is_empty() {
            crate::say!("{}", table(&result).terminal());
        }
        crate::say!("results: {}", out.display());
        if commissioned.is_some() {
            crate::say!("run it: anhyst run {}", quoted(&out.join("commissioned.ron")));
        }
    }
    Ok(if result.fit { Ending::Held } else { Ending::NotHeld })
}

/// True where an earlier call was killed before it came to its end, with the same programs in the processes' places; makes a note for the next one.
fn goes_on(out: &Path, alone: &AloneArguments) -> miette::Result<bool> {
    let programs = format!("{:?}\n", alone.external_commands);
    let note = out.join(PROGRAMS);
    let same = std::fs::read_to_string(&note).is_ok_and(|before| before == programs);
    let goes_on = same && !out.join("commission.json").exists();
    remove(out, &["commission.json", "commission.html", "commissioned.ron"])?;
    save(out, PROGRAMS, &programs)?;
    Ok(goes_on)
}

/// What an earlier call found would be taken for this one's.
fn remove(out: &Path, stale: &[&str]) -> Result<(), RunError> {
    let stale = stale.iter().map(|file| out.join(file));
    for path in stale.filter(|path| path.exists()) {
        std::fs::remove_file(&path).map_err(|cause| RunError::Write { path, cause })?;
    }
    Ok(())
}

struct Work<'a> {
    arguments: &'a CommissionArguments,
    goes_on: bool,
    /// A process failed, or the call was ended.
    failed: bool,
    out: &'a Path,
    result: Commission,
    /// The sensor's noise.
    rest: rest::Rest,
    /// From demand to sensor, with what is believed now; nothing: as believed.
    response: Vec<MeasuredResponse>,
    /// Where that was measured.
    response_run: Option<PathBuf>,
    /// Before the first diagnosis.
    believed: Option<ActuatorModel>,
}

impl Work<'_> {
    fn find(&mut self, finding: &str) {
        if !self.arguments.json.json {
            crate::say!("{finding}");
        }
        self.result.findings.push(finding.to_owned());
    }

    /// Runs a step, unless it was made before a kill.
    fn step(&mut self, name: &str, scenario: &Scenario) -> miette::Result<(Summary, PathBuf)> {
        let path = self.out.join(name);
        let folder = RunFolder::open(&path);
        let text = as_saved(scenario, &folder)?.to_ron().map_err(told)?;
        let same = self.goes_on && std::fs::read_to_string(folder.scenario()).is_ok_and(|before| before == text);
        let before = std::fs::read(folder.summary()).ok().filter(|_| same);
        if let Some(summary) = before.and_then(|before| serde_json::from_slice(&before).ok()) {
            return Ok((summary, path));
        }
        scenario.validate().map_err(told)?;
        remove(&path, &["diagnosis.json", "diagnosis.html", "amended.ron"])?;
        let (folder, outcome) = perform(scenario, &self.arguments.alone, Some(&path))?;
        let reports = outcome.inspect_err(|_| self.failed = true)?;
        Ok((Summary::written(scenario, &reports, &folder)?, path))
    }
}
