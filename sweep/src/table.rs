//! The table of a sweep, a row a run: `sweep.csv` and `sweep.parquet`.

use crate::error::SweepError;
use crate::plan::Plan;
use crate::row::Row;
use crate::variation::Kind;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that are held in memory and written together.
const GROUP: usize = 16_384;

/// What a column holds of the rows that are not written yet.
enum Column {
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
    Flags(Vec<bool>),
    Texts(Vec<ByteArray>),
}

/// Writes both tables, row by row.
pub struct Tables<'a, W: Write + Send> {
    plan: &'a Plan,
    csv: csv::Writer<W>,
    parquet: SerializedFileWriter<W>,
    columns: Vec<Column>,
    held: usize,
    paths: [PathBuf; 2],
}

/// Names and kinds of what is the same in every sweep, before and behind what varies.
const BEFORE: [(&str, Kind); 1] = [("index", Kind::Integer)];
const BEHIND: [(&str, Physical); 7] = [
    ("seed", Physical::INT64),
    ("held", Physical::BOOLEAN),
    ("error_rms_m", Physical::DOUBLE),
    ("error_max_m", Physical::DOUBLE),
    ("first_failure", Physical::BYTE_ARRAY),
    ("ticks", Physical::INT64),
    ("digest", Physical::BYTE_ARRAY),
];

impl<'a, W: Write + Send> Tables<'a, W> {
    /// Into two files, open under these names.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn new(plan: &'a Plan, csv: (W, &Path), parquet: (W, &Path)) -> Result<Self, SweepError> {
        let paths = [csv.1.to_owned(), parquet.1.to_owned()];
        let columns = columns(plan);
        let schema = schema(&columns).map_err(|error| refused(&paths[1], error))?;
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let writer = SerializedFileWriter::new(parquet.0, Arc::new(schema), Arc::new(properties));
        let mut tables = Self {
            plan,
            csv: csv::Writer::from_writer(csv.0),
            parquet: writer.map_err(|error| refused(&paths[1], error))?,
            columns: columns.iter().map(|(_, physical)| Column::of(*physical)).collect(),
            held: 0,
            paths,
        };
        let header: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        tables.record(&header)?;
        Ok(tables)
    }

    fn record(&mut self, cells: &[&str]) -> Result<(), SweepError> {
        let written = self.csv.write_record(cells);
        written.map_err(|error| SweepError::write(&self.paths[0])(error.into()))
    }

    /// Writes a row.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, row: &Row) -> Result<(), SweepError> {
        let plan = self.plan;
        let varied = plan.variations().iter().zip(plan.places(row.index));
        let varied: Vec<&str> = varied.map(|(own, place)| own.values[place].as_str()).collect();
        let behind = [
            row.seed.to_string(),
            row.held.to_string(),
            // As short as they are exact.
            format!("{:?}", row.error_rms_m),
            format!("{:?}", row.error_max_m),
            row.first_failure.clone(),
            row.ticks.to_string(),
            row.digest.clone(),
        ];
        let index = row.index.to_string();
        let cells: Vec<&str> = [index.as_str()]
            .into_iter()
            .chain(varied)
            .chain(behind.iter().map(String::as_str))
            .collect();
        for (column, cell) in self.columns.iter_mut().zip(&cells) {
            column.push(cell);
        }
        self.record(&cells)?;
        self.held += 1;
        if self.held == GROUP { self.write_group() } else { Ok(()) }
    }

    fn write_group(&mut self) -> Result<(), SweepError> {
        if self.held == 0 {
            return Ok(());
        }
        self.held = 0;
        let (parquet, columns) = (&mut self.parquet, &mut self.columns);
        let write = || -> Result<(), ParquetError> {
            let mut group = parquet.next_row_group()?;
            for column in columns {
                let Some(mut writer) = group.next_column()? else { break };
                column.write(writer.untyped())?;
                writer.close()?;
            }
            group.close().map(|_| ())
        };
        write().map_err(|error| refused(&self.paths[1], error))
    }

    /// Writes what is left, and hands the files back.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<[W; 2], SweepError> {
        self.write_group()?;
        let csv = self.csv.into_inner();
        let csv = csv.map_err(|error| SweepError::write(&self.paths[0])(error.into_error()))?;
        let parquet = self.parquet.into_inner();
        Ok([csv, parquet.map_err(|error| refused(&self.paths[1], error))?])
    }
}

impl Column {
    fn of(physical: Physical) -> Self {
        match physical {
            Physical::INT64 => Column::Integers(Vec::new()),
            Physical::DOUBLE => Column::Numbers(Vec::new()),
            Physical::BOOLEAN => Column::Flags(Vec::new()),
            _ => Column::Texts(Vec::new()),
        }
    }

    /// A cell as the other table has it: the two cannot differ.
    fn push(&mut self, cell: &str) {
        match self {
            Column::Integers(all) => all.push(cell.parse().unwrap_or_default()),
            Column::Numbers(all) => all.push(cell.parse().unwrap_or(f64::NAN)),
            Column::Flags(all) => all.push(cell == "true"),
            Column::Texts(all) => all.push(ByteArray::from(cell)),
        }
    }

    fn write(&mut self, writer: &mut ColumnWriter<'_>) -> Result<(), ParquetError> {
        match (self, writer) {
            (Column::Integers(all), ColumnWriter::Int64ColumnWriter(to)) => {
                to.write_batch(&std::mem::take(all), None, None)?
            }
            (Column::Numbers(all), ColumnWriter::DoubleColumnWriter(to)) => {
                to.write_batch(&std::mem::take(all), None, None)?
            }
            (Column::Flags(all), ColumnWriter::BoolColumnWriter(to)) => {
                to.write_batch(&std::mem::take(all), None, None)?
            }
            (Column::Texts(all), ColumnWriter::ByteArrayColumnWriter(to)) => {
                to.write_batch(&std::mem::take(all), None, None)?
            }
            _ => return Err(ParquetError::General("a column is not of its kind".into())),
        };
        Ok(())
    }
}

fn physical(kind: Kind) -> Physical {
    match kind {
        Kind::Integer => Physical::INT64,
        Kind::Number => Physical::DOUBLE,
        Kind::Text => Physical::BYTE_ARRAY,
    }
}

fn columns(plan: &Plan) -> Vec<(String, Physical)> {
    let before = BEFORE.map(|(name, kind)| (name.to_owned(), physical(kind)));
    let varied = plan.variations().iter();
    let varied = varied.map(|own| (own.path.clone(), physical(own.kind())));
    let behind = BEHIND.map(|(name, physical)| (name.to_owned(), physical));
    before.into_iter().chain(varied).chain(behind).collect()
}

fn schema(columns: &[(String, Physical)]) -> Result<Type, ParquetError> {
    let fields = columns.iter().map(|(name, physical)| {
        let text = (*physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
        let column = Type::primitive_type_builder(name, *physical)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(text);
        column.build().map(Arc::new)
    });
    let fields = fields.collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder("sweep").with_fields(fields).build()
}

fn refused(path: &Path, error: ParquetError) -> SweepError {
    let cause = match error {
        ParquetError::External(cause) => match cause.downcast::<std::io::Error>() {
            Ok(cause) => *cause,
            Err(cause) => std::io::Error::other(cause),
        },
        other => std::io::Error::other(other),
    };
    SweepError::write(path)(cause)
}
