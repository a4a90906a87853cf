//! A scenario that is another one with some values changed:
//! `(based_on: "milling.ron", name: "fixed", set: { "estimator.law": "Fixed(a_per_m: 6800.0)" })`.

use indexmap::IndexMap;
use serde::Deserialize;
use std::path::PathBuf;

/// The text of a derived scenario.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Derived {
    /// The scenario that is changed, relative to this file.
    pub based_on: PathBuf,
    /// The new name.
    pub name: String,
    /// Paths and their new values, as after `--set`, worked in from top to bottom.
    #[serde(default)]
    pub set: IndexMap<String, String>,
}

/// True if the text is that of a derived scenario, or would be but for what it is based on.
pub fn is_derived(text: &str) -> bool {
    super::source::read(text).is_some_and(|place| place.has_field("based_on") || place.has_field("set"))
}
