//! What a running process really offers on a channel: found without opening it, because opening a channel of a foreign
//! layout is refused without a word on what it is.

use super::iceoryx::{channel_name, configuration};
use crate::error::LinkError;
use crate::message::Message;
use iceoryx2::prelude::*;

/// Name, size and alignment of the type that travels on a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Name of the type; ours ends in a hash of the fields.
    pub type_name: String,
    /// Bytes of a token.
    pub size_bytes: usize,
    /// Alignment of a token in bytes.
    pub alignment_bytes: usize,
}

impl Layout {
    /// The layout of our message `M`.
    pub fn of<M: Message>() -> Self {
        Self {
            type_name: M::TYPE_NAME.into(),
            size_bytes: size_of::<M>(),
            alignment_bytes: align_of::<M>(),
        }
    }

    /// The layout that `M`'s channel has under this prefix and root; none while nobody has made the channel.
    ///
    /// # Errors
    /// If prefix or root cannot be used.
    pub fn offered<M: Message>(prefix: &str, root: &std::path::Path) -> Result<Option<Self>, LinkError> {
        let name = channel_name(M::CHANNEL)?;
        let configuration = configuration(prefix, root)?;
        // A refusal is a half-made channel: the next look shows it whole.
        let details = ipc::Service::details(&name, &configuration, MessagingPattern::PublishSubscribe);
        let Ok(Some(details)) = details else { return Ok(None) };
        let payload = &details
            .static_details
            .publish_subscribe()
            .message_type_details()
            .payload;
        Ok(Some(Self {
            type_name: payload.type_name().to_string(),
            size_bytes: payload.size(),
            alignment_bytes: payload.alignment(),
        }))
    }
}
