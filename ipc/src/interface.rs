//! What a foreign process must know to take part, as data: read from the message types and the services' settings, so that
//! every document and header made from it is true.

use crate::digest::fingerprint;
use crate::message::{Channel, FieldKind, Message, NodeId};
use crate::shared::names;
use crate::with_message;
use serde::Serialize;

/// Bytes of every field.
const FIELD_BYTES: usize = 8;

/// One field of a token.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FieldDescription {
    /// Name, with its unit where it has one.
    pub name: &'static str,
    /// Bytes from the start of the token.
    pub offset: usize,
    /// `f64` (IEEE 754 binary64) or `u64`.
    pub kind: &'static str,
    /// Unit; empty for counts and flags.
    pub unit: &'static str,
    /// One sentence.
    pub about: &'static str,
}

/// One channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelDescription {
    /// Number in interfaces without names.
    pub number: usize,
    /// Name.
    pub name: &'static str,
    /// Name of the message's struct.
    pub message: &'static str,
    /// Name of the iceoryx2 service.
    pub service: String,
    /// Type name by which iceoryx2 compares payloads; it ends in a hash of the field list.
    pub type_name: &'static str,
    /// The only node that sends.
    pub producer: &'static str,
    /// What a token says.
    pub about: &'static str,
    /// Size of a token; alignment is 8.
    pub size: usize,
    /// All fields, `tick` and `sent_ns` included.
    pub fields: Vec<FieldDescription>,
}

/// Sizes with which services are created.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ServiceSizes {
    /// `subscriber_max_buffer_size` of a channel.
    pub deepest_buffer: usize,
    /// `buffer_size` of a node's subscriber.
    pub loop_buffer: usize,
    /// `subscriber_max_borrowed_samples`.
    pub max_borrowed: usize,
    /// `max_publishers`.
    pub max_publishers: usize,
    /// `max_subscribers`.
    pub max_subscribers: usize,
    /// `max_nodes` of every service.
    pub max_nodes: usize,
    /// `max_notifiers` of a bell.
    pub max_notifiers: usize,
    /// `max_listeners` of a bell.
    pub max_listeners: usize,
    /// `max_readers` of a status.
    pub max_status_readers: usize,
}

/// One entry of a process's status.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StatusEntry {
    /// Key, a `u64`; the value is a `u64`, too.
    pub key: u64,
    /// Name.
    pub name: &'static str,
    /// What it says.
    pub about: &'static str,
}

/// All that a foreign process must know.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Interface {
    /// The nodes in the order in which a tick passes through them.
    pub nodes: Vec<&'static str>,
    /// The channels, in the order in which a tick sends them.
    pub channels: Vec<ChannelDescription>,
    /// How services are created.
    pub sizes: ServiceSizes,
    /// Event service of a process, `PROCESS` standing for its name.
    pub bell_service: String,
    /// Blackboard of a process.
    pub status_service: String,
    /// Its entries.
    pub status: Vec<StatusEntry>,
    /// The agreement of a process that has not read the scenario.
    pub any_agreement: u64,
    /// Hash of all layouts: differs if any field of any message does.
    pub layouts: u64,
}

/// The interface of this build.
pub fn interface() -> Interface {
    Interface {
        nodes: NodeId::LOOP_ORDER.map(NodeId::name).into(),
        channels: Channel::ALL.into_iter().map(describe).collect(),
        sizes: ServiceSizes {
            deepest_buffer: names::DEEPEST_BUFFER,
            loop_buffer: names::LOOP_BUFFER,
            max_borrowed: names::MAX_BORROWED,
            max_publishers: names::MAX_PUBLISHERS,
            max_subscribers: names::MAX_SUBSCRIBERS,
            max_nodes: names::MAX_NODES,
            max_notifiers: names::MAX_NOTIFIERS,
            max_listeners: names::MAX_LISTENERS,
            max_status_readers: names::MAX_STATUS_READERS,
        },
        bell_service: names::bell_service("PROCESS"),
        status_service: names::status_service("PROCESS", 0),
        status: status_entries(),
        any_agreement: names::ANY_AGREEMENT,
        layouts: layouts(),
    }
}

