//! y = model + rod[Σ c_i h_i(s)]: what no effect of the library explains, as a curve over one signal of the simulated run.
//!
//! h_i are hats on knots (1 on knot i, 0 on its neighbours, straight between; the ends stay), s the magnetization, the tip's velocity
//! (signed root), time, the field's rate (signed root), or the output itself; the curve acts as strain through the rod, over the output
//! behind it. It competes with the library on the same likelihood, at a price per coefficient.

use anhyst_identify::order::descending;
use anhyst_identify::parallel;
use anhyst_identify::prepared::PreparedRun;
use anhyst_model::{ActuatorOutputs, RodMotion, RodState, TwoPolePropagator};
use serde::{Deserialize, Serialize};

use crate::channel::ChannelKind;
use crate::evidence::Evidence;
use crate::fitting::Fitted;
use crate::likelihood::Bench;
use crate::linearised::{Held, Linearised};
use crate::statistics::{quantile, rms, sorted};

/// Of J, for each coefficient.
const PRICE: f64 = 5.0;
/// Holds coefficients back that nothing determines, as a share of their own energy.
const RIDGE: f64 = 1e-6;
/// In which levels and curve settle on each other.
const ROUNDS: usize = 2;

/// Over what a curve stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Over {
    Magnetization,
    Velocity,
    Time,
    Rate,
    Output,
}

impl Over {
    const ALL: [Over; 5] = [
        Over::Magnetization,
        Over::Velocity,
        Over::Time,
        Over::Rate,
        Over::Output,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Over::Magnetization => "magnetization",
            Over::Velocity => "velocity of the output",
            Over::Time => "time",
            Over::Rate => "rate of the field",
            Over::Output => "output itself",
        }
    }

    fn count(self) -> usize {
        match self {
            Over::Magnetization | Over::Output => 25,
            Over::Velocity | Over::Rate => 13,
            Over::Time => 9,
        }
    }

    fn signal(self, run: &PreparedRun, outputs: &ActuatorOutputs, output: &[f64]) -> Option<Vec<f64>> {
        let change = |series: &[f64]| {
            let differences = (0..series.len()).map(|k| series[k] - series[k.saturating_sub(1)]);
            differences.map(|own| own.abs().sqrt().copysign(own)).collect()
        };
        Some(match self {
            Over::Magnetization => outputs.magnetization_a_per_m.clone(),
            Over::Output => output.to_vec(),
            Over::Velocity | Over::Rate | Over::Time if run.tick_s.is_none() => return None,
            Over::Velocity => change(output),
            Over::Rate => change(&outputs.field_a_per_m),
            Over::Time => (0..output.len()).map(|row| row as f64).collect(),
        })
    }
}

/// A fitted curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeCurve {
    pub over: Over,
    /// Of the signal; of a velocity or rate its signed root, per row.
    pub knots: Vec<f64>,
    /// At rest, in the output's unit.
    pub values: Vec<f64>,
    /// Rms of its contribution.
    pub rms: f64,
}

/// What explains the gap and has no name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnknownTerm {
    pub curves: Vec<FreeCurve>,
    /// Of the gap's energy.
    pub share_of_energy_explained: f64,
}

/// The curve that gains most.
pub(crate) struct Unlisted {
    /// Fall of J, its price taken off.
    pub gain: f64,
    /// More than noise is left beside it.
    pub is_misfit: bool,
    pub curve: FreeCurve,
}

/// What each curve gains beside a fit, best first.
pub(crate) fn unlisted(bench: &Bench, base: &Fitted) -> Vec<Unlisted> {
    let linear = Linearised::new(bench, base);
    let curves = parallel::map(bench.threads, &Over::ALL, |over| one(bench, base, &linear, *over));
    let mut found: Vec<Unlisted> = curves.into_iter().flatten().collect();
    // What a fit that is held at a bound would gain without any curve is no curve's.
    let (bare, _, _) = linear.gain::<Vec<f64>>(&[], Held::Ridge(RIDGE), ROUNDS);
    for own in &mut found {
        own.gain -= bare.likelihood;
    }
    descending(&mut found, |own| own.gain);
    found
}

