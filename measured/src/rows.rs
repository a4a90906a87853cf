//! Ranges of rows, as in `1139..`, `..3` or `20..25` (row 25 is not in it). Rows count from 0 after the header.

use std::str::FromStr;

use crate::error::MeasuredError;

/// Rows from `first` up to, not including, `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowRange {
    pub first: u64,
    pub end: u64,
}

impl RowRange {
    pub fn contains(&self, row: u64) -> bool {
        (self.first..self.end).contains(&row)
    }
}

/// As it is read.
impl std::fmt::Display for RowRange {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.end {
            u64::MAX => write!(formatter, "{}..", self.first),
            end => write!(formatter, "{}..{end}", self.first),
        }
    }
}

impl FromStr for RowRange {
    type Err = MeasuredError;

    fn from_str(text: &str) -> Result<Self, MeasuredError> {
        let refusal = || MeasuredError::BadRows { text: text.to_owned() };
        let (first, end) = text.split_once("..").ok_or_else(refusal)?;
        let number = |part: &str, default: u64| match part.trim() {
            "" => Ok(default),
            digits => digits.parse().map_err(|_| refusal()),
        };
        let range = RowRange {
            first: number(first, 0)?,
            end: number(end, u64::MAX)?,
        };
        if range.first < range.end {
            Ok(range)
        } else {
            Err(refusal())
        }
    }
}
