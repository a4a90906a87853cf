//! Several parameters at once: θ = any of [Ms, a, k, α, c], from one run, by one of two laws.
//!
//! [`SeveralGaussNewton`] carries one model with its exact sensitivities and reaches the Cramér-Rao bound;
//! [`estimate_several`] goes over recorded data more than once. [`SeveralMinMax`] is the folded min-max law for a
//! vector: a bank over a box of parameters and its envelopes, with a proof that it never gets worse instead of a
//! deviation. Both are for recorded data and for studies; in the loop the shape parameter is adapted alone
//! ([`crate::Estimator`]).

mod coordinates;
mod envelope;
mod gauss_newton;
mod information;
mod members;
mod min_max;
mod min_max_settings;
mod output;
mod passes;
mod settings;
mod square_root;
mod uncertainty;

pub use gauss_newton::{SeveralEstimate, SeveralGaussNewton};
pub use information::{CramerRao, Information};
pub use min_max::{MinMaxEstimate, SeveralMinMax};
pub use min_max_settings::{MinMaxParameter, MinMaxSettings};
pub use output::{MeasuredOutput, OutputStage, SensitiveOutput, StrainLaw};
pub use passes::{PassReport, SeveralReport, estimate_several};
pub use settings::{EstimatedParameter, SeveralSettings};
pub use uncertainty::SeveralUncertainty;
