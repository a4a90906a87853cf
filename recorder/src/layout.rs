//! The layout as messages. Rerun's blueprint API for Rust knows containers and views but not the properties of a view
//! (axis ranges, time windows, legends): those are logged into the same blueprint store by their paths.

use crate::RecorderError;
use crate::error::Writing as _;
use crate::streams::APPLICATION;
use crate::views::{Layout, Property, arrange};
use rerun::blueprint::components::{PanelState, PlayState};
use rerun::blueprint::{Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, SelectionPanel, TimePanel};
use rerun::external::re_log_encoding::Encoder;
use rerun::external::re_log_encoding::rrd::EncodingOptions;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::log::LogMsg;
use rerun::{RecordingStream, RecordingStreamBuilder};
use std::path::Path;

/// A layout ready to be sent, any number of times: each one that is made leaves the names of its views in memory.
pub(crate) struct Arranged {
    messages: Vec<LogMsg>,
    activation: BlueprintActivationCommand,
}

impl Layout {
    /// Makes the messages.
    pub fn arranged(&self) -> Result<Arranged, RecorderError> {
        let (messages, activation) = messages(APPLICATION, arrange(self))?;
        Ok(Arranged { messages, activation })
    }
}

impl Arranged {
    /// Sends the layout into a recording and makes it the one shown.
    pub fn send(&self, stream: &RecordingStream) {
        stream.send_blueprint(self.messages.clone(), self.activation.clone());
    }

    /// Writes the layout as a file of its own, for any recording of this application.
    pub fn save(self, path: &Path) -> Result<(), RecorderError> {
        let mut messages = self.messages;
        messages.push(self.activation.into());
        let mut file = std::fs::File::create(path).map_err(|error| RecorderError::Create {
            path: path.into(),
            cause: error.to_string(),
        })?;
        Encoder::encode_into(
            rerun::build_info().version,
            EncodingOptions::PROTOBUF_COMPRESSED,
            messages.into_iter().map(Ok),
            &mut file,
        )
        .writing("the layout")
        .map(drop)
    }
}

/// The messages of an arrangement for the recordings of an application.
pub(crate) fn messages(
    application: &'static str,
    (root, properties): (ContainerLike, Vec<Property>),
) -> Result<(Vec<LogMsg>, BlueprintActivationCommand), RecorderError> {
    const WHAT: &str = "the layout";
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
    const WHAT: &str = "the layout's properties";
    let store = &activation.blueprint_id;
    let (stream, stored) = RecordingStreamBuilder::from_store_id(store)
        .blueprint()
        .enabled(true)
        .memory()
        .writing(WHAT)?;
    // Blueprints live on this timeline; without it the viewer finds nothing.
    stream.set_time_sequence("blueprint", 0);
    for property in properties {
        stream
            .log_serialized_batches(property.path, false, property.batches)
            .writing(WHAT)?;
    }
    stream.flush_blocking().writing(WHAT)?;
    let taken = stored.take();
    stream.disconnect();
    // The store was announced by the first part already.
    Ok(taken
        .into_iter()
        .filter(|message| matches!(message, LogMsg::ArrowMsg(..)))
        .collect())
}
