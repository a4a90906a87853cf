//! The file of a recording, written by the logger itself: Rerun's own file sink would queue hundreds of megabytes behind a slow
//! disk, tell of a full one only in its log, and take threads for every part.

use crate::RecorderError;
use crate::error::Writing as _;
use rerun::external::re_log_encoding::Encoder;
use rerun::external::re_log_encoding::rrd::EncodingOptions;
use rerun::log::LogMsg;
use rerun::sink::MemorySinkStorage;
use rerun::{RecordingStream, RecordingStreamBuilder};
use std::fs::File as Disk;
use std::path::Path;

/// One stream into one file after the other.
pub(crate) struct File {
    stream: RecordingStream,
    waiting: MemorySinkStorage,
    /// What every file begins with: which recording it belongs to.
    head: Vec<LogMsg>,
    encoder: Encoder<Disk>,
}

fn create(path: &Path, head: &[LogMsg]) -> Result<Encoder<Disk>, RecorderError> {
    let refuse = |cause: String| RecorderError::Create {
        path: path.into(),
        cause,
    };
    let disk = Disk::create(path).map_err(|error| refuse(error.to_string()))?;
    let version = rerun::build_info().version;
    let mut encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, disk)
        .map_err(|error| refuse(error.to_string()))?;
    encoder
        .extend(head.iter().map(Ok))
        .map_err(|error| refuse(error.to_string()))?;
    Ok(encoder)
}

impl File {
    /// Creates the first file and the stream that goes into it.
    pub fn create(builder: RecordingStreamBuilder, path: &Path) -> Result<Self, RecorderError> {
        let (stream, waiting) = builder.memory().map_err(|error| RecorderError::Create {
            path: path.into(),
            cause: error.to_string(),
        })?;
        let head = waiting.take();
        Ok(Self {
            encoder: create(path, &head)?,
            head,
            stream,
            waiting,
        })
    }

    /// What to log into.
    pub fn stream(&self) -> RecordingStream {
        self.stream.clone()
    }

    /// Writes what was logged since.
    pub fn write(&mut self) -> Result<(), RecorderError> {
        let messages = self.waiting.take().into_iter().map(Ok);
        self.encoder.extend(messages).writing("what was sent").map(drop)
    }

    /// Closes the file and goes on in another one.
    pub fn go_on(&mut self, path: &Path) -> Result<(), RecorderError> {
        self.close()?;
        self.encoder = create(path, &self.head)?;
        Ok(())
    }

    /// Writes what was logged since, and the footer.
    pub fn close(&mut self) -> Result<(), RecorderError> {
        self.write()?;
        self.encoder.finish().writing("the end of a file")
    }
}

impl Drop for File {
    fn drop(&mut self) {
        // The stream's sink holds the stream.
        self.stream.disconnect();
    }
}
