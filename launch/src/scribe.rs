//! The recorder's node: judges every tick and, if the scenario wants it, hands every token to the recording.

use crate::judge::Judge;
use crate::overheard::Overheard;
use crate::verdict::Verdict;
use anhyst_ipc::{Block, Change, Everything, Latency, NodeId, Now};
use std::path::{Path, PathBuf};

#[cfg(feature = "recorder")]
use anhyst_recorder::{Level, Recorder};

/// How often the judge is written down.
const NOTED_TICKS: u64 = 500;

/// Judge and recorder as one block, so that both hear the same tokens.
pub struct Scribe {
    judge: Judge,
    /// From sending the measurement to sending the coil's field of the same tick.
    round: Latency,
    overheard: Vec<Overheard>,
    /// Where the judge is written down now and then, for one that takes the place of this.
    notes: Option<PathBuf>,
    #[cfg(feature = "recorder")]
    recorder: Option<Recorder>,
}

impl Scribe {
    /// A scribe that only judges.
    pub fn new(judge: Judge) -> Self {
        Self {
            judge,
            round: Latency::new(),
            overheard: Vec::new(),
            notes: None,
            #[cfg(feature = "recorder")]
            recorder: None,
        }
    }

    /// A scribe that also notes what foreign nodes send.
    pub fn with_overheard(self, overheard: Vec<Overheard>) -> Self {
        Self { overheard, ..self }
    }

    /// A scribe that writes its judge down at `path` now and then; `again` if it goes on with what one that died has written.
    pub fn with_notes(mut self, path: PathBuf, again: bool) -> Self {
        let noted = std::fs::read(&path).ok().filter(|_| again);
        if let Some(judge) = noted.and_then(|text| serde_json::from_slice(&text).ok()) {
            self.judge = self.judge.going_on(judge);
        }
        Self {
            notes: Some(path),
            ..self
        }
    }

    /// In two steps, so that whoever is killed in between leaves the notes before.
    fn note(&self, path: &Path) -> std::io::Result<()> {
        let new = path.with_extension("new.json");
        std::fs::write(&new, serde_json::to_vec(&self.judge)?)?;
        std::fs::rename(new, path)
    }

    /// What it noted of foreign nodes.
    pub fn overheard(&self) -> &[Overheard] {
        &self.overheard
    }

    /// A scribe that also records.
    #[cfg(feature = "recorder")]
    pub fn with_recorder(self, recorder: Recorder) -> Self {
        Self {
            recorder: Some(recorder),
            ..self
        }
    }

    /// Rounds of the loop between processes; empty within one.
    pub fn round(&self) -> &Latency {
        &self.round
    }

    /// The verdict so far.
    pub fn verdict(&self) -> Verdict {
        self.judge.verdict()
    }

    /// Takes the recorder out, told what the run came to, to finish the recording; `failure` is why it did not come to its end.
    #[cfg(feature = "recorder")]
    pub fn take_recorder(&mut self, failure: Option<&str>) -> Option<Recorder> {
        let mut recorder = self.recorder.take()?;
        let (level, sentence) = match (failure, self.judge.sentence()) {
            (Some(failure), _) => (
                Level::Error,
                format!("NOT held: the run did not come to its end: {failure}"),
            ),
            (None, (sentence, failures)) if failures.is_empty() => (Level::Info, sentence),
            (None, (sentence, _)) => (Level::Error, sentence),
        };
        recorder.conclude(level, sentence);
        Some(recorder)
    }
}

impl Block for Scribe {
    const NODE: NodeId = NodeId::Recorder;
    type Inputs = Everything;
    type Outputs = ();

    fn change(&mut self, change: &Change) -> bool {
        self.judge.change(change)
    }

    fn step(&mut self, tick: u64, inputs: Everything) {
        let (Now(measured), Now(truth), Now(estimate), Now(demand), _, Now(field), Now(coil)) = &inputs;
        if coil.tick == tick && measured.tick == tick && coil.sent_ns > measured.sent_ns && measured.sent_ns > 0 {
            self.round.record(coil.sent_ns - measured.sent_ns);
        }
        self.judge
            .observe(tick, (measured, truth), estimate, demand, (field, coil));
        for overheard in &mut self.overheard {
            overheard.hear(tick, &inputs);
        }
        if let Some(path) = self.notes.as_ref().filter(|_| tick % NOTED_TICKS == NOTED_TICKS - 1) {
            // A full disk costs the notes, not the run: the recording will say so.
            let _ = self.note(path);
        }
        #[cfg(feature = "recorder")]
        if let Some(recorder) = &mut self.recorder {
            recorder.hear(tick, &inputs);
        }
    }
}