fn one(bench: &Bench, base: &Fitted, linear: &Linearised, over: Over) -> Option<Unlisted> {
    let plant = &bench.plant;
    let outputs: Vec<_> = plant.outputs().map(|(_, channel)| channel).collect();
    let signals: Vec<Vec<f64>> = outputs
        .iter()
        .map(|channel| {
            let run = &base.point.runs[channel.run];
            over.signal(&plant.runs[channel.run], run, plant.series(channel, run))
        })
        .collect::<Option<_>>()?;
    let all = sorted(signals.iter().flatten().copied());
    let (low, high) = (*all.first()?, *all.last()?);
    let count = over.count();
    let mut knots: Vec<f64> = match over {
        // As many samples on each: the ends of a rate are rare.
        Over::Velocity | Over::Rate => (0..count)
            .map(|own| quantile(&all, own as f64 / (count - 1) as f64))
            .collect(),
        _ => (0..count)
            .map(|own| low + (high - low) * own as f64 / (count - 1) as f64)
            .collect(),
    };
    knots.dedup_by(|one, other| (*one - *other).abs() <= 1e-6 * (high - low));
    if knots.len() < 4 {
        return None;
    }
    // A constant is the zero's, so the first hat is left out.
    let series: Vec<Vec<Vec<f64>>> = (1..knots.len())
        .map(|knot| {
            let of_run = outputs.iter().zip(&signals).map(|(channel, signal)| {
                let hat: Vec<f64> = signal.iter().map(|value| hat(&knots, knot, *value)).collect();
                let through = if over == Over::Output {
                    hat
                } else {
                    through_rod(bench, channel.run, hat)
                };
                let mut through = through;
                if let Some(low_pass) = base.point.composition.fitted_low_pass(ChannelKind::Output) {
                    plant.filter(&mut through, channel.run, low_pass, None);
                }
                through
            });
            of_run.collect()
        })
        .collect();
    let columns: Vec<Vec<f64>> = series
        .iter()
        .map(|runs| {
            let mut stacked = vec![0.0; plant.length()];
            for (channel, series) in outputs.iter().zip(runs) {
                for (own, value) in stacked
                    .iter_mut()
                    .zip(plant.stacked(channel, &series[channel.rows.clone()]))
                {
                    *own += value;
                }
            }
            stacked
        })
        .collect();
    let (gain, multiples, levels) = linear.gain(&columns, Held::Ridge(RIDGE), ROUNDS);
    let contribution = (0..outputs.len()).flat_map(|run| {
        let mut sum = vec![0.0; series[0][run].len()];
        for (series, multiple) in series.iter().zip(&multiples) {
            for (own, value) in sum.iter_mut().zip(&series[run]) {
                *own += multiple * value;
            }
        }
        sum
    });
    let values = std::iter::once(0.0).chain(multiples.iter().copied()).collect();
    Some(Unlisted {
        gain: gain.likelihood - PRICE * columns.len() as f64,
        is_misfit: Evidence::new(bench, &base.point).is_misfit_at(&levels),
        curve: FreeCurve {
            over,
            knots,
            values,
            rms: rms(contribution),
        },
    })
}

/// 1 on its knot, 0 on the neighbours.
fn hat(knots: &[f64], knot: usize, value: f64) -> f64 {
    let at = knots[knot];
    if value >= at {
        knots
            .get(knot + 1)
            .map_or(1.0, |next| (1.0 - (value - at) / (next - at)).max(0.0))
    } else {
        let before = knots[knot - 1];
        (1.0 - (at - value) / (at - before)).max(0.0)
    }
}

/// What a strain that moves the resting tip by `series` makes of it.
fn through_rod(bench: &Bench, run: usize, series: Vec<f64>) -> Vec<f64> {
    let rod = bench.plant.model.rod.filter(|_| !bench.plant.magnetic());
    let Some((rod, tick_s)) = rod.zip(bench.plant.runs[run].tick_s) else {
        return series;
    };
    let Ok(propagator) = TwoPolePropagator::new(rod, tick_s) else {
        return series;
    };
    let first = series.first().copied().unwrap_or(0.0);
    let mut motion = RodMotion {
        state: RodState {
            displacement_m: first,
            velocity_m_per_s: 0.0,
        },
        acceleration: rod.stiffness_per_s2 * first,
    };
    series
        .iter()
        .map(|value| motion.advance(&propagator, rod.stiffness_per_s2 * value))
        .collect()
}
