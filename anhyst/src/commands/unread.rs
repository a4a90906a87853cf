//! What the commands that read measured files say where one refuses.

use super::data::option;
use anhyst_launch::say::quoted;
use anhyst_measured::RunReadOptions;
use anhyst_measured::survey::Survey;
use std::fmt::Display;
use std::path::Path;

/// The sentence with which a measured file is refused, and what to give instead: what `data` proposes, if this command reads it so.
pub fn unread<E: Display>(command: &str, file: &Path, reading: &RunReadOptions) -> impl FnOnce(E) -> miette::Report {
    move |error| {
        let survey = Survey::of(file, reading).ok();
        let proposed = survey.as_ref().and_then(|own| own.read_by(command)).unwrap_or_default();
        let given: Vec<String> = reading.mappings.iter().map(ToString::to_string).collect();
        let options: Vec<String> = proposed.iter().map(|own| option(own)).collect();
        let look = format!("anhyst data {}", quoted(file));
        let help = match proposed.iter().all(|own| given.contains(own)) {
            true => format!("what it holds, and what to give: {look}"),
            false => format!("as its columns seem to be, give {} (why: {look})", options.join(" ")),
        };
        miette::miette!(help = help, "{error}")
    }
}
