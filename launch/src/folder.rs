//! The folder of a run: what lies where.

use crate::claim::{Claimed, claimed};
use crate::error::RunError;
use std::path::{Path, PathBuf};

/// Paths within a run's folder; whoever created it has it for itself.
#[derive(Debug)]
pub struct RunFolder(
    PathBuf,
    #[expect(dead_code, reason = "held for its lock")] Option<Claimed>,
);

impl RunFolder {
    /// Creates the folder, `wanted` or a new one under `runs/`, takes an earlier run's results out of it, and keeps others out
    /// for as long as this lives.
    ///
    /// # Errors
    /// If the folder cannot be created, or another run is writing to it.
    pub fn create(wanted: Option<&Path>, name: &str) -> Result<Self, RunError> {
        let claimed = claimed(wanted, name)?;
        let path = claimed.path.clone();
        let refuse = |cause| RunError::Write {
            path: path.clone(),
            cause,
        };
        let folder = Self(path.clone(), Some(claimed));
        folder.empty().map_err(refuse)?;
        Ok(folder)
    }

    /// What was exported of an earlier run is not this one's; it may be somebody's only copy.
    fn set_exports_aside(&self) -> std::io::Result<()> {
        for ending in ["csv", "parquet", "mat", "mcap"] {
            let [from, to] = ["run", "earlier-run"].map(|name| self.0.join(name).with_extension(ending));
            if from.is_file() {
                std::fs::rename(from, to)?;
            }
        }
        Ok(())
    }

    /// Makes the folders within it, without what an earlier run left there.
    fn empty(&self) -> std::io::Result<()> {
        self.make_result_folders()?;
        // An earlier run's results in the same folder would be taken for this one's.
        let recordings = self.recordings();
        let layouts = recordings.iter().map(|recording| recording.with_extension("rbl"));
        if self.summary().exists() {
            self.set_exports_aside()?;
        }
        for stale in [self.summary(), self.digest(), self.page()]
            .into_iter()
            .chain(layouts)
            .chain(recordings.iter().cloned())
        {
            match std::fs::remove_file(stale) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        for (results, ours) in [
            ("processes", &["json", "log"][..]),
            ("digests", &["u64"]),
            ("tokens", &["bin"]),
        ] {
            if !self.0.join(results).is_dir() {
                continue;
            }
            for entry in std::fs::read_dir(self.0.join(results))? {
                let path = entry?.path();
                if path
                    .extension()
                    .is_some_and(|extension| ours.iter().any(|known| extension == *known))
                {
                    std::fs::remove_file(path)?;
                }
            }
        }
        Ok(())
    }

    /// Makes the folders within it that processes write to.
    ///
    /// # Errors
    /// If they cannot be created.
    pub fn make_result_folders(&self) -> std::io::Result<()> {
        std::fs::create_dir_all(self.0.join("processes"))?;
        std::fs::create_dir_all(self.0.join("digests"))
    }

    /// A folder that exists already.
    pub fn open(path: &Path) -> Self {
        Self(path.to_owned(), None)
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The effective scenario.
    pub fn scenario(&self) -> PathBuf {
        self.0.join("scenario.ron")
    }

    /// What its learner has learned. An earlier run's stays until this one ends: it may begin with it.
    pub fn learned(&self) -> PathBuf {
        self.0.join("learned.json")
    }

    /// What its learner began with.
    pub fn began_with(&self) -> PathBuf {
        self.0.join("began_with.json")
    }

    /// The machine-readable summary.
    pub fn summary(&self) -> PathBuf {
        self.0.join("summary.json")
    }

    /// The page of the run.
    pub fn page(&self) -> PathBuf {
        self.0.join("report.html")
    }

    /// The Rerun recording.
    pub fn recording(&self) -> PathBuf {
        self.0.join("recording.rrd")
    }

    /// Where a recorder goes on that takes the place of a dead one: after the last part that there is.
    pub fn next_recording(&self) -> PathBuf {
        let last = self.parts().last().map_or(1, |(number, _)| *number);
        self.0.join(format!("recording-{}.rrd", last + 1))
    }

    /// The parts that there are by their numbers: `recording.rrd`, `recording-2.rrd`, and so on. A ring leaves some out.
    fn parts(&self) -> Vec<(u64, PathBuf)> {
        let entries = std::fs::read_dir(&self.0).into_iter().flatten().flatten();
        let mut parts: Vec<_> = entries
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let number = name.strip_prefix("recording")?.strip_suffix(".rrd")?;
                let number = match number {
                    "" => 1,
                    later => later.strip_prefix('-')?.parse().ok()?,
                };
                Some((number, entry.path()))
            })
            .collect();
        parts.sort();
        parts
    }

    /// All parts of the recording in the order of time; of a run without one the name that it would have.
    pub fn recordings(&self) -> Vec<PathBuf> {
        let mut parts: Vec<PathBuf> = self.parts().into_iter().map(|(_, path)| path).collect();
        if parts.is_empty() {
            parts.push(self.recording());
        }
        parts
    }

    /// The token digest, one line a node and one for the run.
    pub fn digest(&self) -> PathBuf {
        self.0.join("digest.txt")
    }

    /// A process's report.
    pub fn report(&self, process: &str) -> PathBuf {
        self.0.join("processes").join(format!("{process}.json"))
    }

    /// Where the processes of the run meet while it goes on, see [`crate::tuning`].
    pub fn meeting(&self) -> PathBuf {
        self.0.join("processes").join("meeting.json")
    }

    /// What the judge of a real-time run has seen so far.
    pub fn judged(&self) -> PathBuf {
        self.0.join("processes").join("judged.json")
    }

    /// What the bridge measured of the link to the other host.
    pub fn link(&self) -> PathBuf {
        self.0.join("processes").join("bridge.txt")
    }

    /// The name of the process that died, from a launcher to its bridge.
    pub fn died(&self) -> PathBuf {
        self.0.join("processes").join("died.log")
    }

    /// What a process wrote to its standard error.
    pub fn log(&self, process: &str) -> PathBuf {
        self.0.join("processes").join(format!("{process}.log"))
    }

    /// What a node consumed and sent in every tick of a real-time run.
    pub fn tokens(&self, node: &str) -> PathBuf {
        self.0.join("tokens").join(format!("{node}.bin"))
    }

    /// A node's digest after every tick.
    pub fn digest_history(&self, node: &str) -> PathBuf {
        self.0.join("digests").join(format!("{node}.u64"))
    }
}

#[cfg(test)]
mod tests {
    use super::RunFolder;

    /// Guards against an export of an earlier run beside this one's recording, and against the loss of a table that is none.
    #[test]
    fn what_was_exported_of_an_earlier_run_is_set_aside() {
        let root = tempfile::tempdir().unwrap();
        let names = ["run.csv", "earlier-run.csv", "notes.csv"];
        let left = || names.map(|name| std::fs::read_to_string(root.path().join(name)).unwrap_or_default());
        for name in ["run.csv", "notes.csv"] {
            std::fs::write(root.path().join(name), name).unwrap();
        }
        drop(RunFolder::create(Some(root.path()), "any").unwrap());
        assert_eq!(left(), ["run.csv", "", "notes.csv"]);
        std::fs::write(root.path().join("summary.json"), "{}").unwrap();
        drop(RunFolder::create(Some(root.path()), "any").unwrap());
        assert_eq!(left(), ["", "run.csv", "notes.csv"]);
    }
}
