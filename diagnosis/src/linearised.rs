//! A fit about its values: what further columns would gain beside all that is in it.

use crate::channel::Channel;
use crate::evidence::Evidence;
use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::normal::Normal;
use crate::products::Products;

/// A term that promises a smaller fall of J is not fitted.
pub(crate) const PROMISES: f64 = 10.0;
/// Share of what is left that a term may be looked for in: the levels hold noise and misfit together.
const MISFIT: f64 = 0.3;

/// A fit in which every column answers linearly.
pub(crate) struct Linearised<'a> {
    bench: &'a Bench,
    base: &'a Fitted,
    /// Of each band.
    weights: Vec<f64>,
    /// Of what is left and all columns of the fit.
    products: Products,
    evidence: Evidence<'a>,
}

impl<'a> Linearised<'a> {
    /// Under the levels that the fit has.
    pub fn new(bench: &'a Bench, base: &'a Fitted) -> Self {
        Linearised {
            bench,
            base,
            weights: bench.weights(&base.point.levels),
            products: Products::of(&bench.bands, &base.all()),
            evidence: Evidence::new(bench, &base.point),
        }
    }

    /// What promises so little is not looked for any further: noise is left, and nothing large can hide in it.
    pub fn is_hopeless(&self, gain: f64) -> bool {
        gain < PROMISES && !self.evidence.is_misfit && !self.bench.plant.fitted
    }

    /// Σ D²/S of what is left, as far as it may be a misfit.
    pub fn misfit(&self) -> f64 {
        MISFIT * self.sum(&self.products.left(&[]))
    }

    /// Σ D²/S of a change of the spectra.
    pub fn energy(&self, change: &[f64]) -> f64 {
        self.sum(&Products::of(&self.bench.bands, &[change]).left(&[]))
    }

    fn sum(&self, energies: &[f64]) -> f64 {
        let bands = energies.iter().zip(&self.weights);
        bands.map(|(energy, weight)| energy * weight).sum()
    }

    fn with<C: AsRef<[f64]>>(&self, further: &[C]) -> Products {
        let mut all = self.base.all();
        all.extend(further.iter().map(AsRef::as_ref));
        self.products.with_further(&self.bench.bands, &all)
    }

    /// Falls of J and E with further columns, and their multiples, under the levels that are left after some rounds. `held`
    /// keeps the multiples back.
    pub fn gain<C: AsRef<[f64]>>(&self, further: &[C], held: Held, rounds: usize) -> (Gain, Vec<f64>, Vec<f64>) {
        let products = self.with(further);
        let own = self.base.all().len() - 1;
        let mut weights = self.weights.clone();
        let mut answer = (Gain::NONE, Vec::new(), Vec::new());
        for _ in 0..rounds {
            let mut normal = products.normal(&weights);
            for index in own..own + further.len() {
                let own = &mut normal.matrix[(index, index)];
                match held {
                    Held::Free => {}
                    Held::Ridge(share) => *own *= 1.0 + share,
                    Held::Unit => *own += 1.0,
                }
            }
            let pull = normal.believe(&self.base.point.composition.unknowns);
            let solution = normal.solve(&pull);
            let (gain, levels) = self.gained(&products, &solution);
            weights = self.bench.weights(&levels);
            answer = (gain, solution[own..].to_vec(), levels);
        }
        answer
    }

    /// The same of a change of the spectra just as it is.
    pub fn gain_of(&self, change: &[f64]) -> Gain {
        let products = self.with(&[change]);
        let mut normal = products.normal(&self.weights);
        let own = normal.right.len() - 1;
        normal.right -= normal.matrix.column(own);
        let mut normal = Normal {
            matrix: normal.matrix.view((0, 0), (own, own)).into_owned(),
            right: normal.right.rows(0, own).into_owned(),
        };
        let pull = normal.believe(&self.base.point.composition.unknowns);
        let mut solution = normal.solve(&pull);
        solution.push(1.0);
        self.gained(&products, &solution).0
    }

    /// Σ ln |Z|² over the channels.
    fn size(&self, energies: &[f64]) -> f64 {
        let bands = || self.bench.bands.iter().zip(energies);
        let energy = |own: &Channel| -> f64 {
            let inside = bands().filter(|(band, _)| own.places.contains(&band[0]));
            inside.map(|(_, energy)| energy).sum()
        };
        let channels = self.bench.plant.channels.iter();
        channels.map(|own| energy(own).max(f64::MIN_POSITIVE).ln()).sum()
    }

    /// What is gained, and the levels, where the columns move by a solution.
    fn gained(&self, products: &Products, solution: &[f64]) -> (Gain, Vec<f64>) {
        let here = &self.base.point;
        let left = products.left(solution);
        let levels = self.bench.levels(&left);
        let unknowns = here.composition.unknowns.iter().zip(solution);
        let surprises = unknowns.map(|(own, step)| own.surprise() + own.surprise_slope() * step);
        let prior: f64 = surprises.map(|surprise| 0.5 * surprise * surprise).sum();
        let gain = Gain {
            likelihood: here.cost - self.bench.cost(&levels) - prior,
            evidence: self.evidence.cost(here) - self.evidence.cost_of(&levels) - prior,
            size: self.size(&self.products.left(&[])) - self.size(&left),
        };
        (gain, levels)
    }
}

/// What is believed of the multiples of further columns.
#[derive(Clone, Copy)]
pub(crate) enum Held {
    Free,
    /// By a share of each column's own information.
    Ridge(f64),
    /// A standard deviation of 1 about 0.
    Unit,
}

/// By how much something explains a measurement better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    /// Fall of J.
    pub likelihood: f64,
    /// Fall of E.
    pub evidence: f64,
    /// Fall of Σ ln |Z|² over the channels: kinks that are nearly in their place leave little and stand out of every band.
    pub size: f64,
}

impl Gain {
    /// Of what cannot be.
    pub const NONE: Gain = Gain {
        likelihood: f64::NEG_INFINITY,
        evidence: f64::NEG_INFINITY,
        size: f64::NEG_INFINITY,
    };

    /// What is worth a fit: most by one measure or the other.
    pub fn either(self) -> f64 {
        self.likelihood.max(self.evidence)
    }
}
