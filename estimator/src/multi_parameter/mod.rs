//! Several parameters at once: θ = any of [Ms, a, k, α, c], from one run.
//!
//! [`MultiParameterGaussNewton`] carries one model with its exact sensitivities and reaches the Cramér-Rao bound;
//! [`estimate_parameters`] goes over recorded data more than once. Both are for recorded data; in the loop the shape
//! parameter is adapted alone ([`crate::Estimator`]).

mod coordinates;
mod gauss_newton;
mod information;
mod output;
mod passes;
mod settings;
mod square_root;
mod uncertainty;

pub use gauss_newton::{MultiParameterEstimate, MultiParameterGaussNewton};
pub use information::Information;
pub use output::{MeasuredOutput, OutputStage, SensitiveOutput, StrainLaw};
pub use passes::{MultiParameterReport, PassReport, estimate_parameters};
pub use settings::{EstimatedParameter, MultiParameterSettings};
pub use uncertainty::MultiParameterUncertainty;
