//! Hysteresis and strain law fitted to measured loops: one parameter set for all of them, with what is known about it.
//!
//! min over (Ms, a, k, α, c) and the instrument's zeros of the joint NRMSE (`residuals.rs`), searched from many starts
//! (`search.rs`) in coordinates that part what one loop fixes from what it does not (`parameters.rs`).

use anhyst_model::{Anhysteretic, Hysteresis, MagneticState, Magnetostriction, Material};

use crate::error::IdentifyError;
use crate::modelled::{FittedLoop, Modelled};
use crate::observed::ObservedLoop;
use crate::order::ascending;
use crate::parameters::{Bounds, Coordinates, Fixed};
use crate::prepared::{PrepareOptions, PreparedRun, Start};
use crate::progress::Progress;
use crate::report::FitReport;
use crate::residuals::{Fitter, Observation};
use crate::search::{self, Effort};
use crate::simulate::{Beginning, range};
use crate::summary;
use anhyst_measured::{MeasuredError, MeasuredRun, Quantity, sweep};

/// Which anhysteretic curves to try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curves {
    Only(Anhysteretic),
    /// Both, and the one with the smaller residual wins.
    Both,
}

/// How to fit. The default fits all five parameters with both curves.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    pub curves: Curves,
    pub fixed: Vec<Fixed>,
    /// How the sweeps begin; None decides by whether each closes ([`Start`]).
    pub beginning: Option<Beginning>,
    /// Fit the instrument's zero of M of each loop.
    pub free_offset: bool,
    /// Weight of the squared strain NRMSE against that of M; 0 fits M alone and then the strain law.
    pub strain_weight: f64,
    /// None takes [`Bounds::around`] the data.
    pub bounds: Option<Bounds>,
    /// Retreat of the field that counts as a reversal, as a share of its range.
    pub reversal_threshold: f64,
    /// Random sets simulated, and how many of them are polished.
    pub candidates: usize,
    pub starts: usize,
    pub seed: u64,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            curves: Curves::Both,
            fixed: Vec::new(),
            beginning: None,
            free_offset: true,
            strain_weight: 0.0,
            bounds: None,
            reversal_threshold: sweep::DEFAULT_THRESHOLD,
            candidates: 320,
            starts: 12,
            seed: 1,
        }
    }
}

/// A fitted material, what is known about it, and the curves behind it.
#[derive(Clone, Debug)]
pub struct Fit {
    pub hysteresis: Hysteresis,
    /// λ = γM² with λs = 2γMs²/3; None where no strain was measured.
    pub magnetostriction: Option<Magnetostriction>,
    pub report: FitReport,
    pub loops: Vec<FittedLoop>,
}

impl Fit {
    /// The fitted material under a name; None where no strain was measured.
    pub fn material(&self, name: &str) -> Option<Material> {
        Some(Material {
            name: name.to_owned(),
            source: format!("fitted to {}, XXH3 {}", self.report.source, self.report.data_hash),
            hysteresis: self.hysteresis,
            magnetostriction: self.magnetostriction?,
            law: None,
        })
    }
}

