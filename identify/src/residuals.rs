//! z = (measured, model)/(range·√n·√L): what the fit compares, so that χ² is the joint NRMSE squared.
//!
//! NRMSE of a loop = rms of the residual over the loop's measured range (largest − smallest); joint NRMSE = root of
//! the mean of the squares over L loops, so a small loop counts as much as a large one. n samples per loop.
//! The model runs freely: it hears the field and never the measured response. Unknowns beside the material's
//! parameters: the instrument's zero of M of each loop, which is a linear column, and the first true M of a loop that does not
//! begin demagnetised.
//! The strain law λ = γM² + λ0 is linear in γ and λ0, so it is solved for at every evaluation (variable projection,
//! Golub & Pereyra 1973) and adds its own block where the strain has weight.

use std::ops::Range;

use anhyst_model::Hysteresis;

use crate::engine::{Coordinate, Problem, Simulator, Solution, Stop};
use crate::observed::{Nuisance, ObservedLoop};
use crate::parameters::Coordinates;
use crate::simulate::{self, Beginning};
use crate::strain::StrainLaw;

/// A first M that is fitted lies within this many ranges of the first measured one, and moves in parts of it.
const START: Coordinate = Coordinate {
    lower: -2.0,
    upper: 2.0,
    scale: 1e-2,
    logarithmic: false,
    prior: None,
};

/// The measurement, and which of its own unknowns are free.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    pub loops: Vec<ObservedLoop>,
    pub free_offset: bool,
    pub strain_weight: f64,
}

impl Observation {
    /// The first M of a loop is a number of the fit: unknown, or the first measured one less a free zero.
    fn has_free_start(&self, of: &ObservedLoop) -> bool {
        match of.beginning {
            Beginning::Cycled => false,
            Beginning::Measured => self.free_offset,
            Beginning::Fitted => true,
        }
    }

    fn free_starts(&self) -> usize {
        self.loops.iter().filter(|of| self.has_free_start(of)).count()
    }

    /// The zero of a loop that begins as measured also shifts its first true M, so it is no linear column.
    fn has_linear_offset(&self, of: &ObservedLoop) -> bool {
        self.free_offset && of.beginning != Beginning::Measured
    }

    /// From what was fitted: numbers of the loops that have one, and coefficients of the linear columns.
    fn nuisance(&self, starts: &[f64], coefficients: &[f64]) -> Nuisance {
        let (mut starts, mut coefficients) = (starts.iter().copied(), coefficients.iter().copied());
        let mut nuisance = Nuisance::default();
        for of in &self.loops {
            let start = if self.has_free_start(of) { starts.next() } else { None }.unwrap_or_default();
            let linear = self.has_linear_offset(of).then(|| coefficients.next()).flatten();
            nuisance.start.push(start);
            nuisance.offset.push(match of.beginning {
                Beginning::Measured => -start,
                Beginning::Cycled | Beginning::Fitted => linear.unwrap_or_default(),
            });
        }
        nuisance
    }

    /// True M along every loop, A/m.
    pub fn magnetizations(&self, hysteresis: &Hysteresis, start: &[f64]) -> Vec<Vec<f64>> {
        let along = |(of, start): (&ObservedLoop, &f64)| {
            let mut magnetization = Vec::with_capacity(of.field_a_per_m.len());
            if of.beginning == Beginning::Cycled {
                simulate::cycled(hysteresis, of.before, &of.field_a_per_m, &mut magnetization);
            } else {
                let first = of.magnetization_a_per_m.first().copied().unwrap_or_default();
                let true_first = first + of.magnetization_range_a_per_m * start;
                simulate::from_first(hysteresis, &of.field_a_per_m, true_first, &mut magnetization);
            }
            magnetization
        };
        self.loops.iter().zip(start).map(along).collect()
    }

    /// 1/(√n·√L).
    fn weight(&self, of: &ObservedLoop) -> f64 {
        1.0 / (self.loops.len() as f64 * of.field_a_per_m.len() as f64).sqrt()
    }

    fn strains(&self) -> impl Iterator<Item = &[f64]> {
        let weighs = self.strain_weight > 0.0;
        self.loops
            .iter()
            .filter_map(move |of| of.strain.as_deref().filter(|_| weighs))
    }

    fn strain_scale(&self, strain: &[f64]) -> f64 {
        (self.strain_weight / (self.strains().count() as f64 * strain.len() as f64)).sqrt() / simulate::range(strain)
    }

    /// Magnetization of every loop first, then strain where it has weight.
    fn measured(&self) -> Vec<f64> {
        let magnetization = self.loops.iter().flat_map(|of| {
            let scale = self.weight(of) / of.magnetization_range_a_per_m;
            of.magnetization_a_per_m.iter().map(move |m| scale * m)
        });
        let strain = self.strains().flat_map(|strain| {
            let scale = self.strain_scale(strain);
            strain.iter().map(move |own| scale * own)
        });
        magnetization.chain(strain).collect()
    }

