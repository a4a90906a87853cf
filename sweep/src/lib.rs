//! Many runs of a scenario: what varies, all cores, each run kept when it is done, in parts over machines, one table.
//!
//! A run is known by its index alone: what varies and its seed follow from that ([`Plan`]). What it came to is a [`Row`], a line
//! of a [`Journal`] as soon as it is there. Tables and the page are made of the journals at the end, in the order of the indices,
//! so they are the same bytes whatever the order of the runs, their threads, interruptions and machines.

mod error;
mod gather;
mod journal;
mod manifest;
mod page;
mod picture;
mod plan;
mod points;
mod publish;
mod row;
mod rows;
mod run;
mod shard;
mod table;
mod variation;

pub use error::SweepError;
pub use gather::{Gathered, gather};
pub use journal::Journal;
pub use manifest::Manifest;
pub use page::Findings;
pub use plan::Plan;
pub use publish::publish;
pub use rows::Rows;
pub use run::{Made, Sweep};
pub use shard::{Shard, ranges};
pub use variation::Variation;
