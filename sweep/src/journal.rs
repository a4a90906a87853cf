//! Finished work, a line of JSON each: appended and never changed, so whoever is killed at any instant loses what was under way.
//!
//! A line is written at once. Where that was cut short the file ends without a line's end; what stands there is dropped.

use crate::error::SweepError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// A file that is appended to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Where the next line begins, bytes.
    end: u64,
}

impl Journal {
    /// Opens or makes the file, hands over what it holds with the byte at which it stands, and drops a torn end.
    ///
    /// # Errors
    /// A file that cannot be had, or a whole line that is no `T`.
    pub fn open<T: DeserializeOwned>(path: &Path, found: impl FnMut(T, u64)) -> Result<Self, SweepError> {
        let mut options = OpenOptions::new();
        let opened = options.create(true).append(true).read(true).open(path);
        let file = opened.map_err(SweepError::write(path))?;
        let end = lines(&file, path, found)?;
        file.set_len(end).map_err(SweepError::write(path))?;
        let path = path.to_owned();
        Ok(Self { path, file, end })
    }

    /// Writes a line; the byte at which it stands.
    ///
    /// # Errors
    /// If it cannot be written; the file then is as before.
    pub fn append<T: Serialize>(&mut self, item: &T) -> Result<u64, SweepError> {
        let begin = self.end;
        let line = serde_json::to_string(item)
            .map_err(std::io::Error::from)
            .map(|line| line + "\n");
        let written = line.and_then(|line| self.file.write_all(line.as_bytes()).map(|()| line.len() as u64));
        match written {
            Ok(length) => self.end += length,
            Err(cause) => {
                // What fits onto a full disk is half a line.
                let _ = self.file.set_len(begin);
                return Err(SweepError::write(&self.path)(cause));
            }
        }
        Ok(begin)
    }

    /// Reads a file without changing it; none is an empty one.
    ///
    /// # Errors
    /// A file that cannot be read, or a whole line that is no `T`.
    pub fn read<T: DeserializeOwned>(path: &Path, found: impl FnMut(T, u64)) -> Result<(), SweepError> {
        match File::open(path) {
            Ok(file) => lines(&file, path, found).map(|_| ()),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            Err(error) => Err(SweepError::read(path)(error)),
        }
    }
}

/// Hands over the whole lines; where the last of them ends.
fn lines<T: DeserializeOwned>(file: &File, path: &Path, mut found: impl FnMut(T, u64)) -> Result<u64, SweepError> {
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (mut end, mut number, mut line) = (0, 0, Vec::new());
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(SweepError::read(path))?;
        if line.last() != Some(&b'\n') {
            return Ok(end);
        }
        number += 1;
        let item = serde_json::from_slice(&line).map_err(|error| SweepError::Line {
            path: path.to_owned(),
            line: number,
            sentence: format!("{error}: this is no line that a sweep wrote; without it, it is worked out again"),
        })?;
        found(item, end);
        end += length as u64;
    }
}

/// The line at a byte that [`Journal`] has told.
///
/// # Errors
/// If it is not there any more.
pub fn line_at<T: DeserializeOwned>(file: &File, path: &Path, at: u64) -> Result<T, SweepError> {
    let mut line = vec![0; 512];
    let mut filled = 0;
    loop {
        let length = file
            .read_at(&mut line[filled..], at + filled as u64)
            .map_err(SweepError::read(path))?;
        let end = line[filled..filled + length].iter().position(|byte| *byte == b'\n');
        if let Some(end) = end {
            let read = serde_json::from_slice(&line[..filled + end]);
            return read.map_err(|error| SweepError::read(path)(error.into()));
        }
        if length == 0 {
            return Err(SweepError::read(path)(ErrorKind::UnexpectedEof.into()));
        }
        filled += length;
        line.resize(2 * line.len(), 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(path: &Path) -> Vec<(String, u64)> {
        let mut held = Vec::new();
        Journal::read(path, |item, at| held.push((item, at))).unwrap();
        held
    }

    /// Guards against a kill in the middle of a line: at every byte, what was whole stays, and the next line is whole again.
    #[test]
    fn a_torn_end_is_dropped_wherever_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.jsonl");
        let mut journal = Journal::open(&path, |_: String, _| ()).unwrap();
        let texts = ["one", "ö\n2", "three"];
        for text in texts {
            journal.append(&text).unwrap();
        }
        let whole = std::fs::read(&path).unwrap();
        for length in 0..=whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let finished = whole[..length].iter().filter(|byte| **byte == b'\n').count();
            let mut journal = Journal::open(&path, |_: String, _| ()).unwrap();
            assert_eq!(held(&path).len(), finished);
            let at = journal.append(&"next").unwrap();
            let held = held(&path);
            assert_eq!(held[finished], ("next".to_owned(), at));
            let file = File::open(&path).unwrap();
            for (text, at) in held {
                assert_eq!(line_at::<String>(&file, &path, at).unwrap(), text);
            }
        }
    }

    #[test]
    fn a_line_of_somebody_else_is_refused_by_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.jsonl");
        std::fs::write(&path, "\"one\"\n{\"x\":1}\n\"three\"\n").unwrap();
        let refused = Journal::open(&path, |_: String, _| ()).unwrap_err().to_string();
        assert!(refused.contains("rows.jsonl:2:"), "{refused}");
        let long = "x".repeat(5000);
        std::fs::write(&path, format!("\"{long}\"\n")).unwrap();
        let file = File::open(&path).unwrap();
        assert_eq!(line_at::<String>(&file, &path, 0).unwrap(), long);
    }
}
