//! Carries the typed channels of a run between two hosts over Zenoh.
//!
//! A run is split in two sides: local and remote. On each side a bridge stands for all processes of the other one: the
//! processes find their names, event services and ports and notice nothing. What crosses follows from the wiring alone: every channel
//! whose producer is on one side and a reader on the other. A token crosses as its tick and its words; the bridges check
//! that every channel's ticks follow each other, relay the rendezvous, and end when the other side is silent.
//!
//! Before the loop starts the bridges compare what both sides were told ([`Handshake`]), measure the round trip over Zenoh and
//! over plain TCP on the same link ([`RoundTrips`]), and refuse a link that is slower than the budget.
//!
//! Without the cargo feature `zenoh` only the parts that need no network are built, for their tests.

#![cfg_attr(
    not(feature = "zenoh"),
    allow(dead_code, reason = "what crosses the network is what uses the rest")
)]

mod error;
mod handshake;
mod partition;
mod progress;
mod round_trip;
mod settings;

#[cfg(feature = "zenoh")]
mod crossing;
#[cfg(feature = "zenoh")]
mod heartbeat;
#[cfg(feature = "zenoh")]
mod meeting;
#[cfg(feature = "zenoh")]
mod outlet;
#[cfg(feature = "zenoh")]
mod session;
#[cfg(feature = "zenoh")]
mod state;

pub use error::BridgeError;
pub use handshake::Handshake;
pub use partition::Partition;
pub use round_trip::{Quantiles, RoundTrips};
pub use settings::{BridgeSettings, End};

#[cfg(feature = "zenoh")]
pub use crossing::{Crossed, run};
#[cfg(feature = "zenoh")]
pub use outlet::Outlet;
