//! Injected faults of a scenario: of what travels on a link, or of a process. Exact to the tick and the same in every run.
//!
//! A fault of a process happens in that process, before it answers the tick; the launcher wakes what was stopped.

use anhyst_ipc::{Channel, Invalid, NodeId, TokenFault, TokenKind};
use serde::{Deserialize, Deserializer, Serialize};

/// One injected fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// Of what is sent on a channel.
    Link(LinkFault),
    /// Of the process in which a node runs.
    Process(ProcessFault),
}

/// A fault of what is sent on a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkFault {
    /// When it begins; this or `from_tick`.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// The tick in which it begins.
    #[serde(default)]
    pub from_tick: Option<u64>,
    /// How long it lasts.
    #[serde(default = "one")]
    pub for_ticks: u64,
    /// Whose tokens.
    pub channel: Channel,
    /// Which number of the token; none: all.
    #[serde(default)]
    pub field: Option<String>,
    /// What happens.
    pub kind: TokenKind,
}

/// A fault of a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessFault {
    /// When; this or `from_tick`.
    #[serde(default)]
    pub at_s: Option<f64>,
    /// In which tick.
    #[serde(default)]
    pub from_tick: Option<u64>,
    /// The process in which this node runs.
    pub node: NodeId,
    /// What happens to it.
    pub kind: ProcessKind,
}

/// What happens to a process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ProcessKind {
    /// It is gone at once.
    Kill,
    /// It stands still for so many seconds of wall clock.
    Stop(f64),
}

/// The one fault that scenarios had before `faults`: the lowest bit of the first number that a node sends, in one tick.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Flip {
    node: NodeId,
    tick: u64,
}

/// Reads an old file's `fault`.
///
/// # Errors
/// If there is one: what to write instead.
pub(super) fn refuse_flip<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
    let Some(Flip { node, tick }) = Option::deserialize(deserializer)? else {
        return Ok(());
    };
    let sent = Channel::ALL.into_iter().find(|channel| channel.producer() == node);
    let first = sent.and_then(|channel| Some((channel, channel.fields().first()?.name)));
    Err(serde::de::Error::custom(match first {
        Some((channel, field)) => format!(
            "`fault` is now one of `faults`: write \
             faults: [Link(from_tick: {tick}, channel: {channel}, field: \"{field}\", kind: BitFlip(0))]"
        ),
        None => format!("{node} sends nothing that a fault could change"),
    }))
}

impl Fault {
    /// The node in whose process it happens.
    pub(super) fn node(&self) -> NodeId {
        match self {
            Fault::Link(link) => link.channel.producer(),
            Fault::Process(process) => process.node,
        }
    }

    pub(super) fn begin_tick(&self, tick_s: f64) -> Result<u64, Invalid> {
        match self {
            Fault::Link(link) => begin(link.at_s, link.from_tick, tick_s),
            Fault::Process(process) => begin(process.at_s, process.from_tick, tick_s),
        }
    }

    /// The fault of this tick would never happen: the run's ticks end before it.
    pub(super) fn too_late(&self, duration_s: f64, ticks: u64) -> Invalid {
        let (at_s, from_tick) = match self {
            Fault::Link(link) => (link.at_s, link.from_tick),
            Fault::Process(process) => (process.at_s, process.from_tick),
        };
        match (at_s, from_tick) {
            (Some(at_s), _) => Invalid::new(
                "at_s",
                format!(
                    "{at_s} s is not before the end of the run, duration_s = {} s: the fault would never happen",
                    duration_s
                ),
            ),
            (None, tick) => Invalid::new(
                "from_tick",
                format!(
                    "tick {} is not before the end of the run, {} ticks: the fault would never happen",
                    tick.unwrap_or_default(),
                    ticks
                ),
            ),
        }
    }

    /// A program of somebody else's does nothing of what it is not told.
    pub(super) fn not_read(&self, external: &[NodeId]) -> Invalid {
        let node = self.node();
        match self {
            Fault::Link(link) => Invalid::new(
                "channel",
                format!(
                    "{} is sent by {node}, which is external: an external process does not read the scenario's faults; {}",
                    link.channel,
                    instead(node, external)
                ),
            ),
            Fault::Process(_) => Invalid::new(
                "node",
                format!(
                    "{node} is external: an external process does not read the scenario's faults; kill or stop it yourself, or {}",
                    instead(node, external)
                ),
            ),
        }
    }
}

/// What a scenario can do to an external node: spoil what it hears.
fn instead(node: NodeId, external: &[NodeId]) -> String {
    let wires = crate::wires();
    let read: Vec<&str> = wires
        .iter()
        .filter(|wire| wire.reader == node && !external.contains(&wire.channel.producer()))
        .map(|wire| wire.channel.name())
        .collect();
    if read.is_empty() {
        return "inject on a link that another node sends".to_owned();
    }
    format!("inject on a link that it reads: {}", read.join(", "))
}

fn one() -> u64 {
    1
}

pub(super) fn begin(at_s: Option<f64>, from_tick: Option<u64>, tick_s: f64) -> Result<u64, Invalid> {
    match (at_s, from_tick) {
        (Some(at_s), None) => {
            Invalid::unless_between("at_s", at_s, 0.0, 1e9, "s")?;
            Ok((at_s / tick_s).round() as u64)
        }
        (None, Some(tick)) => Ok(tick),
        _ => Err(Invalid::new(
            "",
            "a fault begins at_s or from_tick: give exactly one of them",
        )),
    }
}

impl LinkFault {
    pub(super) fn on_tokens(&self, tick_s: f64) -> Result<TokenFault, Invalid> {
        let fault = TokenFault {
            from_tick: begin(self.at_s, self.from_tick, tick_s)?,
            for_ticks: self.for_ticks,
            channel: self.channel,
            field: self.field.clone(),
            kind: self.kind,
        };
        fault.validate()?;
        Ok(fault)
    }
}
