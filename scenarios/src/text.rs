//! From a file, or what is in the program, to a text, and from a RON text to our structs or a sentence.

use super::{Scenario, ScenarioError, misread, source};
use anhyst_measured::nearest;
use ron::error::SpannedError;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;
use serde::de::DeserializeOwned;
use std::path::Path;

/// RON as we read it: `Some` may be left out, and a variant may hold its struct's fields directly.
pub(crate) fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME | Extensions::UNWRAP_VARIANT_NEWTYPES)
}

/// Any of our structs as a RON text that [`parse`] reads.
///
/// # Errors
/// If the value has no RON form (a number that is not finite has one, so ours always do).
pub fn to_ron<T: serde::Serialize>(value: &T) -> Result<String, ron::Error> {
    options().to_string_pretty(value, PrettyConfig::new().depth_limit(8))
}

impl Scenario {
    /// As [`to_ron`], compiled here once: a scenario holds almost every struct that we have.
    ///
    /// # Errors
    /// As [`to_ron`].
    pub fn to_ron(&self) -> Result<String, ron::Error> {
        to_ron(self)
    }
}

/// What `verify-amplifier` takes unless it is told another scenario.
pub const BUILT_IN_AMPLIFIER: &str = "built-in/amplifier.ron";

/// Scenarios that are in the program, so that it needs no repository around it: where no file is.
pub(crate) const BUILT_IN: [(&str, &str); 8] = [
    (BUILT_IN_AMPLIFIER, include_str!("../amplifier.ron")),
    ("built-in/milling.ron", include_str!("../milling.ron")),
    (
        "built-in/materials/terfenol_nealis_smith.ron",
        include_str!("../materials/terfenol_nealis_smith.ron"),
    ),
    (
        "built-in/materials/terfenol_d_measured.ron",
        include_str!("../materials/terfenol_d_measured.ron"),
    ),
    (
        "built-in/materials/piezo_stage_plays.ron",
        include_str!("../materials/piezo_stage_plays.ron"),
    ),
    (
        "built-in/materials/piezo_stage_preisach.ron",
        include_str!("../materials/piezo_stage_preisach.ron"),
    ),
    (
        "built-in/materials/magnet_plays.ron",
        include_str!("../materials/magnet_plays.ron"),
    ),
    (
        "built-in/materials/magnet_preisach.ron",
        include_str!("../materials/magnet_preisach.ron"),
    ),
];

pub(crate) fn is_built_in(file: &Path) -> bool {
    BUILT_IN.iter().any(|(name, _)| file == Path::new(name))
}

/// The text of a scenario, a model or a material, without the mark that some editors put before it.
pub(crate) fn read(path: &Path) -> Result<String, ScenarioError> {
    let text = match (
        std::fs::read_to_string(path),
        BUILT_IN.iter().find(|(name, _)| path == Path::new(name)),
    ) {
        (Ok(text), _) => text,
        (Err(_), Some((_, text))) => (*text).to_owned(),
        (Err(cause), None) => {
            return Err(ScenarioError::Unreadable {
                instead: match cause.kind() {
                    std::io::ErrorKind::NotFound => instead(path),
                    _ => String::new(),
                },
                path: path.to_owned(),
                cause,
            });
        }
    };
    Ok(match text.strip_prefix('\u{feff}') {
        Some(text) => text.to_owned(),
        None => text,
    })
}

/// What a file of ours is, by names at its top: the first that fits. A scenario has a `material`, too.
const KINDS: [(&str, &[&str]); 5] = [
    (
        SCENARIO,
        &["based_on", "controller", "estimator", "plant", "guard", "clock"],
    ),
    ("law", &["input_extent"]),
    ("model", &["material"]),
    ("hysteresis", &["anhysteretic"]),
    ("material", &["hysteresis", "magnetostriction"]),
];

pub(crate) const SCENARIO: &str = "scenario";

/// Refuses a text that is of another kind, or no RON; what is neither is left to its reader, who says what is missing.
///
/// # Errors
/// What it is, and what is `wanted`.
pub(crate) fn expect_kind(
    path: &Path,
    text: &str,
    wanted: &str,
    fits: impl Fn(&str) -> bool,
) -> Result<(), ScenarioError> {
    let Some(place) = source::read(text) else {
        return Ok(());
    };
    let kind = KINDS
        .iter()
        .find(|(_, names)| names.iter().any(|name| place.has_field(name)));
    let is = match kind {
        Some((kind, _)) if !fits(kind) => format!("a {kind}"),
        None if !place.has_fields() => "no RON in brackets, as (name: value)".to_owned(),
        _ => return Ok(()),
    };
    let sentence = format!("this is {is}; a {wanted} is wanted here");
    Err(ScenarioError::at(path, text, place.value, sentence))
}

/// What may be meant by a file that is missing: what is in the program under its name or one like it, or else, for who asks for
/// what is in the program, all of it.
pub(crate) fn instead(path: &Path) -> String {
    let names = || BUILT_IN.iter().map(|(name, _)| *name);
    let file = |name: &'static str| name.rsplit('/').next().unwrap_or(name);
    let written = path.file_name().unwrap_or_default().to_string_lossy();
    match nearest(&written, names().map(file)).and_then(|near| names().find(|name| file(name) == near)) {
        Some(name) => format!("; in the program is {name}"),
        None if path.starts_with("built-in") => {
            format!("; in the program are {}", names().collect::<Vec<_>>().join(", "))
        }
        None => String::new(),
    }
}

/// Any of our structs from a RON text, of which `path` is what to call it.
///
/// # Errors
/// The first thing that is wrong, with line and column.
pub fn parse<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, ScenarioError> {
    options().from_str(text).map_err(|error| misread(path, text, &error))
}

pub(crate) fn misread(path: &Path, text: &str, error: &SpannedError) -> ScenarioError {
    let start = byte_of(text, error.span.start.line, error.span.start.col);
    // The reader stops before the blanks in front of the value.
    let rest = &text[start..];
    let start = start + (rest.len() - rest.trim_start_matches([' ', '\t']).len());
    ScenarioError::at(
        path,
        text,
        start..start + 1,
        misread::sentence(text, start, &error.code),
    )
}

pub(crate) fn place_of(text: &str, path: &str) -> std::ops::Range<usize> {
    source::read(text).map_or(0..0, |place| place.nearest(path).value.clone())
}

fn byte_of(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text
        .split_inclusive('\n')
        .take(line.saturating_sub(1))
        .map(str::len)
        .sum();
    text[start..]
        .char_indices()
        .nth(column.saturating_sub(1))
        .map_or(text.len(), |(byte, _)| start + byte)
}

#[cfg(test)]
mod tests {
    use crate::{load, load_model};
    use std::path::Path;

    /// Guards what a newcomer reads who gives the wrong one of our files.
    #[test]
    fn another_kind_of_file_is_named() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let said = |file: &str| load(&folder.join(file), &[]).unwrap_err().to_string();
        for (file, kind) in [
            ("materials/terfenol_nealis_smith.ron", "material"),
            ("materials/magnet_plays.ron", "law"),
            ("models/nominal.ron", "model"),
        ] {
            let sentence = format!("this is a {kind}; a scenario is wanted here");
            assert!(said(file).ends_with(&sentence), "{}", said(file));
        }
        for (file, is) in [("milling.ron", "a scenario"), ("Cargo.toml", "no RON in brackets")] {
            let said = load_model(&folder.join(file)).unwrap_err().to_string();
            assert!(said.contains(&format!("this is {is}")), "{said}");
            assert!(said.ends_with("; a model or a material is wanted here"), "{said}");
        }
    }
}
