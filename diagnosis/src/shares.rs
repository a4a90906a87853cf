//! The gap and its parts: what each contributes to the output, and which share of the gap that is.
//!
//! Gap g = measured − simulated(model as given), each without its mean, over the compared rows of the output. A part's contribution c is
//! what the simulation loses without it, everything else as fitted; its share ⟨c, g⟩/⟨g, g⟩ may be negative, or above 1 where parts
//! work against each other. The shares of all parts and of what is left add up to 1 as far as the parts add up.

use anhyst_identify::parallel;
use anhyst_model::ActuatorModel;

use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::fitting::Fitted;
use crate::likelihood::{Bench, Point};
use crate::nuisance::NuisanceKind;
use crate::plant::Steps;
use crate::statistics::rms;
use crate::term::Term;
use crate::unknown::Slot;

/// The part that is the drift of an output's zero.
pub(crate) const DRIFT: &str = "drift_of_zero";

/// A part of the gap, by run.
#[derive(Clone, Debug)]
pub struct Contribution {
    pub name: String,
    pub kind: ContributionKind,
    /// In the output's unit, over the compared rows of each run.
    pub series: Vec<Vec<f64>>,
}

/// What a part of the gap is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContributionKind {
    Effect,
    Nuisance,
    Parameter,
}

/// Measured minus model as given, means taken off, by output channel.
pub(crate) struct Gap {
    series: Vec<Vec<f64>>,
}

impl Gap {
    pub fn of(bench: &Bench) -> Self {
        let plant = &bench.plant;
        let runs = plant.simulate(&Composition::default(), Steps::Made).unwrap_or_default();
        let series = plant.outputs().map(|(index, channel)| {
            let model = runs
                .get(channel.run)
                .map(|run| &plant.series(channel, run)[channel.rows.clone()]);
            let measured = &plant.measured[index];
            let gap = match model {
                Some(model) => measured.iter().zip(model).map(|(y, m)| y - m).collect(),
                None => measured.clone(),
            };
            centred(gap)
        });
        Gap {
            series: series.collect(),
        }
    }

    fn energy(&self) -> f64 {
        self.series.iter().flatten().map(|own| own * own).sum()
    }

    pub fn rms(&self) -> f64 {
        rms(self.series.iter().flatten().copied())
    }

    /// ⟨c, g⟩/⟨g, g⟩.
    pub fn share(&self, part: &[Vec<f64>]) -> f64 {
        let pairs = self.series.iter().flatten().zip(part.iter().flatten());
        pairs.map(|(g, c)| g * c).sum::<f64>() / self.energy().max(f64::MIN_POSITIVE)
    }

    /// 1 − |r|²/|g|².
    pub fn explained(&self, bench: &Bench, point: &Point) -> f64 {
        1.0 - bench.output_energy(&point.residual) / self.energy().max(f64::MIN_POSITIVE)
    }
}

pub(crate) fn centred(mut series: Vec<f64>) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
    series.iter_mut().for_each(|own| *own -= mean);
    series
}

/// Rms of what is left of the outputs.
pub(crate) fn remainder_rms(bench: &Bench, point: &Point) -> f64 {
    let rows: usize = bench.plant.outputs().map(|(_, channel)| channel.rows.len()).sum();
    (bench.output_energy(&point.residual) / rows as f64).sqrt()
}

/// What the outputs lose without something, means taken off.
pub(crate) fn without(bench: &Bench, point: &Point, composition: &Composition) -> Option<Vec<Vec<f64>>> {
    let runs = bench.plant.simulate(composition, Steps::Made)?;
    let plant = &bench.plant;
    let series = plant.outputs().map(|(_, channel)| {
        let with = &plant.series(channel, &point.runs[channel.run])[channel.rows.clone()];
        let lost = &plant.series(channel, &runs[channel.run])[channel.rows.clone()];
        centred(with.iter().zip(lost).map(|(with, lost)| with - lost).collect())
    });
    Some(series.collect())
}

