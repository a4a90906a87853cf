//! Hysteresis laws, one a folder.

pub(crate) mod domain_wall;
