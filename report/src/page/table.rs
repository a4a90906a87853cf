//! Tables: numbers stand right, words left, verdicts as badges.

use super::badge::Badge;

/// A header and rows. A row may be shorter than the header; what is longer is shown too.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    pub caption: String,
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

impl Table {
    pub fn new(header: &[&str]) -> Self {
        Table {
            header: header.iter().map(|name| (*name).to_owned()).collect(),
            ..Table::default()
        }
    }

    #[must_use]
    pub fn caption(mut self, caption: &str) -> Self {
        caption.clone_into(&mut self.caption);
        self
    }

    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// A column holds numbers if every cell in it that says anything does.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.get(column)).peekable();
        cells.peek().is_some() && cells.all(|cell| matches!(cell, Cell::Number(_)) || cell.is_blank())
    }
}

impl Cell {
    fn is_blank(&self) -> bool {
        matches!(self, Cell::Words(words) if words.trim().trim_matches(['-', '–', '—']).is_empty())
    }
}

/// Text that begins with a number is a number, its unit may follow: "20.1 nm", "≤ 0.5", "−3".
impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        let begins = text
            .trim_start_matches(['<', '>', '≤', '≥', '≈', '±', '~', ' '])
            .replace('−', "-");
        let word = begins
            .split_whitespace()
            .next()
            .unwrap_or_default()
            .trim_end_matches('%');
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

/// Five significant digits.
impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        let size = value.abs();
        let text = if value == 0.0 || !value.is_finite() {
            format!("{value}")
        } else if (1e-3..1e6).contains(&size) {
            let decimals = (4 - size.log10().floor() as i32).max(0) as usize;
            format!("{value:.decimals$}")
        } else {
            format!("{value:.4e}")
        };
        Cell::Number(text.replace('-', "−"))
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
