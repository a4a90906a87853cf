//! Shards of a sweep, made on several machines or in several jobs, put together into the sweep that one machine would have made.

use crate::error::SweepError;
use crate::journal::Journal;
use crate::manifest::Manifest;
use crate::plan::Plan;
use crate::publish::{MANIFEST, ROWS, keep_manifest, manifest};
use crate::row::Row;
use crate::rows::Rows;
use crate::shard::Shard;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What lies in the folders together.
#[derive(Debug)]
pub struct Gathered {
    /// The whole sweep.
    pub manifest: Manifest,
    /// Its runs.
    pub plan: Plan,
    /// Those that are there.
    pub rows: Rows,
}

/// Puts folders of shards, or of whole sweeps, together into the folder `out`: rows of all of them, in the order of the runs. What a
/// folder has twice must be the same. Rows that are missing can be made there.
///
/// # Errors
/// Folders of different sweeps, two rows of one run that differ, or a folder that cannot be read or written.
pub fn gather(folders: &[PathBuf], out: &Path) -> Result<Gathered, SweepError> {
    let mut whole: Option<Manifest> = None;
    for folder in folders {
        if is_same_folder(folder, out) {
            let folder = folder.display();
            return Err(SweepError::Refused(format!("{folder} cannot be gathered into itself")));
        }
        let own = manifest(folder)?.ok_or_else(|| {
            let folder = folder.display();
            SweepError::Refused(format!("{folder} is no folder of a sweep: it has no {MANIFEST}"))
        })?;
        match &whole {
            None => {
                whole = Some(Manifest {
                    shard: Shard::WHOLE,
                    ..own
                });
            }
            Some(first) => {
                if let Some(difference) = own.difference(first) {
                    return Err(SweepError::Another {
                        folder: folder.clone(),
                        difference,
                    });
                }
            }
        }
    }
    let manifest = whole.ok_or_else(|| SweepError::Refused("no folder is given".into()))?;
    let plan = manifest.plan()?;
    let mut rows = Rows::new(Shard::WHOLE, plan.runs());
    for folder in folders {
        read(folder, &mut rows)?;
    }
    keep_manifest(out, &manifest)?;
    keep_rows(out, &mut rows)?;
    Ok(Gathered { manifest, plan, rows })
}

fn is_same_folder(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}

fn read(folder: &Path, rows: &mut Rows) -> Result<(), SweepError> {
    let path = folder.join(ROWS);
    // A shard that was killed before its first row.
    if !path.exists() {
        return Ok(());
    }
    let file = rows.file(&path)?;
    let mut noted = Ok(());
    Journal::read(&path, |row: Row, at| {
        if noted.is_ok() {
            noted = rows.note(&row, file, at);
        }
    })?;
    noted
}

/// Adds what the folder does not have yet, so that the sweep can be gone on with there.
fn keep_rows(out: &Path, rows: &mut Rows) -> Result<(), SweepError> {
    let path = out.join(ROWS);
    let mut known = BTreeSet::new();
    let mut journal = Journal::open(&path, |row: Row, _| {
        known.insert(row.index);
    })?;
    read(out, rows)?;
    for row in rows.in_order() {
        let row = row?;
        if !known.contains(&row.index) {
            journal.append(&row)?;
        }
    }
    Ok(())
}
