//! What every message has: a tick, fields of eight bytes with names and units, and a type name that carries a hash of them.
//!
//! iceoryx2 compares the size and the name of a type, not its fields: two structs of equal size with permuted fields are
//! accepted and their values swapped. The name therefore ends in a hash of the field list (FNV-1a).

use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// The nodes of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeId {
    /// Rod, hysteresis, sensors; simulated or a real rig.
    Plant,
    /// Estimator of the shape parameter `a`.
    Estimator,
    /// Trajectory, rod feedforward and PID.
    Controller,
    /// Hysteresis-inverse compensator.
    Inverse,
    /// Limits and watchdog, the last stage before the amplifier.
    Guard,
    /// Current amplifier; simulated or real.
    Amplifier,
    /// Streams every token to a recording.
    Recorder,
}

impl NodeId {
    /// The order in which one tick passes through the nodes: each reads only tokens of this tick that were already sent.
    pub const LOOP_ORDER: [NodeId; 7] = [
        NodeId::Plant,
        NodeId::Estimator,
        NodeId::Controller,
        NodeId::Inverse,
        NodeId::Guard,
        NodeId::Amplifier,
        NodeId::Recorder,
    ];

    /// Those that send: all but the recorder, in the same order.
    pub const SENDERS: [NodeId; 6] = match Self::LOOP_ORDER.first_chunk() {
        Some(senders) => *senders,
        None => panic!("the recorder is not the last of seven"),
    };

    /// The node of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::LOOP_ORDER.into_iter().find(|node| node.name() == name)
    }

    /// The node's name: its process, its subcommand, its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            NodeId::Plant => "plant-sim",
            NodeId::Estimator => "estimator",
            NodeId::Controller => "controller",
            NodeId::Inverse => "inverse",
            NodeId::Guard => "guard",
            NodeId::Amplifier => "amplifier",
            NodeId::Recorder => "recorder",
        }
    }
}

impl std::fmt::Display for NodeId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// The channels of the loop, one message type each, one producer each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// What the sensors say.
    Measurement,
    /// What is really so; exists only in simulation.
    Truth,
    /// Estimated parameter and magnetic state.
    Estimate,
    /// Magnetization wanted.
    Demand,
    /// Field that produces the demanded magnetization.
    FieldCommand,
    /// Field after limits and watchdog.
    SafeField,
    /// Field in the coil.
    CoilField,
}

impl Channel {
    /// All channels, in the order in which a tick sends them.
    pub const ALL: [Channel; 7] = [
        Channel::Measurement,
        Channel::Truth,
        Channel::Estimate,
        Channel::Demand,
        Channel::FieldCommand,
        Channel::SafeField,
        Channel::CoilField,
    ];

    /// The name of the channel's service.
    pub const fn name(self) -> &'static str {
        match self {
            Channel::Measurement => "measurement",
            Channel::Truth => "truth",
            Channel::Estimate => "estimate",
            Channel::Demand => "demand",
            Channel::FieldCommand => "field_command",
            Channel::SafeField => "safe_field",
            Channel::CoilField => "coil_field",
        }
    }

    /// The channel's number in interfaces that know no names: its place in [`Channel::ALL`].
    pub fn number(self) -> usize {
        Channel::ALL
            .iter()
            .position(|channel| *channel == self)
            .unwrap_or_default()
    }

    /// The only node that sends on this channel.
    pub const fn producer(self) -> NodeId {
        match self {
            Channel::Measurement | Channel::Truth => NodeId::Plant,
            Channel::Estimate => NodeId::Estimator,
            Channel::Demand => NodeId::Controller,
            Channel::FieldCommand => NodeId::Inverse,
            Channel::SafeField => NodeId::Guard,
            Channel::CoilField => NodeId::Amplifier,
        }
    }
}

impl std::fmt::Display for Channel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// The two kinds of field that a message may have; both take eight bytes, so that no layout has padding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
    /// IEEE 754 binary64.
    F64,
    /// Unsigned integer: a count or a set of flags.
    U64,
}

/// One field of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Name, with its unit where it has one.
    pub name: &'static str,
    /// Unit as written by engineers: `A/m`, `m`, `K`; empty for counts and flags.
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Representation.
    pub kind: FieldKind,
}

