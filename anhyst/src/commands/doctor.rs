//! `anhyst doctor`: is this machine fit to run the loop, and has a crashed run left something?

use super::Ending;
use super::doctor_arguments::DoctorArguments;
use super::{doctor_lockstep, doctor_realtime};
use crate::arguments::beside;
use anhyst_launch::disk::mebibytes;
use anhyst_launch::error::RunError;
use anhyst_launch::resources;
use serde::Serialize;

/// One finding.
#[derive(Debug, Serialize)]
struct Finding {
    what: &'static str,
    good: bool,
    says: String,
}

/// Runs the command.
///
/// # Errors
/// If leftovers cannot be listed or removed.
pub fn run(arguments: &DoctorArguments) -> miette::Result<Ending> {
    if let Some(scenario) = arguments.realtime.as_ref().or(arguments.lockstep.as_ref()) {
        beside(Some(&arguments.out), "scenario.ron", scenario)?;
    }
    if let Some(scenario) = &arguments.realtime {
        return doctor_realtime::run(scenario, arguments);
    }
    if let Some(scenario) = &arguments.lockstep {
        return doctor_lockstep::run(scenario, arguments);
    }
    if !arguments.set.settings.is_empty() {
        return Err(miette::miette!(
            "--set changes the scenario of --realtime or --lockstep, and none is given"
        ));
    }
    let failed = |cause: std::io::Error| RunError::Setup(format!("shared memory cannot be inspected: {cause}"));
    let leftovers = resources::leftovers().map_err(failed)?;
    let mut findings = vec![shared_memory(), rights(), cores()];
    if arguments.clean {
        leftovers
            .iter()
            .try_for_each(resources::Resources::remove)
            .map_err(failed)?;
        findings.push(Finding {
            what: "leftovers",
            good: true,
            says: format!("removed those of {} crashed runs", leftovers.len()),
        });
    } else {
        let says = match leftovers.len() {
            0 => "no crashed run has left anything".into(),
            n => format!("{n} crashed runs have left files; remove them with: anhyst doctor --clean"),
        };
        findings.push(Finding {
            what: "leftovers",
            good: leftovers.is_empty(),
            says,
        });
    }
    let good = findings.iter().all(|finding| finding.good);
    if arguments.json.json {
        crate::say!("{}", super::json(&findings)?);
    } else {
        for finding in &findings {
            crate::say!(
                "{} {}: {}",
                if finding.good { "good" } else { "BAD " },
                finding.what,
                finding.says
            );
        }
    }
    Ok(if good { Ending::Held } else { Ending::NotHeld })
}

fn shared_memory() -> Finding {
    let left = resources::shared_memory_left();
    let good = left.is_ok();
    let needed = mebibytes(resources::SHARED_MEMORY_BYTES);
    let enough = |free_bytes| format!("{} free in /dev/shm, {needed} needed", mebibytes(free_bytes));
    Finding {
        what: "shared memory",
        good,
        says: left.map_or_else(|sentence| sentence, enough),
    }
}

fn rights() -> Finding {
    let root = resources::user_root();
    let probe = root.join(format!("probe-{}", std::process::id()));
    let tried = std::fs::create_dir_all(&root)
        .and_then(|()| std::fs::write(&probe, b""))
        .and_then(|()| std::fs::remove_file(&probe));
    let says = match &tried {
        Ok(()) => format!("{} can be written", root.display()),
        Err(error) => format!("{} cannot be written: {error}", root.display()),
    };
    Finding {
        what: "rights",
        good: tried.is_ok(),
        says,
    }
}

fn cores() -> Finding {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let says = if cores > 7 {
        format!("{cores} cores: run with --dedicated-cores for the shortest latencies")
    } else {
        format!(
            "{cores} cores for 7 processes: they share, and wait by sleeping (`--lockstep SCENARIO` measures what is faster)"
        )
    };
    Finding {
        what: "cores",
        good: true,
        says,
    }
}
