//! What the commands that read measured files say where one refuses.

use super::data::options;
use anhyst_launch::say::quoted;
use anhyst_measured::RunReadOptions;
use anhyst_measured::survey::Survey;
use std::fmt::Display;
use std::path::Path;

/// The sentence with which a measured file is refused, and what to give instead: what `data` proposes, if this command reads it so.
pub fn unread<E: Display>(command: &str, file: &Path, reading: &RunReadOptions) -> impl FnOnce(E) -> miette::Report {
    move |error| {
        if !file.exists() {
            return miette::miette!("{error}");
        }
        // What is named wrongly is proposed anew.
        let anew = RunReadOptions {
            mappings: Vec::new(),
            ..reading.clone()
        };
        let survey = Survey::of(file, reading).or_else(|_| Survey::of(file, &anew)).ok();
        let table = survey.as_ref().and_then(|own| own.read_by(command));
        let given: Vec<String> = reading.mappings.iter().map(ToString::to_string).collect();
        let is_new = table.is_some_and(|own| {
            own.columns.iter().any(|column| !given.contains(column)) || own.drop_rows.len() > reading.drop_rows.len()
        });
        let look = format!("anhyst data {}", quoted(file));
        let help = match table.filter(|_| is_new) {
            None => format!("what it holds, and what to give: {look}"),
            Some(table) => format!(
                "as its columns seem to be, give {} (why: {look})",
                options(table).join(" ")
            ),
        };
        miette::miette!(help = help, "{error}")
    }
}