/// The most fields that a message may have (the digest's buffer is sized by it).
pub const MAX_FIELDS: usize = 26;

/// Words before the fields: tick and time of sending.
pub(crate) const HEAD: usize = 2;

/// A token: `tick` and `sent_ns`, then the fields.
pub trait Message: Copy + Default + PartialEq + std::fmt::Debug + ZeroCopySend + 'static {
    /// The channel it travels on.
    const CHANNEL: Channel;
    /// What it says, in a sentence.
    const ABOUT: &'static str;
    /// Its fields after `tick` and `sent_ns`, in the order of the layout.
    const FIELDS: &'static [Field];

    /// Name of the type between processes: its own and a hash of its fields.
    const TYPE_NAME: &'static str;

    /// The tick the token belongs to.
    fn tick(&self) -> u64;
    /// Monotonic time of sending in ns; 0 on a link within one process. Never part of a digest.
    fn sent_ns(&self) -> u64;
    /// Its bits as they lie in memory: tick, time of sending, fields.
    fn words(&self) -> &[u64];
    /// The bits of its fields.
    fn field_words(&self) -> &[u64] {
        &self.words()[HEAD..]
    }
    /// Sets tick and time of sending.
    fn stamp(&mut self, tick: u64, sent_ns: u64);
    /// Copies the fields' bits into `words` (at least `FIELDS.len()` long).
    fn write_words(&self, words: &mut [u64]);
    /// The token of `tick` whose fields have these bits; the inverse of [`Message::write_words`].
    fn from_words(tick: u64, words: &[u64]) -> Self;

    /// The fields as numbers, for programs that know no others: counts and flags converted, numbers as they are.
    fn write_values(&self, values: &mut [f64]) {
        let mut words = [0; MAX_FIELDS];
        self.write_words(&mut words);
        for ((value, word), field) in values.iter_mut().zip(words).zip(Self::FIELDS) {
            *value = match field.kind {
                FieldKind::F64 => f64::from_bits(word),
                FieldKind::U64 => word as f64,
            };
        }
    }
}

/// A field type, seen as eight bytes.
pub(crate) trait Word: Copy {
    const KIND: FieldKind;
    fn to_word(self) -> u64;
    fn from_word(word: u64) -> Self;
}

impl Word for f64 {
    const KIND: FieldKind = FieldKind::F64;
    fn to_word(self) -> u64 {
        self.to_bits()
    }
    fn from_word(word: u64) -> Self {
        f64::from_bits(word)
    }
}

impl Word for u64 {
    const KIND: FieldKind = FieldKind::U64;
    fn to_word(self) -> u64 {
        self
    }
    fn from_word(word: u64) -> Self {
        word
    }
}

const fn fnv1a(mut hash: u64, bytes: &[u8]) -> u64 {
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x100_0000_01b3);
        i += 1;
    }
    hash
}

/// Hash of a field list: names, units and kinds, in order.
pub(crate) const fn schema_hash(fields: &[Field]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut i = 0;
    while i < fields.len() {
        hash = fnv1a(hash, fields[i].name.as_bytes());
        hash = fnv1a(hash, b":");
        hash = fnv1a(hash, fields[i].unit.as_bytes());
        hash = fnv1a(
            hash,
            match fields[i].kind {
                FieldKind::F64 => b":f64;",
                FieldKind::U64 => b":u64;",
            },
        );
        i += 1;
    }
    hash
}

/// Bytes of `NAME_0123456789abcdef`, and how many they are.
pub(crate) const fn type_name_bytes(name: &str, hash: u64) -> ([u8; 64], usize) {
    let mut bytes = [0; 64];
    let name = name.as_bytes();
    let mut i = 0;
    while i < name.len() {
        bytes[i] = name[i];
        i += 1;
    }
    bytes[i] = b'_';
    let mut digit = 0;
    while digit < 16 {
        let nibble = ((hash >> (60 - 4 * digit)) & 15) as u8;
        bytes[i + 1 + digit] = if nibble < 10 { b'0' + nibble } else { b'a' + nibble - 10 };
        digit += 1;
    }
    (bytes, i + 17)
}

