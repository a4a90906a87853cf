//! What no method could beat: likelihood ratios with everything known.
//!
//! d² = Σ (Δx/σ_x)² + Σ (ΔH/σ_H)² over all samples: Δ what the hidden effect adds to displacement and coil field, σ the noises.
//! *Seen*: effect of known size and shape against none, false alarm 1 %: power Φ(d − z), z = Φ⁻¹(0.99) (Neyman and Pearson 1933).
//! *Named*: the effect against its nearest rival, both known, equal odds: Φ(d_r/2), d_r the smallest distance from Δ to what a
//! rival can do. A rival's answers are taken as linear in its sizes, at a half, once and twice its usual shape, and for limits at the
//! size that makes the same gap; rivals that bend could come nearer, so that the naming bound is high rather than low.

use anhyst_model::{ActuatorModel, ActuatorOutputs, ParameterRole, ParameterSpec};
use serde::{Deserialize, Serialize};

use super::case::listed;
use super::sizes::{Growth, TICK_S, distance_m, run_of};
use anhyst_diagnosis::Term;

/// Φ⁻¹(0.99).
pub(super) const FALSE_ALARM_DEVIATE: f64 = 2.326_347_874;
/// Strength of a rival's probe: the smallest size worth finding.
const PROBE: f64 = 1.0;
const SHAPES: [f64; 3] = [0.5, 1.0, 2.0];

/// How far what is hidden stands out, in standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ideal {
    /// d
    pub deviations: f64,
    pub nearest_rival: String,
    /// d_r
    pub rival_deviations: f64,
}

impl Ideal {
    /// Power of the likelihood-ratio test against none at a false alarm of 1 %.
    pub fn seen(&self) -> f64 {
        normal(self.deviations - FALSE_ALARM_DEVIATE)
    }

    /// Chance of choosing the truth over its nearest rival.
    pub fn named(&self) -> f64 {
        normal(0.5 * self.rival_deviations)
    }
}

/// Φ
fn normal(x: f64) -> f64 {
    0.5 * (1.0 + libm::erf(x / std::f64::consts::SQRT_2))
}

/// The bounds for `term`, whose run is `outputs`; noises of displacement (m) and field (A/m). None where nothing can be simulated.
pub(super) fn ideal(
    nominal: &ActuatorModel,
    term: Term,
    outputs: &ActuatorOutputs,
    command: &[f64],
    noises: [f64; 2],
) -> Option<Ideal> {
    let base = run_of(nominal, command, TICK_S)?;
    let wanted = whitened(outputs, &base, noises);
    let gap_m = distance_m(outputs, &base);
    let mut nearest: Option<(f64, Term)> = None;
    for rival in listed().into_iter().filter(|rival| *rival != term) {
        for growths in directions(rival) {
            let answers = growths.iter().filter_map(|growth| {
                let model = probe(growth, nominal, command, gap_m)?;
                Some(whitened(&run_of(&model, command, TICK_S)?, &base, noises))
            });
            let left = left_over(&wanted, answers.collect());
            if nearest.is_none_or(|(least, _)| left < least) {
                nearest = Some((left, rival));
            }
        }
    }
    let (rival_deviations, rival) = nearest?;
    Some(Ideal {
        deviations: dot(&wanted, &wanted).sqrt(),
        nearest_rival: rival.name().to_owned(),
        rival_deviations,
    })
}

/// Sets of growths that a rival can mix.
fn directions(term: Term) -> Vec<Vec<Growth>> {
    let Term::Effect(kind) = term else {
        return vec![vec![Growth::of_size(term, 0, 1.0)]];
    };
    let parameters = kind.parameters();
    let shaped = parameters.iter().any(|own| own.role == ParameterRole::Shape);
    let shapes: &[f64] = if shaped { &SHAPES } else { &[1.0] };
    let sizes = parameters
        .iter()
        .enumerate()
        .filter(|(_, own)| own.identity().is_some());
    let sizes: Vec<usize> = sizes.map(|(place, _)| place).collect();
    let of_shape = |shape: &f64| {
        sizes
            .iter()
            .map(|place| Growth::of_size(term, *place, *shape))
            .collect()
    };
    shapes.iter().map(of_shape).collect()
}

fn probe(growth: &Growth, nominal: &ActuatorModel, command: &[f64], gap_m: f64) -> Option<ActuatorModel> {
    let limit = match growth.term {
        Term::Effect(kind) => kind.parameters().first().is_some_and(ParameterSpec::is_limit),
        Term::Parameter(_) => false,
    };
    if limit {
        Some(growth.of_gap(nominal, command, TICK_S, gap_m)?.model)
    } else {
        Some(growth.at(nominal, PROBE)?.0)
    }
}

fn whitened(outputs: &ActuatorOutputs, base: &ActuatorOutputs, [output_m, field_a_per_m]: [f64; 2]) -> Vec<f64> {
    let x = outputs.displacement_m.iter().zip(&base.displacement_m);
    let h = outputs.field_a_per_m.iter().zip(&base.field_a_per_m);
    x.map(|(one, other)| (one - other) / output_m)
        .chain(h.map(|(one, other)| (one - other) / field_a_per_m))
        .collect()
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

/// Length of what is left of `wanted` beside the directions' span.
fn left_over(wanted: &[f64], directions: Vec<Vec<f64>>) -> f64 {
    let mut left = wanted.to_vec();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(directions.len());
    for mut direction in directions {
        for own in &basis {
            take_away(&mut direction, own);
        }
        let length = dot(&direction, &direction).sqrt();
        if length > 0.0 && length.is_finite() {
            direction.iter_mut().for_each(|value| *value /= length);
            take_away(&mut left, &direction);
            basis.push(direction);
        }
    }
    dot(&left, &left).sqrt()
}

/// Takes away the part along a unit vector.
fn take_away(vector: &mut [f64], unit: &[f64]) {
    let share = dot(vector, unit);
    for (value, own) in vector.iter_mut().zip(unit) {
        *value -= share * own;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards both bounds against tables of the normal distribution.
    #[test]
    fn powers_are_those_of_the_table() {
        let at = |deviations, rival_deviations| Ideal {
            deviations,
            nearest_rival: String::new(),
            rival_deviations,
        };
        assert!((at(FALSE_ALARM_DEVIATE, 0.0).seen() - 0.5).abs() < 1e-12);
        assert!((at(0.0, 0.0).seen() - 0.01).abs() < 1e-8);
        assert!((at(0.0, 0.0).named() - 0.5).abs() < 1e-12);
        assert!((at(0.0, 3.289_707).named() - 0.95).abs() < 1e-6);
    }

    /// Guards the projection: what lies within the span of two slanting directions leaves nothing.
    #[test]
    fn only_what_stands_out_is_left() {
        let directions = || vec![vec![1.0, 0.0, 0.0], vec![1.0, 1.0, 0.0]];
        assert!(left_over(&[3.0, -2.0, 0.0], directions()) < 1e-12);
        assert!((left_over(&[3.0, -2.0, 4.0], directions()) - 4.0).abs() < 1e-12);
    }
}
