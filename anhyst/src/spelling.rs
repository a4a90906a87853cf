//! What was once spelled otherwise, or is not built in: refused with what to write now.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Commands of before, and how they are written now.
pub const COMMANDS: [(&str, &str); 10] = [
    ("compare", "run A.ron B.ron …"),
    ("laws", "study laws"),
    ("paper", "study paper"),
    ("plant-sim", "node plant-sim"),
    ("estimator", "node estimator"),
    ("controller", "node controller"),
    ("inverse", "node inverse"),
    ("guard", "node guard"),
    ("amplifier", "node amplifier"),
    ("recorder", "node recorder"),
];

/// Options of before: of which command, and how they are written now.
pub const OPTIONS: [(&str, &str, &str); 9] = [
    ("estimate", "--range", "--range-a-per-m"),
    ("estimate", "--start", "--start-a-per-m"),
    ("estimate", "--drift-variance", "--drift-variance-per-s"),
    ("diagnose", "--settle", "--settle-s"),
    ("doctor", "--seconds", "--duration-s"),
    ("study laws", "--laws", "--law"),
    ("study laws", "--drift", "--drift-a-per-m-s"),
    ("study laws", "--seconds", "--duration-s"),
    ("study blind", "--rows", "--samples"),
];

/// Commands and options that only a build with a cargo feature has.
const FEATURES: [(&str, &[&str], bool); 2] = [
    (
        "bridge",
        &[
            "bridge",
            "--here",
            "--listen",
            "--connect",
            "--budget-us",
            "--run-name",
            "--zenoh",
            "--zenoh-connect",
        ],
        cfg!(feature = "bridge"),
    ),
    ("recorder", &["view", "export", "--live"], cfg!(feature = "recorder")),
];

/// A sentence that helps more than clap's, if what it refused is a spelling of before or not built in. `words`: the command line behind
/// the program's name.
pub fn refusal(words: &[String], error: &clap::Error) -> Option<String> {
    let word = |at: usize| words.get(at).map_or("", String::as_str);
    let unknown = match error.kind() {
        ErrorKind::InvalidSubcommand => error.get(ContextKind::InvalidSubcommand),
        ErrorKind::UnknownArgument => error.get(ContextKind::InvalidArg),
        _ => None,
    };
    if word(0) == "study" && word(1).starts_with("--") && word(1) != "--help" {
        return Some("`anhyst study` is now `anhyst study blind`".into());
    }
    let Some(ContextValue::String(unknown)) = unknown else {
        return None;
    };
    if let Some((feature, ..)) = FEATURES
        .iter()
        .find(|(_, names, built)| !built && names.contains(&unknown.as_str()))
    {
        return Some(format!(
            "this build has no {unknown}: it needs the cargo feature `{feature}`"
        ));
    }
    if error.kind() == ErrorKind::InvalidSubcommand {
        let (old, new) = COMMANDS.iter().find(|(old, _)| old == unknown)?;
        return Some(format!("`anhyst {old}` is now `anhyst {new}`"));
    }
    let within = format!("{} {}", word(0), word(1));
    let (command, old, new) = OPTIONS
        .iter()
        .find(|(command, old, _)| old == unknown && (*command == word(0) || *command == within))?;
    Some(format!("{old} of `anhyst {command}` is now {new}"))
}
