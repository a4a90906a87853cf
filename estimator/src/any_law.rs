//! The laws that a scenario can choose, as one type.

use crate::{
    Correction, EstimatorError, FixedShape, Folded, Form, GaussNewton, Law, LawSettings, MatrixLaw, Prediction,
};
use anhyst_ipc::Invalid;
use anhyst_model::TwoPole;
use serde::{Deserialize, Serialize};

/// The laws that a scenario can choose, with their states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum AnyLaw {
    /// No adaptation.
    FixedShape(FixedShape),
    /// Min-max law on outputs folded through the rod, or the scalar or gradient law.
    Folded(Folded),
    /// Recursive Gauss-Newton.
    GaussNewton(GaussNewton),
    /// The paper's matrix law.
    Matrix(Box<MatrixLaw>),
}

impl AnyLaw {
    /// A law at its start. The rod's gain is per unit of free strain; only the matrix law has to know the rod.
    ///
    /// # Errors
    /// A rod that the matrix law cannot work with.
    pub fn new(settings: &LawSettings, two_pole_per_strain: &TwoPole, tick_s: f64) -> Result<Self, EstimatorError> {
        Ok(match settings {
            LawSettings::FixedShape { shape_a_per_m } => AnyLaw::FixedShape(FixedShape::new(*shape_a_per_m)),
            LawSettings::Folded(own) => AnyLaw::Folded(Folded::new(Form::Folded, own, tick_s)),
            LawSettings::GaussNewton(gauss_newton) => AnyLaw::GaussNewton(GaussNewton::new(gauss_newton, tick_s)),
            LawSettings::Gradient(own) => AnyLaw::Folded(Folded::new(Form::Gradient, own, tick_s)),
            LawSettings::Matrix(matrix) => {
                AnyLaw::Matrix(Box::new(MatrixLaw::new(matrix, two_pole_per_strain, tick_s)?))
            }
            LawSettings::MultiParameter(_) => {
                let sentence = "MultiParameter needs one model with its derivatives, not a bank over `a`";
                return Err(Invalid::new("law", sentence).into());
            }
            LawSettings::Weights(_) | LawSettings::FixedWeights => {
                let sentence =
                    "this estimates the weights of another hysteresis law, and the material has the domain wall's";
                return Err(Invalid::new("law", sentence).into());
            }
            LawSettings::Scalar(own) => AnyLaw::Folded(Folded::new(Form::Scalar, own, tick_s)),
        })
    }

    fn law(&self) -> &dyn Law {
        match self {
            AnyLaw::FixedShape(law) => law,
            AnyLaw::Folded(law) => law,
            AnyLaw::GaussNewton(law) => law,
            AnyLaw::Matrix(law) => law.as_ref(),
        }
    }

    fn law_mut(&mut self) -> &mut dyn Law {
        match self {
            AnyLaw::FixedShape(law) => law,
            AnyLaw::Folded(law) => law,
            AnyLaw::GaussNewton(law) => law,
            AnyLaw::Matrix(law) => law.as_mut(),
        }
    }
}

impl Law for AnyLaw {
    fn correct(&mut self, prediction: Prediction<'_>, measured_displacement_m: f64) -> Correction {
        self.law_mut().correct(prediction, measured_displacement_m)
    }

    fn shape_a_per_m(&self) -> f64 {
        self.law().shape_a_per_m()
    }
}
