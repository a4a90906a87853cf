//! What a process of somebody else's must keep, for people and other languages, and whether one does.

pub mod amplifier;
pub mod interface;
