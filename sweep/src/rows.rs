//! Where each finished row stands: eight bytes a run in memory, the rows themselves in their files.

use crate::error::SweepError;
use crate::journal::line_at;
use crate::row::Row;
use crate::shard::Shard;
use std::fs::File;
use std::path::{Path, PathBuf};

const MISSING: u64 = u64::MAX;
/// A place is the number of a file in the upper bits and a byte of it in the lower: files of up to 281 TB, 65 535 of them.
const BYTE_BITS: u32 = 48;

/// The rows of a shard, in one file or in several.
#[derive(Debug)]
pub struct Rows {
    shard: Shard,
    runs: u64,
    places: Vec<u64>,
    files: Vec<(PathBuf, File)>,
    found: u64,
}

impl Rows {
    /// None of the shard's rows, of so many runs of all shards.
    pub fn new(shard: Shard, runs: u64) -> Self {
        Self {
            shard,
            runs,
            places: vec![MISSING; shard.count(runs) as usize],
            files: Vec::new(),
            found: 0,
        }
    }

    /// A file in which rows stand; its number.
    ///
    /// # Errors
    /// If it cannot be opened, or is one too many.
    pub fn file(&mut self, path: &Path) -> Result<usize, SweepError> {
        let number = self.files.len();
        if number as u64 + 1 >= 1 << (u64::BITS - BYTE_BITS) {
            return Err(SweepError::Refused(format!(
                "{number} folders are as many as can be put together"
            )));
        }
        self.files
            .push((path.to_owned(), File::open(path).map_err(SweepError::read(path))?));
        Ok(number)
    }

    /// Notes a row of the shard; of a run that is there already it must be the same.
    ///
    /// # Errors
    /// A run that the shard does not have, or two rows of one run that differ.
    pub fn note(&mut self, row: &Row, file: usize, at: u64) -> Result<(), SweepError> {
        let index = row.index;
        let path = self.files[file].0.display();
        if index >= self.runs || !self.shard.has(index) {
            return Err(SweepError::Refused(format!(
                "{path} has run {index}, which is none of {} runs, shard {}",
                self.runs, self.shard
            )));
        }
        match self.row(index)? {
            None => {
                self.places[(index / self.shard.of) as usize] = (file as u64) << BYTE_BITS | at;
                self.found += 1;
            }
            Some(known) if known.is_same(row) => {}
            Some(known) => {
                return Err(SweepError::Refused(format!(
                    "{path} has run {index} with the digest {}, and before it was {}: made by other programs, or from other files",
                    row.digest, known.digest
                )));
            }
        }
        Ok(())
    }

    /// How many there are.
    pub fn found(&self) -> u64 {
        self.found
    }

    /// How many there should be.
    pub fn wanted(&self) -> u64 {
        self.places.len() as u64
    }

    /// The runs that have no row.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        let places = self.shard.indices(self.runs).zip(&self.places);
        places.filter(|(_, place)| **place == MISSING).map(|(index, _)| index)
    }

    /// The row of a run, if it is there.
    ///
    /// # Errors
    /// If it cannot be read again.
    pub fn row(&self, index: u64) -> Result<Option<Row>, SweepError> {
        let place = self.places.get((index / self.shard.of) as usize).copied();
        let Some(place) = place.filter(|place| *place != MISSING) else {
            return Ok(None);
        };
        let (path, file) = &self.files[(place >> BYTE_BITS) as usize];
        let row: Row = line_at(file, path, place & ((1 << BYTE_BITS) - 1))?;
        Ok(Some(row))
    }

    /// All that are there, in the order of their runs.
    ///
    /// # Errors
    /// If one cannot be read again.
    pub fn in_order(&self) -> impl Iterator<Item = Result<Row, SweepError>> {
        let indices = self.shard.indices(self.runs);
        indices.filter_map(|index| self.row(index).transpose())
    }
}