/// All parts of what is modelled.
pub(crate) fn contributions(bench: &Bench, model: &ActuatorModel, last: &Fitted) -> Vec<Contribution> {
    let composition = &last.point.composition;
    let mut parts: Vec<(String, ContributionKind, Composition)> = Vec::new();
    for term in composition.terms() {
        let mut lost = composition.clone();
        match term {
            Term::Effect(_) => lost = composition.without(term, model),
            Term::Parameter(parameter) => reset(&mut lost, Slot::Nominal(parameter)),
        }
        parts.push((term.name().to_owned(), ContributionKind::Effect, lost));
    }
    for unknown in &composition.unknowns {
        let (name, kind) = match unknown.slot {
            Slot::Nominal(parameter) if !composition.freed.contains(&parameter) => {
                (parameter.term().to_owned(), ContributionKind::Parameter)
            }
            Slot::Start(run) => (format!("magnetic_start_{}", run + 1), ContributionKind::Nuisance),
            Slot::DriveZero => ("drive_zero".to_owned(), ContributionKind::Nuisance),
            Slot::ShapeOffset(run) => (format!("shape_offset_{}", run + 1), ContributionKind::Nuisance),
            Slot::ShapeDrift(run) => (format!("shape_drift_{}", run + 1), ContributionKind::Nuisance),
            _ => continue,
        };
        let mut lost = composition.clone();
        reset(&mut lost, unknown.slot);
        if let Slot::Start(run) = unknown.slot {
            reset(&mut lost, Slot::Turn(run));
        }
        parts.push((name, kind, lost));
    }
    if composition.fitted_low_pass(ChannelKind::Output).is_some() {
        let mut lost = composition.clone();
        lost.low_passes.retain(|(kind, _)| *kind != ChannelKind::Output);
        parts.push(("recorder_low_pass".to_owned(), ContributionKind::Nuisance, lost));
    }
    let simulated = parallel::map(bench.threads, &parts, |(name, kind, lost)| {
        Some(Contribution {
            name: name.clone(),
            kind: *kind,
            series: without(bench, &last.point, lost)?,
        })
    });
    let mut all: Vec<Contribution> = simulated.into_iter().flatten().collect();
    all.extend(linear_contributions(bench, last));
    all
}

/// Puts a number back to what was believed of it.
fn reset(composition: &mut Composition, slot: Slot) {
    if let Some(own) = composition.unknowns.iter_mut().find(|own| own.slot == slot)
        && let Some((mean, _)) = own.coordinate.prior
    {
        own.value = mean;
    }
}

/// Of what enters linearly into the outputs; what belongs together is one.
pub(crate) fn linear_contributions(bench: &Bench, last: &Fitted) -> Vec<Contribution> {
    let nuisance = &last.point.nuisance;
    let mut all: Vec<Contribution> = Vec::new();
    for ((kind, column), coefficient) in nuisance.kinds.iter().zip(&nuisance.columns).zip(&nuisance.coefficients) {
        let name = match kind {
            NuisanceKind::Drift(_) => DRIFT.to_owned(),
            NuisanceKind::Line(place, _) => {
                let line = last.point.composition.lines[*place];
                if bench.plant.channels[line.channel].kind != ChannelKind::Output {
                    continue;
                }
                line_name(line.frequency_hz)
            }
            NuisanceKind::CreepMemory(..) => "creep_from_before".to_owned(),
            // It is not in the output.
            NuisanceKind::ProbeGain(_) => continue,
        };
        let series: Vec<Vec<f64>> = bench
            .plant
            .outputs()
            .map(|(_, channel)| {
                let own = channel.spectrum.back(&column[channel.places.clone()]);
                own.into_iter().map(|value| coefficient * value).collect()
            })
            .collect();
        match all.iter_mut().find(|own| own.name == name) {
            Some(own) => {
                for (sum, more) in own.series.iter_mut().flatten().zip(series.iter().flatten()) {
                    *sum += more;
                }
            }
            None => all.push(Contribution {
                name,
                kind: ContributionKind::Nuisance,
                series,
            }),
        }
    }
    all
}

pub(crate) fn line_name(frequency_hz: f64) -> String {
    format!("line_{frequency_hz:.2}_hz")
}
