//! `anhyst study blind`: the blind study of the diagnosis, rerun on all cores; `tests/witness` makes the rigs.
//!
//! Every finished run is a line of DIR/runs.jsonl, so that an interrupted study goes on where it was.

use crate::arguments::{JsonArgument, ThreadsArgument};
use crate::commands::sweep::told;
use crate::commands::{Ending, count_bar, json, save};
use anhyst_identify::parallel;
use anhyst_launch::error::RunError;
use anhyst_launch::say::quoted;
use anhyst_model::{ActuatorModel, AmplifierConstants};
use anhyst_scenario::{load, load_model};
use anhyst_studies::blind::{Case, Nuisance, Plan, Results, StudyRun, Subject, markdown, page, study, summary};
use anhyst_sweep::Journal;
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;

const RUNS: &str = "runs.jsonl";

/// `study blind`
#[derive(Debug, Args)]
pub struct BlindArguments {
    /// Nominal model (RON), of whose numbers the rigs are made: any material or law with a rod (default: that of
    /// scenarios/models/nominal.ron, built in).
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// Instead of a model what the controller's side of a scenario believes: its material or law, and its rod.
    #[arg(long, value_name = "FILE", conflicts_with = "model")]
    pub scenario: Option<PathBuf>,
    /// Runs with one effect of the library, under each nuisance.
    #[arg(long, default_value_t = 23)]
    pub singles: u64,
    /// Runs with nothing hidden, under each nuisance.
    #[arg(long, default_value_t = 10)]
    pub none: u64,
    /// Runs with an effect that the library does not hold, under each nuisance.
    #[arg(long, default_value_t = 6)]
    pub unlisted: u64,
    /// Runs with two effects, under each nuisance.
    #[arg(long, default_value_t = 6)]
    pub pairs: u64,
    /// Sweep for detection limits: so many runs at each of the gaps 0.25, 0.5, 1, 2 and 4 noises, under each nuisance.
    #[arg(long, default_value_t = 0, value_name = "RUNS", num_args = 0..=1, default_missing_value = "6")]
    pub limits: u64,
    /// Only under these nuisances.
    #[arg(long, value_name = "NUISANCE,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(Nuisance::ALL.map(Nuisance::name)))]
    pub nuisance: Vec<String>,
    /// Of the seeds that decide everything. Nothing was tuned on the default's.
    #[arg(long, default_value_t = 76_000_000)]
    pub first_seed: u64,
    /// Samples of a run, at 10 kHz.
    #[arg(long, default_value_t = 40_000, value_parser = clap::value_parser!(u64).range(4000..=1_000_000))]
    pub samples: u64,
    /// For the runs.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// Folder of the results. Runs that are there already are not made again, so keep to one model.
    #[arg(long, default_value = "runs/study", value_name = "FOLDER")]
    pub out: PathBuf,
    /// Exit status 1 if a bar does not hold.
    #[arg(long)]
    pub require: bool,
    /// How the results are printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A bad model, or a result that cannot be written.
pub fn run(arguments: &BlindArguments) -> miette::Result<Ending> {
    let model = match (&arguments.model, &arguments.scenario) {
        (Some(file), _) => load_model(file)?,
        (None, Some(file)) => ActuatorModel {
            // The rigs' amplifiers pass commands on as they are.
            amplifier: AmplifierConstants::default(),
            ..load(file, &[])?.believed_model().map_err(refused)?
        },
        (None, None) => ActuatorModel::terfenol_d(),
    };
    let plan = Plan {
        singles: arguments.singles,
        none: arguments.none,
        unlisted: arguments.unlisted,
        pairs: arguments.pairs,
        limits: arguments.limits,
        first_seed: arguments.first_seed,
        rows: arguments.samples as usize,
    };
    let subject = Subject::of(model).map_err(refused)?;
    let runs = all_runs(arguments, &subject, &plan)?;
    let results = Results::new(plan, &subject.model().name, runs);
    let (made, command) = (json(&results)?, command(arguments));
    let files = [
        ("study.json", format!("{made}\n")),
        ("study.md", markdown(&results, &command)),
        ("study.html", page(&results, &command).html()),
    ];
    for (file, text) in files {
        save(&arguments.out, file, &text)?;
    }
    if arguments.json.json {
        crate::say!("{made}");
    } else {
        for (_, table) in summary(&results) {
            crate::say!("{}\n", table.terminal());
        }
        crate::say!("results: {}", arguments.out.display());
    }
    Ok(if arguments.require && !results.held() {
        Ending::NotHeld
    } else {
        Ending::Held
    })
}

/// The line that makes the study again, wherever its results go.
fn command(arguments: &BlindArguments) -> String {
    let BlindArguments {
        singles,
        none,
        unlisted,
        pairs,
        limits,
        nuisance,
        first_seed,
        samples,
        ..
    } = arguments;
    let told = [("--model", &arguments.model), ("--scenario", &arguments.scenario)];
    let told = told.map(|(option, file)| {
        file.as_ref()
            .map_or(String::new(), |file| format!(" {option} {}", quoted(file)))
    });
    let model = told.concat();
    let sweep = if *limits > 0 {
        format!(" --limits {limits}")
    } else {
        String::new()
    };
    let only = if nuisance.is_empty() {
        String::new()
    } else {
        format!(" --nuisance {}", nuisance.join(","))
    };
    format!(
        "anhyst study blind{model} --singles {singles} --none {none} --unlisted {unlisted} --pairs {pairs}{sweep}{only} --first-seed {first_seed} --samples {samples}"
    )
}

/// Those that the folder holds, and the rest made now; in the order of the plan.
fn all_runs(arguments: &BlindArguments, subject: &Subject, plan: &Plan) -> miette::Result<Vec<StudyRun>> {
    let out = &arguments.out;
    std::fs::create_dir_all(out).map_err(|cause| RunError::Write {
        path: out.clone(),
        cause,
    })?;
    let mut present: HashMap<(u64, usize), StudyRun> = HashMap::new();
    let journal = Journal::open(&out.join(RUNS), |run: StudyRun, _| {
        present.insert((run.seed, run.rows), run);
    });
    let mut journal = journal.map_err(told)?;
    let mut cases = plan.cases(subject);
    let only = &arguments.nuisance;
    cases.retain(|case| only.is_empty() || only.iter().any(|name| name == case.nuisance.name()));
    let mut runs: HashMap<u64, StudyRun> = cases
        .iter()
        .filter_map(|case| present.remove(&(case.seed, plan.rows)).filter(|run| run.is_of(case)))
        .map(|run| (run.seed, run))
        .collect();
    let missing: Vec<&Case> = cases.iter().filter(|case| !runs.contains_key(&case.seed)).collect();
    let bar = count_bar(missing.len() as u64, "study");
    let mut kept = Ok(0);
    parallel::each(
        arguments.threads.count(),
        missing.into_iter(),
        |case| studied(case, subject),
        |run| {
            kept = journal.append(&run);
            runs.insert(run.seed, run);
            bar.inc(1);
            match kept {
                Ok(_) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        },
    );
    bar.finish_and_clear();
    kept.map_err(told)?;
    Ok(cases.iter().filter_map(|case| runs.remove(&case.seed)).collect())
}

fn refused(error: impl std::fmt::Display) -> miette::Report {
    miette::miette!("{error}")
}

/// A panic is a failed run, not the end of the study; work that was given up is.
fn studied(case: &Case, subject: &Subject) -> StudyRun {
    catch_unwind(AssertUnwindSafe(|| study(case, subject))).unwrap_or_else(|payload| {
        match payload.is::<parallel::GivenUp>() {
            true => resume_unwind(payload),
            false => StudyRun::failed(case, "the diagnosis panicked".to_owned()),
        }
    })
}
