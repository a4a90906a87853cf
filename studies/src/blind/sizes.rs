//! A model with a term at the size that makes a wanted gap: rms of the displacement with the term minus that without.
//!
//! Sizes grow together with one strength, each by a drawn weight and sign; shapes are drawn around their usual value. The strength is
//! found by tripling and halving until the gap is within a hundredth of the wanted one.

use anhyst_model::{ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, ParameterRole, simulate};

use super::draw::Draw;
use anhyst_diagnosis::{Term, rms};

pub(super) const TICK_S: f64 = 1e-4;
/// Nominal parameters below this are moved by parts of `SMALL_STEP` instead of parts of themselves.
const SMALL: f64 = 0.05;
const SMALL_STEP: f64 = 0.02;
/// Of a parameter at strength 1.
const PARAMETER_STEP: f64 = 1e-4;
const LARGEST_STRENGTH: f64 = 1e12;
const LARGEST_LIMIT: f64 = 1e9;
const CLOSE_ENOUGH: f64 = 0.01;
const MOST_HALVINGS: usize = 20;

/// A model's answer to a command; none where it cannot be simulated.
pub(super) fn run_of(model: &ActuatorModel, command: &[f64], tick_s: f64) -> Option<ActuatorOutputs> {
    let mut outputs = ActuatorOutputs::default();
    simulate(model, tick_s, ActuatorInputs::commands(command), &mut outputs).ok()?;
    outputs
        .displacement_m
        .iter()
        .all(|value| value.is_finite())
        .then_some(outputs)
}

/// A direction in which a term can grow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    pub term: Term,
    sign: f64,
    /// Of each parameter of an effect: the weight of a size, or the factor of a shape.
    weights: [f64; 3],
}

/// A model with a term, and the term's values in the order of its parameters.
pub(super) struct Grown {
    pub model: ActuatorModel,
    pub values: Vec<f64>,
    /// That of the strength found, m rms.
    pub gap_m: f64,
}

impl Growth {
    pub fn drawn(term: Term, draw: &mut Draw) -> Self {
        Growth {
            term,
            sign: draw.one_of(&[-1.0, 1.0]),
            weights: std::array::from_fn(|_| draw.log_between(0.5, 2.0)),
        }
    }

    /// One size alone, with shapes at a factor of their usual value.
    pub fn of_size(term: Term, place: usize, shape: f64) -> Self {
        let weights = std::array::from_fn(|own| match term {
            Term::Effect(kind) => match kind.parameters().get(own).map(|own| own.role) {
                Some(ParameterRole::Size { .. }) if own == place => 1.0,
                Some(ParameterRole::Shape) => shape,
                _ => 0.0,
            },
            Term::Parameter(_) => 1.0,
        });
        Growth {
            term,
            sign: 1.0,
            weights,
        }
    }

    /// The model at a strength: 0 absent, growing without end.
    pub fn at(&self, model: &ActuatorModel, strength: f64) -> Option<(ActuatorModel, Vec<f64>)> {
        let mut changed = model.clone();
        let values = match self.term {
            Term::Parameter(parameter) => {
                let nominal = parameter.of(model)?;
                let scale = if nominal.abs() < SMALL {
                    SMALL_STEP
                } else {
                    nominal.abs()
                };
                let value = nominal + self.sign * PARAMETER_STEP * strength * scale;
                parameter.set(&mut changed, value);
                vec![value]
            }
            Term::Effect(kind) => {
                let effect = self.effect(kind, strength);
                effect.validate().ok()?;
                changed = changed.with_effect(effect);
                effect.values().to_vec()
            }
        };
        changed.validate().ok()?;
        Some((changed, values))
    }

    fn effect(&self, kind: EffectKind, strength: f64) -> Effect {
        let mut effect = Effect::typical(kind);
        let parameters = kind.parameters().iter().zip(self.weights);
        for (value, (own, weight)) in effect.values_mut().iter_mut().zip(parameters) {
            match own.role {
                ParameterRole::Size { identity } if own.is_limit() => {
                    *value = identity.min(identity.min(LARGEST_LIMIT) / (1.0 + weight * strength));
                }
                ParameterRole::Size { identity } => {
                    let sign = if own.lower < 0.0 { self.sign } else { 1.0 };
                    *value = identity + sign * weight * strength * own.typical;
                }
                ParameterRole::Shape => *value *= weight,
                ParameterRole::Held => (),
            }
        }
        effect
    }

    /// The strength that makes the wanted gap; none where the term cannot make it with this command.
    pub fn of_gap(&self, model: &ActuatorModel, command: &[f64], tick_s: f64, wanted_m: f64) -> Option<Grown> {
        let base = run_of(model, command, tick_s)?;
        let gap_m = |strength: f64| {
            let (changed, _) = self.at(model, strength)?;
            Some(distance_m(&run_of(&changed, command, tick_s)?, &base))
        };
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        let mut reached_m = gap_m(high)?;
        while reached_m < wanted_m {
            low = high;
            high *= 3.0;
            if high > LARGEST_STRENGTH {
                return None;
            }
            reached_m = gap_m(high)?;
        }
        for _ in 0..MOST_HALVINGS {
            if reached_m < (1.0 + CLOSE_ENOUGH) * wanted_m {
                break;
            }
            let middle = if low > 0.0 { (low * high).sqrt() } else { 0.3 * high };
            let middle_m = gap_m(middle)?;
            if middle_m < wanted_m {
                low = middle;
            } else {
                (high, reached_m) = (middle, middle_m);
            }
        }
        let (model, values) = self.at(model, high)?;
        Some(Grown {
            model,
            values,
            gap_m: reached_m,
        })
    }
}

/// rms of one displacement minus another.
pub(super) fn distance_m(one: &ActuatorOutputs, other: &ActuatorOutputs) -> f64 {
    let pairs = one.displacement_m.iter().zip(&other.displacement_m);
    rms(pairs.map(|(one, other)| one - other))
}
