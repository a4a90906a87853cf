//! Writes every token of a run into one Rerun recording, lays it out for the viewer, and reads it back bit for bit.
//!
//! The loop's thread only copies seven tokens into a block ([`Recorder`]); a logger thread packs full blocks and draws what is seen of them.
//! A recording holds two things: `tokens`, every field of every token at full rate, bit for bit (what [`Recording::tokens`] and
//! replay read), and the plots, loops and events made for people, at a lower rate. A long one goes on in parts.
//! Finished curves that are no run (a paper's figures, data beside a model) make an [`Album`].

mod album;
mod axes;
mod error;
mod events;
mod extremes;
mod file;
mod fitting;
mod flags;
mod layout;
mod loops;
mod pack;
mod parts;
mod pipe;
mod plots;
mod read;
mod recorder;
mod row;
mod run;
mod scales;
mod settings;
mod spread;
mod streams;
mod timing;
mod tokens;
mod viewer;
mod views;
mod writer;

pub use album::{Album, AlbumPage};
pub use error::RecorderError;
pub use read::{Recording, Stretch, each_stretch, read_tokens};
pub use recorder::{Outcome, Recorder, RecorderReport};
pub use run::{EventName, Level, RunInfo};
pub use scales::{Scale, Scales};
pub use settings::RecorderSettings;
pub use viewer::view;
