//! The layout as messages. Rerun's blueprint API for Rust knows containers and views but not the properties of a view
//! (axis ranges, time windows, legends): those are logged into the same blueprint store by their paths.

use crate::RecorderError;
use crate::error::Writing as _;
use crate::views::{Layout, Property, arrange};
use rerun::blueprint::components::{PanelState, PlayState};
use rerun::blueprint::{Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, SelectionPanel, TimePanel};
use rerun::external::re_log_encoding::rrd::{Compression, EncodingOptions};
use rerun::external::re_log_encoding::{Encoder, ToTransport};
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::log::{Chunk, LogMsg, RowId};
use rerun::{RecordingStream, RecordingStreamBuilder, Timeline};
use std::path::Path;

/// The application's name: recordings and layouts of the same name belong together.
pub(crate) const APPLICATION: &str = "anhyst";
const WHAT: &str = "the layout";

/// A message as it stands in a file.
pub(crate) type Encoded = <LogMsg as ToTransport>::Output;

/// A layout ready to be sent, any number of times: each one that is made leaves the names of its views in memory.
pub(crate) struct Arranged {
    messages: Vec<LogMsg>,
    /// As they stand in a file.
    encoded: Vec<Encoded>,
    activation: BlueprintActivationCommand,
}

impl Layout {
    /// Makes the messages.
    pub fn arranged(&self) -> Result<Arranged, RecorderError> {
        let (mut messages, activation) = messages(APPLICATION, arrange(self))?;
        messages.push(activation.clone().into());
        let encoded = messages.iter().map(|message| message.to_transport(Compression::LZ4));
        Ok(Arranged {
            encoded: encoded.collect::<Result<_, _>>().writing(WHAT)?,
            messages,
            activation,
        })
    }
}

impl Arranged {
    /// Sends the layout into a recording and makes it the one shown.
    pub fn send(&self, stream: &RecordingStream) {
        stream.send_blueprint(self.messages.clone(), self.activation.clone());
    }

    /// Its messages, each with what stands in a file.
    pub fn messages(&self) -> impl Iterator<Item = (&LogMsg, &Encoded)> {
        self.messages.iter().zip(&self.encoded)
    }

    /// Writes the layout as a file of its own, for any recording of this application.
    pub fn save(&self, path: &Path) -> Result<(), RecorderError> {
        let file = std::fs::File::create(path).map_err(|error| RecorderError::Create {
            path: path.into(),
            cause: error.to_string(),
        })?;
        let version = rerun::build_info().version;
        let file = std::io::BufWriter::with_capacity(1 << 18, file);
        let mut encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, file).writing(WHAT)?;
        for encoded in &self.encoded {
            // SAFETY: nothing is done to memory that others do not allow; each message is compressed as the file says.
            unsafe { encoder.append_transport_without_footer(encoded) }.writing(WHAT)?;
        }
        encoder.flush_blocking().writing(WHAT)
    }
}

/// The messages of an arrangement for the recordings of an application.
pub(crate) fn messages(
    application: &'static str,
    (root, properties): (ContainerLike, Vec<Property>),
) -> Result<(Vec<LogMsg>, BlueprintActivationCommand), RecorderError> {
    let blueprint = Blueprint::new(root)
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(
            TimePanel::new()
                .with_state(PanelState::Collapsed)
                .with_timeline(crate::tokens::TIMELINE)
                // The cursor stays at the newest data: time windows and loops need a cursor that stands there.
                .with_play_state(PlayState::Following),
        );
    let (carrier, carried) = RecordingStreamBuilder::new(application)
        .enabled(true)
        .memory()
        .writing(WHAT)?;
    blueprint.send(&carrier, BlueprintActivation::default()).writing(WHAT)?;
    carrier.flush_blocking().writing(WHAT)?;
    let taken = carried.take();
    // The stream's sink holds the stream.
    carrier.disconnect();
    let mut messages: Vec<LogMsg> = Vec::new();
    let mut activation = None;
    for message in taken {
        match message {
            LogMsg::BlueprintActivationCommand(command) => activation = Some(command),
            message if message.store_id().is_blueprint() => messages.push(message),
            _ => {}
        }
    }
    let no_command = || RecorderError::Write {
        what: WHAT.into(),
        cause: "Rerun sent no activation".into(),
    };
    let activation = activation.ok_or_else(no_command)?;
    messages.extend(property_messages(&activation, properties)?);
    Ok((messages, activation))
}

fn property_messages(
    activation: &BlueprintActivationCommand,
    properties: Vec<Property>,
) -> Result<Vec<LogMsg>, RecorderError> {
    // Blueprints live on this timeline; without it the viewer finds nothing.
    let time = (Timeline::new_sequence("blueprint"), 0);
    let message = |property: Property| {
        let chunk = Chunk::builder(property.path).with_serialized_batches(RowId::new(), [time], property.batches);
        let arrow = chunk.build().writing(WHAT)?.to_arrow_msg().writing(WHAT)?;
        Ok(LogMsg::ArrowMsg(activation.blueprint_id.clone(), arrow))
    };
    properties.into_iter().map(message).collect()
}