/// The bits of a status word as the end of its sentence: ` 1 adapting, 2 at an edge.`
macro_rules! bits_in_words {
    ($value:literal $meaning:literal) => {
        concat!(" ", stringify!($value), " ", $meaning, ".")
    };
    ($value:literal $meaning:literal $($more:tt)+) => {
        concat!(" ", stringify!($value), " ", $meaning, ",", $crate::message::bits_in_words!($($more)+))
    };
}
pub(crate) use bits_in_words;

/// Declares a message: its struct (`#[repr(C)]`, eight bytes a field), its schema, its type name and the bits of its status.
macro_rules! message {
    ($(#[doc = $about:literal])+ $name:ident on $channel:ident {
        $(
            $(#[doc = $text:literal])+ $field:ident : $kind:ident in $unit:literal
            $( { $( $bit:ident = $value:literal $meaning:literal ),+ $(,)? } )?
        ),* $(,)?
    }) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[repr(C)]
        pub struct $name {
            /// The tick the token belongs to.
            pub tick: u64,
            /// Monotonic time of sending in ns; 0 within one process; never part of a digest.
            pub sent_ns: u64,
            $( #[doc = concat!($($text),+ $(, $crate::message::bits_in_words!($($value $meaning)+))?)] pub $field: $kind, )*
        }

        $( $( impl $name {
            $( #[doc = concat!("Bit of its status: ", $meaning, ".")] pub const $bit: u64 = $value; )+
        } )? )*

        const _: () = {
            use $crate::message::{Channel, Field, HEAD, Message, Word, schema_hash, type_name_bytes, MAX_FIELDS};
            const FIELDS: &[Field] = &[$( Field {
                name: stringify!($field), unit: $unit, kind: <$kind as Word>::KIND,
                doc: concat!($($text),+ $(, $crate::message::bits_in_words!($($value $meaning)+))?),
            } ),*];
            const NAME: ([u8; 64], usize) = type_name_bytes(stringify!($name), schema_hash(FIELDS));
            const TYPE_NAME: &str = match std::str::from_utf8(NAME.0.split_at(NAME.1).0) {
                Ok(text) => text,
                Err(_) => panic!("a type name is ASCII"),
            };
            const _: () = assert!(size_of::<$name>() == 8 * (HEAD + FIELDS.len()));
            const _: () = assert!(FIELDS.len() <= MAX_FIELDS);

            // SAFETY: `#[repr(C)]`, only u64 and f64 fields, no pointers, no padding (asserted above).
            unsafe impl iceoryx2::prelude::ZeroCopySend for $name {
                unsafe fn type_name() -> &'static str {
                    TYPE_NAME
                }
            }

            impl Message for $name {
                const CHANNEL: Channel = Channel::$channel;
                const ABOUT: &'static str = concat!($($about),+);
                const FIELDS: &'static [Field] = FIELDS;
                const TYPE_NAME: &'static str = TYPE_NAME;
                fn tick(&self) -> u64 { self.tick }
                fn sent_ns(&self) -> u64 { self.sent_ns }
                #[inline]
                fn words(&self) -> &[u64] {
                    // SAFETY: `#[repr(C)]`, only u64 and f64 fields, no padding (asserted above); any bits are a u64.
                    unsafe { std::slice::from_raw_parts(std::ptr::from_ref(self).cast(), HEAD + FIELDS.len()) }
                }
                #[inline]
                fn stamp(&mut self, tick: u64, sent_ns: u64) { self.tick = tick; self.sent_ns = sent_ns; }
                #[inline]
                fn write_words(&self, words: &mut [u64]) {
                    let fields = [$( self.$field.to_word() ),*];
                    words[..fields.len()].copy_from_slice(&fields);
                }
                #[inline]
                fn from_words(tick: u64, words: &[u64]) -> Self {
                    let [$( $field ),*] = std::array::from_fn(|i| words[i]);
                    Self { tick, sent_ns: 0, $( $field: Word::from_word($field) ),* }
                }
            }
        };
    };
}
pub(crate) use message;
