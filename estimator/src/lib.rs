//! Adaptive estimation of the shape parameter `a` of the anhysteretic curve, and of the magnetization with it.
//!
//! A bank of models over the range of `a`, driven by the best knowledge of the coil field ([`Estimator`]); covers of their
//! outputs over `a` ([`Covers`]); a law that corrects the estimate ([`Law`]: [`Folded`] with the scalar and
//! the gradient law, [`GaussNewton`], [`MatrixLaw`], [`FixedShape`]). Several parameters at once are estimated by one model with its
//! derivatives ([`MultiParameterSettings`]).
//! The paper's scalar and matrix forms stand beside them for simulations of any plant ([`Scalar`], [`Matrix`]).
//! A monitor of what the motion can say about `a` ([`ExcitationMonitor`]) holds every law while that is too little, and a
//! measurement that no such rod can give is left out.
//! `node.rs` is the only file that knows messages.

mod any_law;
mod coil_field;
mod covers;
mod effects;
mod error;
mod estimator;
mod excitation;
mod fixed_shape;
mod folded;
mod gauss_newton;
mod grid;
mod law;
mod law_weights;
mod matrix;
mod matrix_law;
mod models;
mod modes;
mod multi_parameter;
mod node;
mod outlier;
mod rod_output;
mod rods;
mod sampled_modes;
mod scalar;
mod settings;
mod smooth;
mod taught;
mod washout;
mod weights;

pub use any_law::AnyLaw;
pub use coil_field::{CoilFieldModel, FieldKnowledge};
pub use covers::{CoverPoint, Covers};
pub use error::EstimatorError;
pub use estimator::{Estimation, Estimator};
pub use excitation::{Excitation, ExcitationMonitor};
pub use fixed_shape::FixedShape;
pub use folded::Folded;
pub use gauss_newton::GaussNewton;
pub use grid::Grid;
pub use law::{Correction, Law, Prediction};
pub use matrix::{Matrix, MatrixConstants};
pub use matrix_law::MatrixLaw;
pub use modes::{Mode, Modes};
pub use multi_parameter::ParameterEstimates;
pub use num_complex::Complex64;
pub use scalar::{Form, Scalar, ScalarPlant, ScalarSettings};
pub use settings::{
    EstimatorSettings, ExcitationSettings, FieldSource, GaussNewtonSettings, LawSettings, MinMaxSettings,
    MultiParameterSettings, OutlierSettings, ParameterSettings, Tuning, WeightSettings,
};
pub use smooth::SmoothPoint;
pub use taught::Weight;
pub use weights::{WeightBelief, WeightEstimator};
