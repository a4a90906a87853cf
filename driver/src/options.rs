//! Who a driver is: from its arguments, else from the environment that the launcher sets.

use crate::error::Failure;
use anhyst_ipc::{Channel, ExternalClock, ExternalSettings, Invalid, YIELDS_SHARED};
use std::path::PathBuf;
use std::time::Duration;

const START_LIMIT_S: f64 = 60.0;

fn from_environment(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

fn given(argument: Option<&str>, variable: &str) -> Result<String, Failure> {
    argument
        .map(str::to_owned)
        .or_else(|| from_environment(variable))
        .ok_or_else(|| Failure::bad(format!("no {variable}: give it as an argument or in the environment")))
}

fn number(variable: &str, default: f64) -> Result<f64, Failure> {
    let Some(text) = from_environment(variable) else {
        return Ok(default);
    };
    text.parse()
        .map_err(|_| Failure::bad(format!("{variable}={text} is no number")))
}

/// How time passes: lockstep unless the environment tells otherwise.
pub fn clock() -> Result<ExternalClock, Failure> {
    match from_environment("ANHYST_CLOCK") {
        Some(name) => Ok(ExternalClock::told(&name, number("ANHYST_TICK_S", f64::NAN)?)?),
        None => Ok(ExternalClock::Lockstep),
    }
}

/// An external node's settings.
pub fn settings(
    process: Option<&str>,
    prefix: Option<&str>,
    root: Option<&str>,
    processes: Option<&str>,
    reads: u32,
    start_limit_s: f64,
) -> Result<ExternalSettings, Failure> {
    let start_limit_s = if start_limit_s == 0.0 {
        number("ANHYST_START_LIMIT_S", START_LIMIT_S)?
    } else {
        start_limit_s
    };
    Invalid::unless_between("", start_limit_s, 0.01, 86_400.0, "s")
        .map_err(|refused| Failure::bad(format!("a start limit of {}", refused.sentence)))?;
    if reads >> Channel::ALL.len() != 0 {
        return Err(Failure::bad(format!(
            "reads = {reads:#x} names channels that do not exist"
        )));
    }
    Ok(ExternalSettings {
        process: given(process, "ANHYST_PROCESS")?,
        prefix: given(prefix, "ANHYST_SERVICE_PREFIX")?,
        root: PathBuf::from(given(root, "ANHYST_ROOT")?),
        processes: processes
            .map(str::to_owned)
            .or_else(|| from_environment("ANHYST_PROCESSES")),
        reads: Channel::ALL
            .into_iter()
            .filter(|channel| reads >> channel.number() & 1 == 1)
            .collect(),
        yields: number("ANHYST_YIELDS", f64::from(YIELDS_SHARED))? as u32,
        start_limit: Duration::from_secs_f64(start_limit_s),
    })
}