    fn modelled(&self, hysteresis: &Hysteresis, nuisance: &Nuisance) -> Option<Vec<f64>> {
        let magnetizations = self.magnetizations(hysteresis, &nuisance.start);
        let mut modelled = Vec::new();
        for ((of, model), offset) in self.loops.iter().zip(&magnetizations).zip(&nuisance.offset) {
            let (weight, range) = (self.weight(of), of.magnetization_range_a_per_m);
            modelled.extend(model.iter().map(|m| weight * (m / range + offset)));
        }
        if self.strain_weight > 0.0
            && let Some(law) = StrainLaw::solve(&self.loops, &magnetizations)
        {
            for (index, (of, model)) in self.loops.iter().zip(&magnetizations).enumerate() {
                let Some(strain) = &of.strain else { continue };
                let scale = self.strain_scale(strain);
                modelled.extend(law.along(index, model).iter().map(|own| scale * own));
            }
        }
        modelled.iter().all(|value| value.is_finite()).then_some(modelled)
    }

    /// Rows of each loop's magnetization, then of each strain that has weight.
    fn blocks(&self) -> Vec<Range<usize>> {
        let lengths = self.loops.iter().map(|of| of.field_a_per_m.len());
        let mut end = 0;
        lengths
            .chain(self.strains().map(<[f64]>::len))
            .map(|length| {
                end += length;
                end - length..end
            })
            .collect()
    }
}

/// The material's numbers and the loops' starts as a least-squares problem.
pub(crate) struct Fitter<'a> {
    pub observation: &'a Observation,
    pub coordinates: &'a Coordinates,
    pub blocks: Vec<Range<usize>>,
    /// Of the material, then of the starts.
    pub all: Vec<Coordinate>,
    measured: Vec<f64>,
    linear: Vec<Vec<f64>>,
}

impl<'a> Fitter<'a> {
    pub fn new(observation: &'a Observation, coordinates: &'a Coordinates) -> Self {
        let (measured, blocks) = (observation.measured(), observation.blocks());
        let with_offset = observation.loops.iter().zip(&blocks);
        let linear = with_offset
            .filter(|(of, _)| observation.has_linear_offset(of))
            .map(|(of, rows)| {
                let mut column = vec![0.0; measured.len()];
                column[rows.clone()].fill(observation.weight(of));
                column
            })
            .collect();
        let mut all = coordinates.axes().to_vec();
        all.extend(vec![START; observation.free_starts()]);
        Fitter {
            observation,
            coordinates,
            blocks,
            all,
            measured,
            linear,
        }
    }

    fn problem(&self, stop: Stop) -> Problem<'_> {
        Problem {
            measured: &self.measured,
            training: &self.blocks,
            linear: &self.linear,
            coordinates: &self.all,
            simulator: self,
            stop,
            threads: 1,
        }
    }

    /// Joint NRMSE of a set of material numbers, with all starts as measured; None where it is not valid.
    pub fn nrmse(&self, material: &[f64], stop: Stop) -> Option<f64> {
        Some(self.problem(stop).cost(&self.with_starts(material))?.sqrt())
    }

    pub fn polished(&self, material: &[f64], stop: Stop) -> Option<Polished<'_>> {
        let solution = self.problem(stop).solve(&self.with_starts(material))?;
        Some(Polished { fitter: self, solution })
    }

    fn with_starts(&self, numbers: &[f64]) -> Vec<f64> {
        let mut all = numbers.to_vec();
        all.resize(self.all.len(), 0.0);
        all
    }
}

impl Simulator for Fitter<'_> {
    fn outputs(&self, values: &[f64]) -> Option<Vec<f64>> {
        let (material, starts) = values.split_at(self.coordinates.count());
        let hysteresis = self.coordinates.hysteresis(material)?;
        self.observation
            .modelled(&hysteresis, &self.observation.nuisance(starts, &[]))
    }
}

/// A start that was brought to its end.
#[derive(Clone)]
pub(crate) struct Polished<'a> {
    pub fitter: &'a Fitter<'a>,
    pub solution: Solution,
}

impl Polished<'_> {
    /// Joint NRMSE (with the strain's share where it has weight).
    pub fn nrmse(&self) -> f64 {
        self.solution.chi_square.sqrt()
    }

    pub fn material_numbers(&self) -> &[f64] {
        &self.solution.values[..self.fitter.coordinates.count()]
    }

    pub fn hysteresis(&self) -> Option<Hysteresis> {
        self.fitter.coordinates.hysteresis(self.material_numbers())
    }

    pub fn nuisance(&self) -> Nuisance {
        let starts = &self.solution.values[self.fitter.coordinates.count()..];
        self.fitter.observation.nuisance(starts, &self.solution.coefficients)
    }
}
