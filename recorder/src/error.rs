use std::path::PathBuf;

/// Why a run could not be recorded, read or shown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecorderError {
    /// A setting cannot be used.
    #[error("recorder setting {0}")]
    Setting(#[from] anhyst_ipc::Invalid),
    /// The recording could not be created.
    #[error("cannot create the recording {}: {cause}", path.display())]
    Create {
        /// Where.
        path: PathBuf,
        /// What the system said.
        cause: String,
    },
    /// The port for live viewers is not free.
    #[error("cannot serve live viewers on 127.0.0.1:{port}: {cause}")]
    Live {
        /// Which port.
        port: u16,
        /// What the system said.
        cause: String,
    },
    /// Something could not be added to the recording.
    #[error("cannot record {what}: {cause}")]
    Write {
        /// What was written.
        what: String,
        /// What Rerun said.
        cause: String,
    },
    /// The logger thread ended early; what it had written before is in the file.
    #[error("the logger thread ended early; the recording holds what it had written before")]
    LoggerDied,
    /// The outcome was asked for while the recorder still runs.
    #[error("the recording is still open")]
    StillOpen,
    /// A recording could not be read.
    #[error("cannot read the recording {}: {cause}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: String,
    },
    /// A file holds no tokens of a channel.
    #[error("{} holds no tokens of {channel}: it is no recording of a run, or the run died before its first block", path.display())]
    NoTokens {
        /// Which file.
        path: PathBuf,
        /// Which channel.
        channel: anhyst_ipc::Channel,
    },
    /// The fields recorded are not the fields of this version's message.
    #[error("{} was recorded with other fields of {channel}: {recorded:?} instead of {expected:?}", path.display())]
    OtherFields {
        /// Which file.
        path: PathBuf,
        /// Which channel.
        channel: anhyst_ipc::Channel,
        /// Fields in the file.
        recorded: Vec<String>,
        /// Fields of the message.
        expected: Vec<String>,
    },
    /// There is no viewer.
    #[error(
        "no Rerun viewer found ({looked}); install one with `pip install rerun-sdk==0.36.3` \
         or `cargo install rerun-cli --version 0.36.3 --locked`"
    )]
    NoViewer {
        /// Where it was looked for.
        looked: String,
    },
    /// The viewer did not run to its end.
    #[error("the viewer {} failed: {cause}; this recording needs Rerun 0.36 or newer", viewer.display())]
    Viewer {
        /// Which executable.
        viewer: PathBuf,
        /// How it ended.
        cause: String,
    },
}

/// Turns Rerun's many error types into one, naming what was written.
pub(crate) trait Writing<T> {
    fn writing(self, what: &str) -> Result<T, RecorderError>;
}

impl<T, E: std::fmt::Display> Writing<T> for Result<T, E> {
    fn writing(self, what: &str) -> Result<T, RecorderError> {
        self.map_err(|error| RecorderError::Write {
            what: what.into(),
            cause: error.to_string(),
        })
    }
}
