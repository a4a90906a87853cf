//! The numbers that the stepping equations are written in.

pub(crate) mod dual;
pub(crate) mod lanes;
