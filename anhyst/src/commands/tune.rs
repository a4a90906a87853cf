//! `anhyst tune`: changes settings of a run that goes on.

use super::Ending;
use crate::arguments::JsonArgument;
use anhyst_ipc::Tunable;
use anhyst_launch::tuning::{running, tune};
use clap::Args;
use std::path::PathBuf;

/// `tune`
#[derive(Debug, Args)]
pub struct TuneArguments {
    /// The run: its folder, that folder's name under runs/, or the scenario's name if only one of that name goes on there.
    pub run: PathBuf,
    /// What is changed: `controller.feedback.kp=0.4` (several take effect in one tick).
    #[arg(required = true, value_name = "PATH=VALUE", value_parser = setting)]
    pub settings: Vec<(Tunable, f64)>,
    /// How the ticks are printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

fn setting(text: &str) -> Result<(Tunable, f64), String> {
    let (path, value) = text
        .split_once('=')
        .ok_or_else(|| format!("{text} has no '='; write path=value"))?;
    let set = Tunable::try_from(path.trim().to_owned())?;
    let number = match (set, value.trim()) {
        (Tunable::Learning, "on" | "true") => Some(1.0),
        (Tunable::Learning, "off" | "false") => Some(0.0),
        (_, value) => value.parse().ok().filter(|value: &f64| value.is_finite()),
    };
    let number = number.ok_or_else(|| format!("{text}: {} is no finite number", value.trim()))?;
    Ok((set, number))
}

/// Runs the command.
///
/// # Errors
/// A setting that cannot be so, a run that does not go on, a process that does not answer.
pub fn run(arguments: &TuneArguments) -> miette::Result<Ending> {
    let mut known: Vec<Tunable> = Vec::new();
    for (set, _) in &arguments.settings {
        if known.contains(set) {
            miette::bail!("{set} is given twice");
        }
        known.push(*set);
    }
    let folder = running(&arguments.run)?;
    let (scenario, changes) = tune(&folder, &arguments.settings)?;
    if arguments.json.json {
        crate::say!("{}", super::json(&changes)?);
        return Ok(Ending::Held);
    }
    for change in changes {
        let time_s = change.tick as f64 * scenario.tick_s;
        crate::say!("{change} from tick {} on, {time_s:.4} s", change.tick);
    }
    Ok(Ending::Held)
}
