//! Tables for people at a terminal.

use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};

/// A table with thin lines, as all commands print it.
pub fn plain_table() -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED);
    table
}
