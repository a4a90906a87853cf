//! What the user says about a table.

use crate::columns::ColumnMapping;
use crate::rows::RowRange;

/// How a table is read: columns named by the user, the rows that are kept, and rows left out of those.
#[derive(Clone, Debug, Default)]
pub struct RunReadOptions {
    pub mappings: Vec<ColumnMapping>,
    /// All rows if none.
    pub rows: Option<RowRange>,
    pub drop_rows: Vec<RowRange>,
}
