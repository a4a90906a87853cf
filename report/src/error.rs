//! What can go wrong with a picture.

use thiserror::Error;

/// A picture that cannot be drawn.
#[derive(Debug, Error)]
pub enum ReportError {
    #[error("the picture cannot be drawn: {0}")]
    Picture(String),
}
