//! Files that hold named channels instead of a table: who wrote them is told from the first bytes, what they hold is channels.
//!
//! A channel stands in a group, has a unit where the format has one, and its values as numbers. Channels that share a clock make a
//! [`table`]. What a reader refuses is a reason, to which the door adds the file and the format.
//!
//! Files come from anywhere, so every size is held against the bytes that are there before memory is asked for: deflate, the densest
//! of the codecs, makes at most [`MOST_EXPANSION`] bytes of one.

mod hdf5;
mod mat5;
mod mcap;
mod mdf4;
mod npy;
mod npz;
mod numbers;
pub(super) mod table;
mod tdms;
mod unwinding;

use std::path::Path;

use crate::error::MeasuredError;

/// The most numbers that are read from one file: 1.6 GB as they are held.
pub(super) const MOST_NUMBERS: u64 = 200_000_000;
/// Bytes that deflate makes of one at most (zlib's technical details: 1032).
pub(super) const MOST_EXPANSION: u64 = 1032;

/// Numbers under a name.
pub(crate) struct Channel {
    /// Names before the channel's own, with slashes; empty where the file has no groups.
    pub group: String,
    pub name: String,
    pub unit: Option<String>,
    pub values: Vec<f64>,
    /// Made from a rate that the file states, not stored in it.
    pub implied: bool,
}

impl Channel {
    /// As stored.
    pub fn stored(group: &str, name: &str, unit: Option<String>, values: Vec<f64>) -> Self {
        Channel {
            group: group.to_owned(),
            name: name.to_owned(),
            unit,
            values,
            implied: false,
        }
    }

    /// A uniform clock in seconds.
    pub fn clock(group: &str, start_s: f64, tick_s: f64, samples: usize) -> Self {
        let values = (0..samples).map(|sample| start_s + sample as f64 * tick_s).collect();
        Channel {
            implied: true,
            ..Channel::stored(group, "time_s", None, values)
        }
    }
}

/// The most channels that a matrix can be.
const MOST_COLUMNS: u64 = 1000;

/// An array as channels: a vector is one, a matrix has one along its longer side for each step of the shorter, and a single number,
/// or what has more dimensions, is none.
pub(super) fn channels_of(channel: Channel, shape: &[u64], by_column: bool) -> Vec<Channel> {
    let sides: Vec<u64> = shape.iter().copied().filter(|side| *side != 1).collect();
    let (rows, columns) = match sides[..] {
        [_] => return vec![channel],
        [rows, columns] => (rows, columns),
        _ => return Vec::new(),
    };
    let along_rows = rows < columns;
    let count = rows.min(columns);
    if count > MOST_COLUMNS || rows.checked_mul(columns) != Some(channel.values.len() as u64) {
        return Vec::new();
    }
    // Neighbours of a series stand side by side, or one step of the other side apart.
    let side_by_side = along_rows != by_column;
    let (rows, count) = (rows.max(columns) as usize, count as usize);
    let series = |index: usize| {
        let (begin, step) = if side_by_side {
            (index * rows, 1)
        } else {
            (index, count)
        };
        channel
            .values
            .iter()
            .skip(begin)
            .step_by(step)
            .take(rows)
            .copied()
            .collect()
    };
    let named = |index: usize| match channel.name.as_str() {
        "" => format!("column_{index}"),
        name => format!("{name}_{index}"),
    };
    (0..count)
        .map(|index| Channel::stored(&channel.group, &named(index), channel.unit.clone(), series(index)))
        .collect()
}

/// Why a file is refused, as the end of a sentence.
pub(super) type Reason = String;

/// A format.
pub(super) struct Format {
    pub name: &'static str,
    read: fn(&[u8]) -> Result<Vec<Channel>, Reason>,
}

const fn format(name: &'static str, read: fn(&[u8]) -> Result<Vec<Channel>, Reason>) -> Format {
    Format { name, read }
}

const HDF5: Format = format("HDF5", hdf5::read);
const MAT_73: Format = format("MATLAB 7.3", hdf5::read);

