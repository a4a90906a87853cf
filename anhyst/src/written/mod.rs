//! A run's measured table in the formats that others read, each read back by our own door (`anhyst/tests/export.rs`).

mod mat;
mod mcap;
mod parquet;

use anhyst_launch::measured_table::MeasuredTable;
use clap::ValueEnum;

/// A format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Text.
    Csv,
    /// Parquet: pandas, Polars, DuckDB.
    Parquet,
    /// MATLAB v5: MATLAB, Octave, scipy.
    Mat,
    /// MCAP, messages in JSON with their schema: Foxglove, PlotJuggler.
    Mcap,
}

impl Format {
    /// The file's ending.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mat => "mat",
            Self::Mcap => "mcap",
        }
    }

    /// The table as a file's bytes.
    ///
    /// # Errors
    /// A sentence, where the format cannot hold it.
    pub fn bytes(self, table: &MeasuredTable) -> Result<Vec<u8>, String> {
        match self {
            Self::Csv => Ok(table.csv().into_bytes()),
            Self::Parquet => parquet::bytes(table).map_err(|error| error.to_string()),
            Self::Mat => mat::bytes(table),
            Self::Mcap => mcap::bytes(table).map_err(|error| error.to_string()),
        }
    }
}