/// Fits one parameter set to all loops; `progress` hears of every fifty random sets and every polished start.
pub fn fit(
    measured: &[MeasuredRun],
    options: &FitOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Fit, IdentifyError> {
    check(options)?;
    let observation = observe(measured, options)?;
    let bounds = options.bounds.unwrap_or_else(|| bounds_around(&observation));
    let effort = Effort {
        candidates: options.candidates,
        starts: options.starts,
        seed: options.seed,
    };
    let curves = match options.curves {
        Curves::Only(curve) => vec![curve],
        Curves::Both => vec![Anhysteretic::Langevin, Anhysteretic::Ising],
    };
    let coordinates = curves
        .iter()
        .map(|curve| Coordinates::new(*curve, bounds, &options.fixed))
        .collect::<Result<Vec<_>, _>>()?;
    let fitters: Vec<Fitter> = coordinates.iter().map(|own| Fitter::new(&observation, own)).collect();
    let mut searches = fitters
        .iter()
        .map(|fitter| search::search(fitter, effort, progress))
        .collect::<Result<Vec<_>, _>>()?;
    let nrmse = searches.iter().map(|polished| polished[0].nrmse());
    let tried: Vec<(Anhysteretic, f64)> = curves.iter().copied().zip(nrmse).collect();
    ascending(&mut searches, |search| search[0].nrmse());
    let best = &searches[0];
    let no_start = || IdentifyError::NoValidStart {
        candidates: effort.candidates,
        field_a_per_m: bounds.effective_shape_a_per_m.1,
        magnetization_a_per_m: bounds.saturation_magnetization_a_per_m.1,
    };
    let hysteresis = best[0].hysteresis().ok_or_else(no_start)?;
    let nuisance = best[0].nuisance();
    let modelled = Modelled::of(&observation, &hysteresis, &nuisance);
    let report = summary::report(measured, &observation, best, tried, effort, &hysteresis, &modelled);
    let magnetostriction = report.strain.map(|strain| Magnetostriction::Quadratic {
        saturation_magnetostriction: strain.saturation_magnetostriction,
    });
    Ok(Fit {
        hysteresis,
        magnetostriction,
        report,
        loops: modelled.loops(measured, &observation, &nuisance),
    })
}

fn check(options: &FitOptions) -> Result<(), IdentifyError> {
    let refuse = |what, given: f64, requirement| {
        Err(IdentifyError::BadOption {
            what,
            given,
            requirement,
        })
    };
    if options.starts == 0 || options.candidates < options.starts {
        return refuse(
            "the number of random sets",
            options.candidates as f64,
            "at least the number of starts, which is at least 1",
        );
    }
    if !(0.0..0.5).contains(&options.reversal_threshold) {
        return refuse(
            "the reversal threshold",
            options.reversal_threshold,
            "a share of the field's range, from 0 to below 0.5",
        );
    }
    if !(options.strain_weight.is_finite() && options.strain_weight >= 0.0) {
        return refuse(
            "the weight of the strain",
            options.strain_weight,
            "finite and not below 0",
        );
    }
    Ok(())
}

fn observe(measured: &[MeasuredRun], options: &FitOptions) -> Result<Observation, IdentifyError> {
    let prepare = PrepareOptions {
        reversal_threshold: options.reversal_threshold,
        ..PrepareOptions::default()
    };
    let one = |run: &MeasuredRun| {
        let run = PreparedRun::of(run, &prepare)?;
        let series = |quantity: Quantity| run.channel(quantity).map(|channel| channel.measured.clone());
        let magnetization = series(Quantity::Magnetization).ok_or_else(|| MeasuredError::NothingToFit {
            file: run.source.clone().into(),
        })?;
        Ok(ObservedLoop {
            magnetization_range_a_per_m: range(&magnetization),
            magnetization_a_per_m: magnetization,
            strain: series(Quantity::Strain),
            beginning: options.beginning.unwrap_or_else(|| Beginning::of(run.start)),
            before: match run.start {
                Start::Cycled(state) => state,
                _ => MagneticState::default(),
            },
            field_a_per_m: run.drive_a_per_m,
        })
    };
    Ok(Observation {
        loops: measured.iter().map(one).collect::<Result<_, IdentifyError>>()?,
        free_offset: options.free_offset,
        strain_weight: options.strain_weight,
    })
}

fn bounds_around(observation: &Observation) -> Bounds {
    let largest = |series: &[f64]| series.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let over_loops = |of: &dyn Fn(&ObservedLoop) -> f64| observation.loops.iter().map(of).fold(0.0_f64, f64::max);
    let field = over_loops(&|of| largest(&of.field_a_per_m));
    let magnetization = over_loops(&|of| largest(&of.magnetization_a_per_m));
    let coercive = over_loops(&coercive_field_a_per_m);
    Bounds::around(field, magnetization, coercive.clamp(1e-3 * field, field))
}

/// Half the distance between the outermost crossings of the middle of the loop, A/m.
fn coercive_field_a_per_m(of: &ObservedLoop) -> f64 {
    let (low, high) = sweep::extremes(&of.magnetization_a_per_m);
    let middle = 0.5 * (low + high);
    let samples: Vec<(f64, f64)> = of
        .field_a_per_m
        .iter()
        .copied()
        .zip(of.magnetization_a_per_m.iter().map(|m| m - middle))
        .collect();
    let crossings: Vec<f64> = samples
        .windows(2)
        .filter(|pair| pair[0].1 * pair[1].1 < 0.0)
        .map(|pair| pair[0].0 + (pair[1].0 - pair[0].0) * pair[0].1 / (pair[0].1 - pair[1].1))
        .collect();
    let (low, high) = sweep::extremes(&crossings);
    if crossings.len() < 2 { 0.0 } else { 0.5 * (high - low) }
}
