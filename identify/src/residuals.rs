//! r = (model − measured)/(range·√n·√L): what the fit makes small, so that Σr² is the joint NRMSE squared.
//!
//! NRMSE of a loop = rms of the residual over the loop's measured range (largest − smallest); joint NRMSE = root of
//! the mean of the squares over L loops, so a small loop counts as much as a large one. n samples per loop.
//! The model runs freely: it hears the field and never the measured response. Unknowns beside the material's
//! parameters: the instrument's zero of M of each loop, and the first M of a loop whose beginning is fitted.
//! The strain law λ = γM² + λ0 is linear in γ and λ0, so it is solved for at every evaluation (variable projection,
//! Golub & Pereyra 1973) and adds its own block where the strain has weight.

use anhyst_model::Hysteresis;
use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use crate::observed::{Nuisance, ObservedLoop};
use crate::parameters::Coordinates;
use crate::simulate::{self, Beginning};
use crate::strain::StrainLaw;

/// NRMSE of a parameter set that cannot be simulated: far above any real one, and finite so that a step can be refused.
const REFUSED_NRMSE: f64 = 10.0;

/// Step of the central differences in the free numbers: balances the square of the step against the model's
/// integration error of 1e-9 Ms.
const DIFFERENCE_STEP: f64 = 1e-3;

/// The measurement, and which of its own unknowns are free.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    pub loops: Vec<ObservedLoop>,
    pub free_offset: bool,
    pub strain_weight: f64,
}

impl Observation {
    pub fn zero_nuisance(&self) -> Nuisance {
        let zeros = vec![0.0; self.loops.len()];
        Nuisance {
            offset: zeros.clone(),
            first: zeros,
        }
    }

    /// Reads the nuisance from the numbers that follow the material's.
    pub fn nuisance(&self, numbers: &[f64]) -> Nuisance {
        let mut nuisance = self.zero_nuisance();
        let mut rest = numbers.iter();
        for (index, measured) in self.loops.iter().enumerate() {
            if self.free_offset {
                nuisance.offset[index] = rest.next().copied().unwrap_or_default();
            }
            if measured.beginning == Beginning::Fitted {
                nuisance.first[index] = rest.next().copied().unwrap_or_default();
            }
        }
        nuisance
    }

    /// Derivative by one of the instrument's numbers where no simulation is needed: the zero of a loop that starts from
    /// the demagnetised state only shifts its residual.
    pub fn known_column(&self, number: usize) -> Option<DVector<f64>> {
        let (mut next, mut first_row) = (0, 0);
        for measured in &self.loops {
            let count = measured.field_a_per_m.len();
            if self.free_offset && next == number {
                let weight = 1.0 / (self.loops.len() as f64 * count as f64).sqrt();
                let rows = first_row..first_row + count;
                let column = DVector::from_fn(self.length(), |row, _| if rows.contains(&row) { weight } else { 0.0 });
                return (measured.beginning == Beginning::Cycled).then_some(column);
            }
            next += usize::from(self.free_offset) + usize::from(measured.beginning == Beginning::Fitted);
            first_row += count;
        }
        None
    }

    pub fn nuisance_count(&self) -> usize {
        let fitted = self
            .loops
            .iter()
            .filter(|measured| measured.beginning == Beginning::Fitted)
            .count();
        fitted + if self.free_offset { self.loops.len() } else { 0 }
    }

    /// True M along every loop, A/m.
    pub fn magnetizations(&self, hysteresis: &Hysteresis, nuisance: &Nuisance) -> Vec<Vec<f64>> {
        let along = |(index, measured): (usize, &ObservedLoop)| {
            let mut magnetization = Vec::with_capacity(measured.field_a_per_m.len());
            let field = &measured.field_a_per_m;
            if measured.beginning == Beginning::Cycled {
                simulate::cycled(hysteresis, field, &mut magnetization);
            } else {
                let range = measured.magnetization_range_a_per_m;
                let first = measured.magnetization_a_per_m.first().copied().unwrap_or_default();
                let true_first = first + range * (nuisance.first[index] - nuisance.offset[index]);
                simulate::from_first(hysteresis, field, true_first, &mut magnetization);
            }
            magnetization
        };
        self.loops.iter().enumerate().map(along).collect()
    }

