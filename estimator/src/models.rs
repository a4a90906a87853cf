//! What follows the field, and the law that learns from it: a bank over Θ for `a` alone, one model with its derivatives, or
//! another hysteresis law, whose output is the sum of what its weights are multiplied with.
//!
//! Both are columns that go the same way through creep, strain, rods and sensor: the members' outputs, or an output and its
//! derivatives, which a linear path carries alike.

use crate::any_law::AnyLaw;
use crate::excitation::{Excitation, ExcitationMonitor};
use crate::law::{Law, Prediction, is_credible};
use crate::law_weights::LawWeights;
use crate::multi_parameter::{COLUMNS, MultiParameter};
use crate::taught::Taught;
use crate::washout::Washout;
use crate::{EstimatorError, EstimatorSettings, Grid, LawSettings, MinMaxSettings};
use anhyst_model::{Bank, Magnetostriction, Material, TwoPole};
use serde::{Deserialize, Serialize};

/// See above.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Models {
    Bank(Box<BankModels>),
    Tangent(Box<MultiParameter>),
    Sum(Box<LawWeights>),
}

/// A bank and a law for `a`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct BankModels {
    grid: Grid,
    bank: Bank,
    /// The filter of the displacements for the strains, where the law reads them: a law that drives its own rod with them must
    /// see input and output washed alike.
    strain_washout: Option<Washout>,
    monitor: Option<ExcitationMonitor>,
    law: AnyLaw,
}

impl Models {
    pub fn new(
        settings: &EstimatorSettings,
        material: &Material,
        two_pole_per_strain: &TwoPole,
        tick_s: f64,
    ) -> Result<Self, EstimatorError> {
        if let Some(law) = &material.law {
            let law = LawWeights::new(&settings.law, law, material.hysteresis.shape_a_per_m, tick_s)?;
            return Ok(Models::Sum(Box::new(law)));
        }
        let hysteresis = material.hysteresis;
        if let LawSettings::MultiParameter(own) = &settings.law {
            let memory_s = settings.excitation.memory_s;
            let law = MultiParameter::new(own, hysteresis, memory_s, tick_s)?;
            return Ok(Models::Tangent(Box::new(law)));
        }
        let members = settings.law.members();
        let min_max = settings.law.min_max().copied().unwrap_or(MinMaxSettings::folded());
        let monitor = match settings.law {
            LawSettings::FixedShape { .. } => None,
            _ => Some(ExcitationMonitor::new(&settings.excitation, &min_max, tick_s)),
        };
        let (lower, upper) = settings.law.range_a_per_m();
        let grid = Grid::new(lower, upper, members);
        Ok(Models::Bank(Box::new(BankModels {
            bank: Bank::new(hysteresis, grid.shapes_a_per_m())?,
            grid,
            strain_washout: settings
                .washout_hz
                .filter(|_| matches!(settings.law, LawSettings::Matrix(_)))
                .map(|corner_hz| Washout::new(corner_hz, members, tick_s)),
            monitor,
            law: AnyLaw::new(&settings.law, two_pole_per_strain, tick_s)?,
        })))
    }

    /// Columns, and how many of them are values; the others are derivatives of the first.
    pub fn columns(&self) -> (usize, usize) {
        match self {
            Models::Bank(own) => (own.bank.magnetizations().len(), own.bank.magnetizations().len()),
            Models::Tangent(_) => (COLUMNS, 1),
            Models::Sum(own) => (own.columns().len(), 0),
        }
    }

    /// Follows the field to the next tick; the pinning is so many times as strong meanwhile.
    pub fn advance(&mut self, field_a_per_m: f64, pinning_factor: f64) {
        match self {
            Models::Bank(own) => own.bank.advance_pinned(field_a_per_m, pinning_factor),
            Models::Tangent(own) => own.advance(field_a_per_m, pinning_factor),
            Models::Sum(own) => own.advance(field_a_per_m),
        }
    }

    /// M of every column, A/m.
    pub fn magnetizations(&self) -> &[f64] {
        match self {
            Models::Bank(own) => own.bank.magnetizations(),
            Models::Tangent(own) => own.columns(),
            Models::Sum(own) => own.columns(),
        }
    }

    /// Free strains of magnetizations with creep.
    pub fn strains(
        &self,
        law: &Magnetostriction,
        saturation_a_per_m: f64,
        magnetizations: &[f64],
        strains: &mut [f64],
    ) {
        match self {
            Models::Bank(_) => law.strains(saturation_a_per_m, magnetizations, strains),
            Models::Tangent(_) => MultiParameter::strains(law, saturation_a_per_m, magnetizations, strains),
            Models::Sum(_) => strains.copy_from_slice(magnetizations),
        }
    }

    /// What the columns have at the estimate, in their unit.
    pub fn at_estimate(&self, columns: &[f64]) -> f64 {
        match self {
            Models::Bank(own) => own.grid.linear(columns, own.law.shape_a_per_m()),
            Models::Tangent(_) => columns[0],
            Models::Sum(own) => own.output(columns),
        }
    }

    /// Learns from a measurement, m.
    pub fn learn(&mut self, strains: &[f64], displacements_m: &[f64], measured_m: f64) -> Taught {
        match self {
            Models::Bank(own) => own.learn(strains, displacements_m, measured_m),
            Models::Sum(own) => own.learn(displacements_m, measured_m),
            Models::Tangent(own) => {
                let learned = own.correct(displacements_m, measured_m);
                Taught {
                    correction: learned.correction,
                    excitation: learned.excitation,
                    magnetization_a_per_m: own.magnetization_a_per_m(),
                    parameters: Some(learned.estimates),
                    change: learned.correction.adapting.then_some(learned.change),
                    weight: None,
                }
            }
        }
    }
}

impl BankModels {
    fn learn(&mut self, strains: &[f64], displacements_m: &[f64], measured_m: f64) -> Taught {
        let strains = match &mut self.strain_washout {
            None => strains,
            Some(washout) => washout.predicted(strains),
        };
        let prediction = Prediction {
            grid: &self.grid,
            strains,
            displacements_m,
        };
        let excitation = self.monitor.as_mut().map(|monitor| {
            let output = self.grid.smooth(displacements_m, self.law.shape_a_per_m());
            monitor.observe(output, is_credible(measured_m))
        });
        let correction = match excitation {
            Some(Excitation { informed: false, .. }) => self.law.hold(prediction),
            _ => self.law.correct(prediction, measured_m),
        };
        Taught {
            correction,
            excitation: excitation.unwrap_or_default(),
            magnetization_a_per_m: self
                .grid
                .smooth(self.bank.magnetizations(), correction.shape_a_per_m)
                .value,
            ..Taught::default()
        }
    }
}
