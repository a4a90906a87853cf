//! What a measurement adds linearly: drift of the zero, lines, the gain of a field probe, what creep remembers of before the run.
//!
//! None of it is an unknown: at every simulation it is solved for under the levels of the bands (`likelihood.rs`).

use std::sync::Arc;

use anhyst_model::EffectKind;

use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::plant::Plant;
use crate::shape::Shape;
use crate::unknown::Slot;

/// Creep of a law that is faster, by the row, is over when a run begins.
const MIN_CREEP_ROWS: f64 = 10.0;

/// What enters linearly.
#[derive(Clone, Default)]
pub(crate) struct Nuisance {
    pub kinds: Vec<NuisanceKind>,
    /// Stacked spectra.
    pub columns: Vec<Arc<Vec<f64>>>,
    pub coefficients: Vec<f64>,
}

impl Nuisance {
    /// Rms of a line, by its place among the composition's.
    pub fn line_rms(&self, place: usize) -> f64 {
        let own = self.kinds.iter().zip(&self.coefficients);
        let squares = own.filter(|(kind, _)| matches!(kind, NuisanceKind::Line(line, _) if *line == place));
        (0.5 * squares.map(|(_, coefficient)| coefficient * coefficient).sum::<f64>()).sqrt()
    }
}

/// What a linear column stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NuisanceKind {
    /// Drift of an output over its rows, by channel.
    Drift(usize),
    /// Cosine and sine of a line, by its place among the composition's.
    Line(usize, bool),
    /// Gain of a field probe beyond 1, by channel.
    ProbeGain(usize),
    /// What creep remembers of before the run, by channel and by which of its times.
    CreepMemory(usize, usize),
}

/// The linear nuisance of a composition.
pub(crate) fn linear(
    plant: &Plant,
    composition: &Composition,
    simulated: &[f64],
) -> (Vec<NuisanceKind>, Vec<Arc<Vec<f64>>>) {
    let (mut kinds, mut columns) = (Vec::new(), Vec::new());
    for (index, channel) in plant.channels.iter().enumerate() {
        if channel.kind == ChannelKind::Field {
            let mut own = vec![0.0; simulated.len()];
            own[channel.places.clone()].copy_from_slice(&simulated[channel.places.clone()]);
            own[channel.places.start] = 0.0;
            kinds.push(NuisanceKind::ProbeGain(index));
            columns.push(Arc::new(own));
        }
        for (kind, shape) in shapes(plant, composition, index) {
            kinds.push(kind);
            columns.push(plant.shape(index, shape));
        }
    }
    (kinds, columns)
}

/// The time courses of the linear nuisance of a channel.
fn shapes(plant: &Plant, composition: &Composition, index: usize) -> Vec<(NuisanceKind, Shape)> {
    let channel = &plant.channels[index];
    let run = &plant.runs[channel.run];
    let Some(tick_s) = run.tick_s else {
        return Vec::new();
    };
    let rows = channel.rows.len() as f64;
    let mut shapes = Vec::new();
    for (place, line) in composition
        .lines
        .iter()
        .enumerate()
        .filter(|(_, own)| own.channel == index)
    {
        let turns = std::f64::consts::TAU * line.frequency_hz * tick_s;
        shapes.push((NuisanceKind::Line(place, false), Shape::Cosine(turns)));
        shapes.push((NuisanceKind::Line(place, true), Shape::Sine(turns)));
    }
    if channel.kind != ChannelKind::Output {
        return shapes;
    }
    if !composition.no_drift {
        shapes.push((NuisanceKind::Drift(index), Shape::Ramp(1.0 / rows)));
    }
    // What crept before a run began in an unknown state goes on in it.
    let times: Vec<f64> = composition
        .unknowns
        .iter()
        .filter(|own| matches!(own.slot, Slot::Effect(EffectKind::AfterEffect, place) if place > 0))
        .map(|own| own.value)
        .collect();
    let of_effect = match times[..] {
        [shortest, longest] => vec![longest, (shortest * longest).sqrt()],
        _ => Vec::new(),
    };
    let law = plant.model.material.law.iter();
    let of_law = law.flat_map(|law| law.model.creep.iter().map(|lag| lag.time_constant_s));
    // One beyond the run is a ramp.
    let of_law = of_law.filter(|time_s| (MIN_CREEP_ROWS * tick_s..tick_s * rows).contains(time_s));
    let creeps = of_effect.into_iter().chain(of_law);
    let creeps = creeps.filter(|time_s| *time_s < 3.0 * tick_s * rows);
    shapes.extend(
        creeps
            .enumerate()
            .map(|(own, time_s)| (NuisanceKind::CreepMemory(index, own), Shape::Decay(tick_s / time_s))),
    );
    shapes
}

/// The linear nuisance of an output over all its rows, where it was held against the first `fitted` of them.
pub(crate) fn nuisance_series(
    plant: &Plant,
    composition: &Composition,
    nuisance: &Nuisance,
    index: usize,
    fitted: usize,
) -> Vec<f64> {
    let channel = &plant.channels[index];
    let mut sum = vec![0.0; channel.rows.len()];
    let scale = |shape: Shape| match shape {
        // Its unit is the length of the fitted rows.
        Shape::Ramp(_) => Shape::Ramp(1.0 / fitted as f64),
        other => other,
    };
    for (kind, shape) in shapes(plant, composition, index) {
        let own = nuisance.kinds.iter().zip(&nuisance.coefficients);
        let Some((_, coefficient)) = own.into_iter().find(|(own, _)| **own == kind) else {
            continue;
        };
        let shape = scale(shape);
        for (row, value) in sum.iter_mut().enumerate() {
            *value += coefficient * shape.at(row as f64);
        }
    }
    sum
}
