use miette::{Diagnostic, NamedSource, SourceSpan};
use std::path::{Path, PathBuf};

/// Why a file cannot be used: one sentence with the place, and the place itself for the picture below it.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{path} cannot be read: {cause}", path = path.display())]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A value is wrong.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Refused(Box<Refusal>),
    /// A `--set` that cannot be done.
    #[error("{setting} cannot be set: {sentence}")]
    Setting {
        /// As the user wrote it.
        setting: String,
        /// Why not.
        sentence: String,
    },
}

/// A wrong value and its place.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{file}:{line}:{column}: {sentence}")]
pub struct Refusal {
    /// File as named by the user.
    pub file: String,
    /// From 1.
    pub line: usize,
    /// From 1.
    pub column: usize,
    /// Value, limit and reason.
    pub sentence: String,
    /// The text, for the picture.
    #[source_code]
    source_code: NamedSource<String>,
    /// The value's place.
    #[label("here")]
    place: SourceSpan,
}

impl ScenarioError {
    /// A refusal of `bytes` of `text`.
    pub fn at(path: &Path, text: &str, bytes: std::ops::Range<usize>, sentence: String) -> Self {
        let (line, column) = super::source::line_and_column(text, bytes.start);
        let file = path.display().to_string();
        // One line of a long value is enough to show where it is.
        let shown = text
            .get(bytes.clone())
            .map_or(0, |value| value.lines().next().unwrap_or_default().len());
        Self::Refused(Box::new(Refusal {
            source_code: NamedSource::new(&file, text.to_owned()),
            place: (bytes.start, shown).into(),
            file,
            line,
            column,
            sentence,
        }))
    }
}