    /// All residuals, magnetization of every loop first, then strain where it has weight.
    pub fn residuals(&self, hysteresis: &Hysteresis, nuisance: &Nuisance) -> DVector<f64> {
        let magnetizations = self.magnetizations(hysteresis, nuisance);
        let mut residuals = Vec::with_capacity(self.length());
        let loops = self.loops.len() as f64;
        for (index, (measured, model)) in self.loops.iter().zip(&magnetizations).enumerate() {
            let range = measured.magnetization_range_a_per_m;
            let weight = 1.0 / (loops * model.len() as f64).sqrt();
            let pairs = model.iter().zip(&measured.magnetization_a_per_m);
            residuals.extend(pairs.map(|(m, seen)| weight * ((m - seen) / range + nuisance.offset[index])));
        }
        if self.strain_weight > 0.0
            && let Some(law) = StrainLaw::solve(&self.loops, &magnetizations)
        {
            law.each_residual(&self.loops, &magnetizations, |nrmse_part| {
                residuals.push(self.strain_weight.sqrt() * nrmse_part);
            });
        }
        if residuals.len() == self.length() && residuals.iter().all(|r| r.is_finite()) {
            DVector::from_vec(residuals)
        } else {
            self.refusal()
        }
    }

    /// Residuals of a set that is not valid.
    pub fn refusal(&self) -> DVector<f64> {
        DVector::from_element(self.length(), REFUSED_NRMSE / (self.length() as f64).sqrt())
    }

    fn length(&self) -> usize {
        let strain = |measured: &&ObservedLoop| self.strain_weight > 0.0 && measured.strain.is_some();
        let magnetization: usize = self.loops.iter().map(|measured| measured.field_a_per_m.len()).sum();
        magnetization
            + self
                .loops
                .iter()
                .filter(strain)
                .map(|measured| measured.field_a_per_m.len())
                .sum::<usize>()
    }
}

/// The least-squares problem over the free numbers of the material followed by those of the instrument.
pub(crate) struct FitProblem<'a> {
    pub observation: &'a Observation,
    pub coordinates: &'a Coordinates,
    numbers: DVector<f64>,
    residuals: DVector<f64>,
}

impl<'a> FitProblem<'a> {
    pub fn new(observation: &'a Observation, coordinates: &'a Coordinates, material: &[f64]) -> Self {
        let mut numbers = material.to_vec();
        numbers.resize(coordinates.count() + observation.nuisance_count(), 0.0);
        let numbers = DVector::from_vec(numbers);
        let mut problem = FitProblem {
            observation,
            coordinates,
            numbers,
            residuals: DVector::zeros(0),
        };
        problem.residuals = problem.at(problem.numbers.as_slice());
        problem
    }

    /// Joint NRMSE (with the strain's share where it has weight).
    pub fn nrmse(&self) -> f64 {
        self.residuals.norm()
    }

    pub fn material_numbers(&self) -> &[f64] {
        &self.numbers.as_slice()[..self.coordinates.count()]
    }

    pub fn nuisance(&self) -> Nuisance {
        self.observation
            .nuisance(&self.numbers.as_slice()[self.coordinates.count()..])
    }

    fn at(&self, numbers: &[f64]) -> DVector<f64> {
        let (material, instrument) = numbers.split_at(self.coordinates.count());
        match self.coordinates.hysteresis(material) {
            Some(hysteresis) => self
                .observation
                .residuals(&hysteresis, &self.observation.nuisance(instrument)),
            None => self.observation.refusal(),
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for FitProblem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, numbers: &DVector<f64>) {
        self.numbers.copy_from(numbers);
        self.residuals = self.at(numbers.as_slice());
    }

    fn params(&self) -> DVector<f64> {
        self.numbers.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals.clone())
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let steps = vec![DIFFERENCE_STEP; self.numbers.len()];
        let material_count = self.coordinates.count();
        let known = |column: usize| self.observation.known_column(column.checked_sub(material_count)?);
        Some(central_differences(
            self.numbers.as_slice(),
            &steps,
            &self.residuals,
            known,
            |numbers| {
                let (material, instrument) = numbers.split_at(material_count);
                let hysteresis = self.coordinates.hysteresis(material)?;
                Some(
                    self.observation
                        .residuals(&hysteresis, &self.observation.nuisance(instrument)),
                )
            },
        ))
    }
}

/// ∂r/∂p by central differences except for columns that are known; one-sided where the other side is not valid, zero where both are not.
pub(crate) fn central_differences(
    at: &[f64],
    steps: &[f64],
    centre: &DVector<f64>,
    known_column: impl Fn(usize) -> Option<DVector<f64>>,
    residuals: impl Fn(&[f64]) -> Option<DVector<f64>>,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(centre.len(), at.len());
    for (column, &step) in steps.iter().enumerate() {
        if let Some(slope) = known_column(column) {
            jacobian.set_column(column, &slope);
            continue;
        }
        let moved = |by: f64| {
            let mut numbers = at.to_vec();
            numbers[column] += by;
            residuals(&numbers)
        };
        let slope = match (moved(step), moved(-step)) {
            (Some(above), Some(below)) => (above - below) / (2.0 * step),
            (Some(above), None) => (above - centre) / step,
            (None, Some(below)) => (centre - below) / step,
            (None, None) => continue,
        };
        jacobian.set_column(column, &slope);
    }
    jacobian
}
