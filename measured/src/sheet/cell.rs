//! What stands in a cell.

/// A number, or anything else as it is written.
pub(super) enum Cell<'a> {
    Number(f64),
    Text(&'a str),
}
