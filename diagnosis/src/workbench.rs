//! Fits of sets of terms to the observation, and what they are worth.
//!
//! BIC = χ² + n ln N with χ² over the N training rows and n fitted numbers; the held-out rows are only predicted, by
//! the same free-running simulation. Lower is better; 6 apart is strong evidence (Kass and Raftery 1995).

use anhyst_model::ActuatorModel;

use anhyst_identify::engine::{Coordinate, Problem, Solution, Stop};
use anhyst_identify::parallel;

use crate::observation::Observation;
use crate::statistics::rms;
use crate::system::{ChannelKind, Setting, System};
use crate::term::Term;

/// Simulator, data and nominal model side by side.
pub(crate) struct Workbench<'a> {
    pub system: &'a dyn System,
    pub model: &'a ActuatorModel,
    pub observation: &'a Observation,
    /// Linear columns of every fit: the instruments' zeros and what else is let free.
    pub linear: Vec<Vec<f64>>,
    pub threads: usize,
    /// See [`crate::probes::Surroundings`].
    pub lattice: Option<f64>,
}

/// Terms fitted to the training rows.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub settings: Vec<Setting>,
    pub solution: Solution,
    pub bic: f64,
    /// χ² of the held-out rows over their number.
    pub held_out_chi_square: f64,
    /// Rms of the output's residual on the held-out rows, in its unit; all runs together.
    pub held_out_rms: f64,
    /// Standard deviations of all values, infinite until [`Workbench::deviations`] was asked.
    pub deviations: Vec<f64>,
}

impl Fitted {
    pub fn terms(&self) -> Vec<Term> {
        self.settings.iter().map(|setting| setting.term).collect()
    }

    pub fn has(&self, term: Term) -> bool {
        self.settings.iter().any(|setting| setting.term == term)
    }

    /// Names joined as a table shows them.
    pub fn name(&self) -> String {
        if self.settings.is_empty() {
            return "none".to_owned();
        }
        self.settings
            .iter()
            .map(|setting| setting.term.name())
            .collect::<Vec<_>>()
            .join(" + ")
    }

    /// Standard deviations of one setting's values.
    pub fn deviations_of(&self, index: usize) -> &[f64] {
        let from: usize = self.settings[..index].iter().map(|setting| setting.values.len()).sum();
        &self.deviations[from..from + self.settings[index].values.len()]
    }
}

impl Workbench<'_> {
    /// Whitened outputs.
    pub fn simulate(&self, settings: &[Setting]) -> Option<Vec<f64>> {
        Some(self.observation.whiten(self.system.outputs(settings)?))
    }

    /// The terms from their values in `settings`; `with_priors` where all nominal parameters are calibrated.
    pub fn fit(&self, settings: &[Setting], with_priors: bool, threads: usize) -> Option<Fitted> {
        self.fit_on(settings, with_priors, threads, &self.observation.training)
    }

    /// The same on other rows.
    pub fn fit_on(
        &self,
        settings: &[Setting],
        with_priors: bool,
        threads: usize,
        rows: &[std::ops::Range<usize>],
    ) -> Option<Fitted> {
        let coordinates = self.coordinates(settings, with_priors)?;
        let model = |values: &[f64]| self.simulate(&with_values(settings, values));
        let problem = Problem {
            measured: &self.observation.whitened,
            training: rows,
            linear: &self.linear,
            coordinates: &coordinates,
            simulator: &model,
            stop: Stop::CHANCE,
            threads,
        };
        let start: Vec<f64> = settings
            .iter()
            .flat_map(|setting| setting.values.iter().copied())
            .collect();
        let solution = problem.solve(&start)?;
        Some(self.judged(with_values(settings, &solution.values), solution, rows))
    }

    fn coordinates(&self, settings: &[Setting], with_priors: bool) -> Option<Vec<Coordinate>> {
        let mut coordinates: Vec<Coordinate> = Vec::new();
        for setting in settings {
            let mut own: Vec<Coordinate> = setting.term.specs(self.model)?.iter().map(Coordinate::of).collect();
            if setting.term.is_lattice() {
                // The model's answer to its step has no derivative.
                for (coordinate, step) in own.iter_mut().zip(&setting.values) {
                    (coordinate.lower, coordinate.upper) = (*step, *step);
                }
            }
            coordinates.extend(own);
        }
        if !with_priors {
            coordinates.iter_mut().for_each(|coordinate| coordinate.prior = None);
        }
        Some(coordinates)
    }

    /// How well some rows fix a fit's values.
    pub fn deviations(&self, fit: &Fitted, with_priors: bool, rows: &[std::ops::Range<usize>]) -> Vec<f64> {
        let coordinates = self.coordinates(&fit.settings, with_priors).unwrap_or_default();
        let covariance = fit.solution.covariance(&coordinates, rows);
        (0..fit.solution.values.len())
            .map(|index| covariance.standard_deviation(index))
            .collect()
    }

    fn judged(&self, settings: Vec<Setting>, solution: Solution, rows: &[std::ops::Range<usize>]) -> Fitted {
        let numbers = solution.columns.len() as f64;
        let count: usize = rows.iter().map(ExactSizeIterator::len).sum();
        let held_out = &self.observation.held_out;
        let chi_square = held_out
            .iter()
            .flat_map(|range| &solution.residual[range.clone()])
            .map(|z| z * z)
            .sum::<f64>();
        let held_out_rows: usize = held_out.iter().map(ExactSizeIterator::len).sum();
        Fitted {
            bic: solution.chi_square + numbers * (count as f64).ln(),
            held_out_chi_square: chi_square / held_out_rows.max(1) as f64,
            held_out_rms: self.output_rms(&solution.residual, held_out),
            deviations: vec![f64::INFINITY; solution.values.len()],
            settings,
            solution,
        }
    }

    /// Rms of the output channels on some rows, in their unit.
    pub fn output_rms(&self, residual: &[f64], rows: &[std::ops::Range<usize>]) -> f64 {
        let observation = self.observation;
        let gap = observation.unwhiten(residual.to_vec());
        let outputs = observation.of_kind(ChannelKind::Output);
        let ranges = outputs.flat_map(|channel| observation.rows_in(channel, rows));
        rms(ranges.flat_map(|range| gap[range].iter().copied()))
    }

    /// Several fits side by side; those that the model refuses are left out.
    pub fn fit_all(&self, starts: &[Vec<Setting>], with_priors: bool) -> Vec<Fitted> {
        let fits = parallel::map(self.threads, starts, |settings| self.fit(settings, with_priors, 1));
        fits.into_iter().flatten().collect()
    }
}

/// The same terms with values from one list.
fn with_values(settings: &[Setting], values: &[f64]) -> Vec<Setting> {
    let mut rest = values;
    settings
        .iter()
        .map(|setting| {
            let (own, others) = rest.split_at(setting.values.len().min(rest.len()));
            rest = others;
            Setting {
                term: setting.term,
                values: own.to_vec(),
            }
        })
        .collect()
}
