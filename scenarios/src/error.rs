use miette::{Diagnostic, NamedSource, SourceSpan};
use std::path::{Path, PathBuf};

/// Why a file cannot be used: one sentence with the place, and the place itself for the picture below it.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{path} cannot be read: {cause}{instead}", path = path.display())]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
        /// What may be meant, of what is in the program.
        instead: String,
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
        let (clipped, start) = clipped(text, bytes.start);
        Self::Refused(Box::new(Refusal {
            source_code: NamedSource::new(&file, clipped),
            place: (start, shown.min(MAX_LINE)).into(),
            file,
            line,
            column,
            sentence,
        }))
    }
}

/// Bytes of a line that the picture shows; a generated file may have all in one line.
const MAX_LINE: usize = 160;
/// Of them before the place.
const BEFORE_PLACE: usize = 60;

/// The text with its long lines cut, and where the byte `at` is in it.
fn clipped(text: &str, at: usize) -> (String, usize) {
    let (mut shown, mut shown_at) = (String::with_capacity(text.len()), at);
    let mut begin = 0;
    for line in text.split_inclusive('\n') {
        let place = at.checked_sub(begin).filter(|place| *place < line.len());
        let length = line.trim_end_matches('\n').len();
        let from = if length > MAX_LINE {
            place.unwrap_or(0).saturating_sub(BEFORE_PLACE)
        } else {
            0
        };
        let from = line.floor_char_boundary(from);
        let to = line.floor_char_boundary(length.min(from + MAX_LINE));
        shown.push_str(if from > 0 { "…" } else { "" });
        if let Some(place) = place {
            shown_at = shown.len() + place - from;
        }
        shown.push_str(&line[from..to]);
        shown.push_str(if to < length { "…" } else { "" });
        shown.push_str(&line[length..]);
        begin += line.len();
    }
    let shown_at = shown_at.min(shown.len());
    (shown, shown_at)
}

#[cfg(test)]
mod tests {
    use super::clipped;

    /// Guards the picture: the place stays under the arrow, and no line fills the screen.
    #[test]
    fn long_lines_are_cut_around_the_place() {
        let text = format!("(\n  list: [{}],\n  seed: \"ö\",\n)", "1.0, ".repeat(1000));
        for word in ["seed", "],", "list"] {
            let (shown, at) = clipped(&text, text.find(word).unwrap());
            assert!(shown[at..].starts_with(word), "{word}");
            assert_eq!(shown.lines().count(), text.lines().count());
            assert!(shown.lines().all(|line| line.len() < 170));
        }
        assert_eq!(clipped("(a: 1)\n", 3), ("(a: 1)\n".to_owned(), 3));
    }
}
