//! The folder of a sweep: `sweep.json`, `rows.jsonl`, and when all runs are there `sweep.csv`, `sweep.parquet`, `sweep.html`.
//!
//! A result is written beside its name and moved there: whoever finds it finds it whole.

use crate::error::SweepError;
use crate::manifest::Manifest;
use crate::page::{Findings, page};
use crate::plan::Plan;
use crate::rows::Rows;
use crate::table::Tables;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What the sweep is.
pub const MANIFEST: &str = "sweep.json";
/// The finished runs.
pub const ROWS: &str = "rows.jsonl";
const CSV: &str = "sweep.csv";
const PARQUET: &str = "sweep.parquet";
const PAGE: &str = "sweep.html";

/// A folder's sweep; none if it has none.
///
/// # Errors
/// If it cannot be read, or is none of ours.
pub fn manifest(folder: &Path) -> Result<Option<Manifest>, SweepError> {
    let path = folder.join(MANIFEST);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(SweepError::read(&path)(error)),
    };
    let read = serde_json::from_str(&text);
    let manifest: Manifest = read.map_err(|error| SweepError::Line {
        path,
        line: error.line() as u64,
        sentence: format!("{error}: this is no sweep of this program"),
    })?;
    Ok(Some(manifest))
}

/// Writes what the sweep is into its folder, or sees that the folder has the same already.
///
/// # Errors
/// A folder of another sweep or shard, or one that cannot be written.
pub fn keep_manifest(folder: &Path, asked: &Manifest) -> Result<(), SweepError> {
    let another = |difference: String| SweepError::Another {
        folder: folder.to_owned(),
        difference,
    };
    let Some(there) = manifest(folder)? else {
        let rows = folder.join(ROWS);
        if rows.exists() {
            let (rows, lacking) = (rows.display(), MANIFEST);
            return Err(another(format!(
                "{rows} is there without {lacking}, which says what its rows are"
            )));
        }
        return written(folder, MANIFEST, |file| {
            serde_json::to_writer_pretty(&mut *file, asked)?;
            file.write_all(b"\n")
        });
    };
    if let Some(difference) = there.difference(asked) {
        return Err(another(difference));
    }
    if there.shard != asked.shard {
        return Err(another(format!(
            "shard {} is there, and {} is asked for",
            there.shard, asked.shard
        )));
    }
    Ok(())
}

/// Writes tables and page of a sweep whose runs are all there. What they came to, for people.
///
/// # Errors
/// If a row cannot be read or a result not be written.
pub fn publish(folder: &Path, manifest: &Manifest, plan: &Plan, rows: &Rows) -> Result<Findings, SweepError> {
    let (csv, parquet) = (beside(folder, CSV), beside(folder, PARQUET));
    let open = |path: &Path| File::create(path).map(BufWriter::new).map_err(SweepError::write(path));
    let mut tables = Tables::new(plan, (open(&csv)?, &csv), (open(&parquet)?, &parquet))?;
    let mut findings = Findings::new(plan);
    for row in rows.in_order() {
        let row = row?;
        tables.write(&row)?;
        findings.push(plan, &row);
    }
    for (mut file, name) in tables.finish()?.into_iter().zip([CSV, PARQUET]) {
        file.flush().map_err(SweepError::write(&folder.join(name)))?;
        moved(folder, name)?;
    }
    let html = page(manifest, plan, &findings).html();
    written(folder, PAGE, |file| file.write_all(html.as_bytes()))?;
    Ok(findings)
}

fn beside(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!(".{name}.new"))
}

fn moved(folder: &Path, name: &str) -> Result<(), SweepError> {
    let to = folder.join(name);
    std::fs::rename(beside(folder, name), &to).map_err(SweepError::write(&to))
}

fn written(
    folder: &Path,
    name: &str,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> Result<(), SweepError> {
    let path = beside(folder, name);
    let file = File::create(&path).map(BufWriter::new);
    let outcome = file.and_then(|mut file| write(&mut file).and_then(|()| file.flush()));
    outcome.map_err(SweepError::write(&path))?;
    moved(folder, name)
}
