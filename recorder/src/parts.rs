//! A long recording in parts: `recording.rrd`, `recording-2.rrd`, and so on, each of which can be viewed and read alone. Rerun keeps
//! an entry of each chunk in memory until a file is closed, so that parts also bound what a recording takes.
//!
//! A ring keeps only what surrounds events: a part that is over is removed, unless it, the one before or the one after has one; the
//! end of the run is one. So at least a part's length before each event and after it is kept, whatever ends the process.

use crate::error::Writing as _;
use crate::{RecorderError, RecorderSettings, RunInfo};
use std::path::{Path, PathBuf};

/// What is known of a part.
#[derive(Debug, Default)]
struct Part {
    path: PathBuf,
    rows: u64,
    event: bool,
}

/// The parts of a recording.
#[derive(Debug)]
pub(crate) struct Parts {
    current: Part,
    began_at: Option<u64>,
    /// The last two that are over, the older one first.
    over: [Option<Part>; 2],
    longest_ticks: u64,
    largest_bytes: u64,
    ring: bool,
    /// Parts that are there, but the current one.
    count: u64,
    /// Their bytes and rows.
    bytes: u64,
    removed_rows: u64,
}

/// What became of the parts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Kept {
    pub parts: u64,
    pub bytes: u64,
    pub removed_rows: u64,
}

impl Parts {
    pub fn new(run: &RunInfo, settings: &RecorderSettings) -> Self {
        let seconds = settings.ring_s.or(settings.part_s).unwrap_or(f64::INFINITY);
        Self {
            current: Part {
                path: run.path.clone(),
                ..Part::default()
            },
            began_at: None,
            over: [None, None],
            longest_ticks: ((seconds / run.tick_s).round() as u64).max(1),
            largest_bytes: (settings.part_mb * 1e6) as u64,
            ring: settings.ring_s.is_some(),
            count: 0,
            bytes: 0,
            removed_rows: 0,
        }
    }

    /// Takes note of a block that was written.
    pub fn note(&mut self, first_tick: u64, rows: usize, event: bool) {
        self.began_at.get_or_insert(first_tick);
        self.current.rows += rows as u64;
        self.current.event |= event;
    }

    /// True if what ends with `tick` is a whole part.
    pub fn is_over(&self, tick: u64) -> bool {
        self.began_at.is_some_and(|began_at| {
            tick + 1 - began_at >= self.longest_ticks || size(&self.current.path) >= self.largest_bytes
        })
    }

    /// Where the part after the current one goes.
    pub fn next_path(&self) -> PathBuf {
        next(&self.current.path)
    }

    /// Goes on to the next part; the current one was closed.
    pub fn turn(&mut self) -> Result<(), RecorderError> {
        let next = Part {
            path: self.next_path(),
            ..Part::default()
        };
        let over = std::mem::replace(&mut self.current, next);
        self.began_at = None;
        self.count += 1;
        self.bytes += size(&over.path);
        let [before, middle] = std::mem::take(&mut self.over);
        let around = [before.as_ref(), middle.as_ref(), Some(&over)];
        let quiet = around.into_iter().flatten().all(|part| !part.event);
        if let Some(middle) = middle.as_ref().filter(|_| self.ring && quiet) {
            self.count -= 1;
            self.bytes -= size(&middle.path);
            self.removed_rows += middle.rows;
            std::fs::remove_file(&middle.path).writing("what a ring leaves out")?;
        }
        self.over = [middle, Some(over)];
        Ok(())
    }

    /// What there is in the end, the current one, which is closed, among it.
    pub fn kept(&self) -> Kept {
        Kept {
            parts: self.count + 1,
            bytes: self.bytes + size(&self.current.path),
            removed_rows: self.removed_rows,
        }
    }
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |file| file.len())
}

/// `name.rrd` is followed by `name-2.rrd`, that one by `name-3.rrd`.
fn next(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = stem
        .rsplit_once('-')
        .and_then(|(name, number)| Some((name, number.parse::<u64>().ok()?)));
    let (name, number) = numbered.unwrap_or((&stem, 1));
    path.with_file_name(format!("{name}-{}.rrd", number + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the names, on which `view`, `replay` and `export` rely.
    #[test]
    fn parts_are_counted_from_two() {
        let named = |path: &str| next(Path::new(path)).to_string_lossy().into_owned();
        assert_eq!(named("runs/a-1/recording.rrd"), "runs/a-1/recording-2.rrd");
        assert_eq!(named("recording-9.rrd"), "recording-10.rrd");
    }

    /// Guards the ring: what lies beside an event stays, and nothing else but the end.
    #[test]
    fn a_ring_keeps_what_surrounds_events() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunInfo {
            path: folder.path().join("recording.rrd"),
            ..crate::run::tests::run()
        };
        let settings = RecorderSettings {
            ring_s: Some(0.1),
            ..RecorderSettings::default()
        };
        let mut parts = Parts::new(&run, &settings);
        for part in 0..12 {
            std::fs::write(&parts.current.path, "x").unwrap();
            for block in 0..2 {
                let first = part * 100 + block * 50;
                parts.note(first, 50, part == 5 && block == 1);
                assert_eq!(parts.is_over(first + 49), block == 1);
            }
            if part < 11 {
                parts.turn().unwrap();
            }
        }
        let there = |number: u64| match number {
            1 => run.path.exists(),
            _ => folder.path().join(format!("recording-{number}.rrd")).exists(),
        };
        let there: Vec<u64> = (1..=12).filter(|number| there(*number)).collect();
        assert_eq!(there, [5, 6, 7, 11, 12]);
        let kept = Kept {
            parts: 5,
            bytes: 5,
            removed_rows: 700,
        };
        assert_eq!(parts.kept(), kept);
    }
}
