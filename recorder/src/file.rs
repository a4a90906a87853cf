//! The file of a recording, written by the logger itself: Rerun's own file sink would queue hundreds of megabytes behind a slow
//! disk, tell of a full one only in its log, and take threads for every part.
//!
//! Chunks are compressed where that pays: not what is packed already, and not the plots, of which LZ4 takes a quarter away, at a price
//! that is higher than that of writing it. Rerun's own encoder compresses all or nothing, so that the footer is made here, too.

use crate::RecorderError;
use crate::error::Writing as _;
use crate::layout::{Arranged, Encoded};
use rerun::external::re_log_encoding::rrd::{Compression, EncodingOptions, RrdFooter, RrdManifestBuilder};
use rerun::external::re_log_encoding::{Encoder, ToTransport as _};
use rerun::external::re_log_types::ArrowMsg;
use rerun::log::{Chunk, LogMsg};
use rerun::sink::MemorySinkStorage;
use rerun::{RecordingStream, RecordingStreamBuilder, StoreId};
use std::collections::HashMap;
use std::fs::File as Disk;
use std::path::Path;

const WHAT: &str = "what was sent";

fn compressed(message: &LogMsg) -> Result<Encoded, RecorderError> {
    message.to_transport(Compression::LZ4).writing(WHAT)
}

/// One stream into one file after the other.
pub(crate) struct File {
    stream: RecordingStream,
    store: StoreId,
    waiting: MemorySinkStorage,
    /// What every file begins with: which recording it belongs to.
    head: Vec<LogMsg>,
    written: Written,
}

/// A file and what it has come to hold.
struct Written {
    encoder: Encoder<Disk>,
    manifests: HashMap<StoreId, RrdManifestBuilder>,
}

impl Written {
    fn create(path: &Path, head: &[LogMsg]) -> Result<Self, RecorderError> {
        let refuse = |cause: String| RecorderError::Create {
            path: path.into(),
            cause,
        };
        // A file that is emptied is written to the disk as soon as it is closed; a new one when the system has time.
        if std::fs::symlink_metadata(path).is_ok_and(|there| there.is_file()) {
            std::fs::remove_file(path).map_err(|error| refuse(error.to_string()))?;
        }
        let disk = Disk::create(path).map_err(|error| refuse(error.to_string()))?;
        let version = rerun::build_info().version;
        let encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, disk);
        let mut written = Self {
            encoder: encoder.map_err(|error| refuse(error.to_string()))?,
            manifests: HashMap::new(),
        };
        for message in head {
            written.append(message, &compressed(message)?)?;
        }
        Ok(written)
    }

    fn append(&mut self, message: &LogMsg, encoded: &Encoded) -> Result<(), RecorderError> {
        // SAFETY: nothing is done to memory that others do not allow; each message says by itself how it is compressed.
        let written = unsafe { self.encoder.append_transport_without_footer(encoded) };
        let (span, uncompressed) = written.writing(WHAT)?;
        if let LogMsg::ArrowMsg(store, arrow) = message {
            let batch = (&arrow.batch).try_into().writing(WHAT)?;
            let manifest = self.manifests.entry(store.clone()).or_default();
            manifest.append(&batch, span, uncompressed).writing(WHAT)?;
        }
        Ok(())
    }

    /// Appends a chunk as it is. The footer takes what the chunk says of itself, which need not be read again.
    fn append_chunk(&mut self, store: &StoreId, chunk: &Chunk) -> Result<(), RecorderError> {
        let batch = chunk.to_chunk_batch().writing(WHAT)?;
        let arrow = ArrowMsg {
            chunk_id: chunk.id().as_tuid(),
            batch: batch.clone().into(),
            on_release: None,
        };
        let message = LogMsg::ArrowMsg(store.clone(), arrow);
        let encoded = message.to_transport(Compression::Off).writing(WHAT)?;
        // SAFETY: as above.
        let written = unsafe { self.encoder.append_transport_without_footer(&encoded) };
        let (span, uncompressed) = written.writing(WHAT)?;
        let manifest = self.manifests.entry(store.clone()).or_default();
        manifest.append(&batch, span, uncompressed).writing(WHAT)
    }

    /// Writes the footer, by which viewers find chunks.
    fn finish(&mut self) -> Result<(), RecorderError> {
        let manifests = std::mem::take(&mut self.manifests).into_iter();
        let manifests = manifests.map(|(store, manifest)| Ok((store.clone(), manifest.build(store).writing(WHAT)?)));
        let footer = RrdFooter {
            manifests: manifests.collect::<Result<_, RecorderError>>()?,
        };
        // SAFETY: as above; it is of the chunks of this file.
        unsafe { self.encoder.finish_with_custom_footer(&footer) }.writing(WHAT)
    }
}

impl File {
    /// Creates the first file and the stream that goes into it.
    pub fn create(builder: RecordingStreamBuilder, path: &Path) -> Result<Self, RecorderError> {
        let refuse = |cause: String| RecorderError::Create {
            path: path.into(),
            cause,
        };
        let (stream, waiting) = builder.memory().map_err(|error| refuse(error.to_string()))?;
        let store = stream.store_info().map(|info| info.store_id.clone());
        let head = waiting.take();
        Ok(Self {
            written: Written::create(path, &head)?,
            store: store.ok_or_else(|| refuse("Rerun is turned off".into()))?,
            head,
            stream,
            waiting,
        })
    }

    /// What to log into.
    pub fn stream(&self) -> RecordingStream {
        self.stream.clone()
    }

    /// Writes what is not worth compressing.
    pub fn send(&mut self, chunk: &Chunk) -> Result<(), RecorderError> {
        self.written.append_chunk(&self.store, chunk)
    }

    /// Writes a layout, and what was logged before it.
    pub fn arrange(&mut self, layout: &Arranged) -> Result<(), RecorderError> {
        self.write()?;
        let mut messages = layout.messages();
        messages.try_for_each(|(message, encoded)| self.written.append(message, encoded))
    }

    /// Writes what was logged since.
    pub fn write(&mut self) -> Result<(), RecorderError> {
        let mut messages = self.waiting.take().into_iter();
        messages.try_for_each(|message| self.written.append(&message, &compressed(&message)?))
    }

    /// Closes the file and goes on in another one.
    pub fn go_on(&mut self, path: &Path) -> Result<(), RecorderError> {
        self.close()?;
        self.written = Written::create(path, &self.head)?;
        Ok(())
    }

    /// Writes what was logged since, and the footer.
    pub fn close(&mut self) -> Result<(), RecorderError> {
        self.write()?;
        self.written.finish()
    }
}

impl Drop for File {
    fn drop(&mut self) {
        // The stream's sink holds the stream.
        self.stream.disconnect();
    }
}