/// First bytes, and the format they open.
const FORMATS: &[(&[u8], Format)] = &[
    (b"\x89HDF\r\n\x1a\n", HDF5),
    (b"MATLAB 7.3", MAT_73),
    (b"MATLAB 5.0", format("MATLAB", mat5::read)),
    (b"\x93NUMPY", format("NumPy", npy::read)),
    (b"TDSm", format("TDMS", tdms::read)),
    (b"MDF     ", format("MDF4", mdf4::read)),
    (b"UnFinMF ", format("MDF4", mdf4::unfinished)),
    (b"\x89MCAP0\r\n", format("MCAP", mcap::read)),
];

/// A zip archive is NumPy's if it is called so, and an Excel workbook or anything else if not.
const ZIP: &[u8] = b"PK\x03\x04";
const NPZ: Format = format("NumPy", npz::read);

/// The format of a file; none if it is a table or a stranger.
pub(super) fn format_of(file: &Path, bytes: &[u8]) -> Option<&'static Format> {
    let named = |ending: &str| file.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    if bytes.starts_with(ZIP) && named("npz") {
        return Some(&NPZ);
    }
    let known = FORMATS.iter().find(|(magic, _)| bytes.starts_with(magic));
    known.map(|(_, format)| format)
}

impl Format {
    /// The channels of a file.
    pub fn channels(&self, file: &Path, bytes: &[u8]) -> Result<Vec<Channel>, MeasuredError> {
        let refuse = |reason: Reason| MeasuredError::NotReadable {
            file: file.to_owned(),
            format: self.name,
            reason: one_line(&reason),
        };
        let channels = unwinding::guarded(|| (self.read)(bytes)).map_err(refuse)?;
        if channels.iter().all(|channel| channel.values.len() < 2) {
            return Err(refuse("it holds no channel of numbers".into()));
        }
        Ok(channels)
    }
}

/// A reason made by others may have several lines, and no end.
fn one_line(reason: &str) -> String {
    const MOST: usize = 240;
    let printable = |letter: char| if letter.is_control() { ' ' } else { letter };
    let mut line: String = reason.chars().map(printable).take(MOST).collect();
    if reason.chars().nth(MOST).is_some() {
        line.push('…');
    }
    line
}

/// Counts what was read against what may be.
#[derive(Default)]
pub(super) struct Budget {
    numbers: u64,
}

impl Budget {
    /// Refuses more numbers than are held.
    pub fn take(&mut self, name: &str, numbers: u64) -> Result<usize, Reason> {
        self.numbers = self.numbers.saturating_add(numbers);
        if self.numbers > MOST_NUMBERS {
            return Err(format!(
                "with \"{name}\" it holds {} numbers, at most {MOST_NUMBERS} are read. Cut it, or decimate it",
                self.numbers
            ));
        }
        Ok(numbers as usize)
    }
}

#[cfg(test)]
mod tests {
    //! Guards the way round of matrices: taken the other way, channels are mixed sample by sample.
    use super::*;

    #[test]
    fn a_matrix_is_cut_along_its_longer_side() {
        // Two channels of three samples: 1 2 3 and 10 20 30.
        let by_channel = [1.0, 2.0, 3.0, 10.0, 20.0, 30.0];
        let by_sample = [1.0, 10.0, 2.0, 20.0, 3.0, 30.0];
        for (values, shape, by_column) in [
            (by_channel, [2, 3], false),
            (by_channel, [3, 2], true),
            (by_sample, [3, 2], false),
            (by_sample, [2, 3], true),
        ] {
            let matrix = Channel::stored("", "x", None, values.to_vec());
            let channels = channels_of(matrix, &shape, by_column);
            let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
            assert_eq!(names, ["x_0", "x_1"]);
            assert_eq!(channels[0].values, [1.0, 2.0, 3.0], "{shape:?} {by_column}");
            assert_eq!(channels[1].values, [10.0, 20.0, 30.0]);
        }
    }
}