/// Hash of all layouts: the type names hash their fields.
pub fn layouts() -> u64 {
    fingerprint(
        &Channel::ALL
            .map(|channel| with_message!(channel, M => M::TYPE_NAME))
            .join(","),
    )
}

fn status_entries() -> Vec<StatusEntry> {
    let entry = |key, name, about| StatusEntry { key, name, about };
    vec![
        entry(
            names::PHASE,
            "phase",
            "0 started, 1 all ports created, 2 connected, 3 at the end, 4 has seen all the others at the end",
        ),
        entry(
            names::ASLEEP,
            "asleep",
            "1: ring the bell after sending; 1 + a channel's number, counted from 1 in the order above: after sending on \
             that one is enough; 0: awake, it polls",
        ),
        entry(names::TICK, "tick", "Ticks finished, their bells rung: the heartbeat"),
        entry(
            names::AGREEMENT,
            "agreement",
            "Fingerprint of the scenario; 0: has not read it, goes along with any",
        ),
        entry(
            names::EPOCH,
            "epoch",
            "In real time, from the plant's process: CLOCK_MONOTONIC in ns at which tick 0 begins; 0: not known (yet)",
        ),
        entry(
            names::WAIT,
            "wait",
            "Optional. The token that the process waited for last: tick << 16 | (reader + 1) << 8 | channel + 1, in the order of the nodes and channels above; 0: none",
        ),
    ]
}

fn describe(channel: Channel) -> ChannelDescription {
    with_message!(channel, M => describe_message::<M>())
}

fn describe_message<M: Message>() -> ChannelDescription {
    let head = [
        ("tick", "The tick the token belongs to."),
        ("sent_ns", "Time of sending, CLOCK_MONOTONIC; for statistics only."),
    ]
    .map(|(name, about)| (name, FieldKind::U64, if name == "tick" { "" } else { "ns" }, about));
    let fields = M::FIELDS
        .iter()
        .map(|field| (field.name, field.kind, field.unit, field.doc.trim()));
    let (message, _hash) = M::TYPE_NAME.rsplit_once('_').unwrap_or((M::TYPE_NAME, ""));
    ChannelDescription {
        number: M::CHANNEL.number(),
        name: M::CHANNEL.name(),
        message,
        service: names::channel_service(M::CHANNEL),
        type_name: M::TYPE_NAME,
        producer: M::CHANNEL.producer().name(),
        about: M::ABOUT.trim(),
        size: size_of::<M>(),
        fields: head
            .into_iter()
            .chain(fields)
            .enumerate()
            .map(|(index, (name, kind, unit, about))| FieldDescription {
                name,
                offset: FIELD_BYTES * index,
                kind: match kind {
                    FieldKind::F64 => "f64",
                    FieldKind::U64 => "u64",
                },
                unit,
                about,
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::interface;
    use crate::messages::{CoilField, SafeField};
    use std::mem::offset_of;

    /// Guards the offsets that foreign languages are told: those of the structs themselves.
    #[test]
    fn offsets_are_those_of_the_structs() {
        let interface = interface();
        let offset = |channel: &str, name: &str| {
            let channel = interface.channels.iter().find(|known| known.name == channel).unwrap();
            channel.fields.iter().find(|field| field.name == name).unwrap().offset
        };
        assert_eq!(
            offset("safe_field", "field_a_per_m"),
            offset_of!(SafeField, field_a_per_m)
        );
        assert_eq!(offset("safe_field", "event"), offset_of!(SafeField, event));
        assert_eq!(offset("coil_field", "sent_ns"), offset_of!(CoilField, sent_ns));
        assert_eq!(offset("coil_field", "status"), offset_of!(CoilField, status));
    }
}
