//! Several parameters at once: θ = any of [Ms, a, k, α, c], from one run.
//!
//! [`SeveralGaussNewton`] carries one model with its exact sensitivities and reaches the Cramér-Rao bound;
//! [`estimate_several`] goes over recorded data more than once. Both are for recorded data; in the loop the shape
//! parameter is adapted alone ([`crate::Estimator`]).

mod coordinates;
mod gauss_newton;
mod information;
mod output;
mod passes;
mod settings;
mod square_root;
mod uncertainty;

pub use gauss_newton::{SeveralEstimate, SeveralGaussNewton};
pub use information::{CramerRao, Information};
pub use output::{MeasuredOutput, OutputStage, SensitiveOutput, StrainLaw};
pub use passes::{PassReport, SeveralReport, estimate_several};
pub use settings::{EstimatedParameter, SeveralSettings};
pub use uncertainty::SeveralUncertainty;
