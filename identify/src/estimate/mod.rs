//! Constants of a model from one measured run, off line.

mod observed;
mod several;

pub use observed::Observed;
pub use several::{SeveralFound, several};
