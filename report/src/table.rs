//! Tables: numbers stand right, words left, verdicts as badges; for a terminal, a document (Markdown) or a page.

use crate::number::Digits;
use comfy_table::{CellAlignment, presets::UTF8_FULL_CONDENSED};

/// A header and rows. A row may be shorter than the header; what is longer is shown too.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub caption: String,
    /// May be empty.
    pub header: Vec<String>,
    pub rows: Vec<Vec<Cell>>,
}

/// What stands in a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    Words(String),
    Number(String),
    Badge(Badge),
}

/// A verdict in a word or a few.
#[derive(Clone, Debug, PartialEq)]
pub struct Badge {
    pub verdict: Verdict,
    pub text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Pass,
    Fail,
    /// Neither: something to know.
    Note,
}

impl Badge {
    pub fn new(verdict: Verdict, text: &str) -> Self {
        Badge {
            verdict,
            text: text.to_owned(),
        }
    }

    /// Pass or fail by a condition.
    pub fn of(held: bool, text: &str) -> Self {
        Badge::new(if held { Verdict::Pass } else { Verdict::Fail }, text)
    }
}

impl Table {
    pub fn new<Name: Into<String>>(header: impl IntoIterator<Item = Name>) -> Self {
        Table {
            header: header.into_iter().map(Into::into).collect(),
            ..Table::default()
        }
    }

    #[must_use]
    pub fn caption(mut self, caption: &str) -> Self {
        caption.clone_into(&mut self.caption);
        self
    }

    #[must_use]
    pub fn row<Text: Into<Cell>>(mut self, cells: impl IntoIterator<Item = Text>) -> Self {
        self.push(cells);
        self
    }

    pub fn push<Text: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = Text>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// With thin lines, as all commands print it.
    pub fn terminal(&self) -> String {
        let mut table = comfy_table::Table::new();
        table.load_style(UTF8_FULL_CONDENSED);
        if !self.header.is_empty() {
            table.set_header(&self.header);
        }
        for row in &self.rows {
            table.add_row(row.iter().map(Cell::text));
        }
        for (index, column) in table.column_iter_mut().enumerate() {
            if self.is_numeric(index) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table.to_string()
    }

    /// For a document; ends in a line break.
    pub fn markdown(&self) -> String {
        let line = |cells: &mut dyn Iterator<Item = &str>| {
            let cells: Vec<String> = cells.map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = format!("|{}\n", "---|".repeat(self.header.len()));
        let rows = self.rows.iter().map(|row| line(&mut row.iter().map(Cell::text)));
        line(&mut self.header.iter().map(String::as_str)) + &rule + &rows.collect::<String>()
    }

    /// A column holds numbers if every cell in it that says anything does.
    pub(crate) fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.get(column)).peekable();
        cells.peek().is_some() && cells.all(|cell| matches!(cell, Cell::Number(_)) || cell.is_blank())
    }
}

impl Cell {
    fn text(&self) -> &str {
        match self {
            Cell::Words(text) | Cell::Number(text) => text,
            Cell::Badge(badge) => &badge.text,
        }
    }

    fn is_blank(&self) -> bool {
        matches!(self, Cell::Words(words) if words.trim().trim_matches(['-', '–', '—']).is_empty())
    }
}

/// Text that begins with a number is a number, its unit may follow, and others: "20.1 nm", "≤ 0.5", "−3", "7.2, 7.3 A/m".
impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        let begins = text
            .trim_start_matches(['<', '>', '=', '≤', '≥', '≈', '±', '×', '~', ' '])
            .replace('−', "-");
        let word = begins
            .split_whitespace()
            .next()
            .unwrap_or_default()
            .trim_end_matches(['%', '°', ',']);
        if word.parse::<f64>().is_ok() {
            Cell::Number(text.to_owned())
        } else {
            Cell::Words(text.to_owned())
        }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::from(text.as_str())
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Self {
        Cell::from(text.as_str())
    }
}

/// Five significant digits.
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Cell::Number(Digits(value, 5).to_string())
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Cell::Number(value.to_string())
    }
}

impl From<Badge> for Cell {
    fn from(badge: Badge) -> Self {
        Cell::Badge(badge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the three faces of one table: the same cells, numbers right, a stroke in a cell no new column.
    #[test]
    fn a_table_is_drawn_for_terminal_and_document() {
        let mut table = Table::new(["law", "a, A/m"]).row([Cell::from("folded | new"), Cell::from(7012.3)]);
        table.push(["gradient", "–"]);
        assert_eq!(
            table.markdown(),
            "| law | a, A/m |\n|---|---|\n| folded \\| new | 7012.3 |\n| gradient | – |\n"
        );
        let text = table.terminal();
        assert!(text.contains("│ folded | new ┆ 7012.3 │"), "{text}");
        assert!(text.contains("│ gradient     ┆      – │"), "{text}");
    }

    #[test]
    fn text_that_begins_with_a_number_is_one() {
        for (text, number) in [
            ("20.1 nm", true),
            ("≤ 0.5 %", true),
            ("× 2.57", true),
            ("7200.0, 7200.1 A/m", true),
            ("<= 3", true),
            ("−3", true),
            ("case01", false),
            ("a 3", false),
        ] {
            assert_eq!(matches!(Cell::from(text), Cell::Number(_)), number, "{text}");
        }
    }
}
