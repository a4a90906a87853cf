//! Runs for a blind study: a generator draws effect, size, excitation and noise, and the workflow sees the columns only.
//!
//! Sizes are chosen by the gap they make: rms over the noise, between the limits asked for. Unlisted effects are laid over the
//! simulated signals, so that no model of the library holds them.

use anhyst_diagnosis::diagnose::Term;
use anhyst_diagnosis::{MeasuredRun, Quantity};
use anhyst_model::{
    ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, Noise, ParameterRole, simulate,
};

pub const TICK_S: f64 = 1e-4;
pub const OUTPUT_NOISE_M: f64 = 20e-9;
pub const FIELD_NOISE_A_PER_M: f64 = 1.0;
const RESOLUTION_M: f64 = 1e-9;

/// Effects that the library does not hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unlisted {
    /// Interpolation error of an encoder: a ripple over the displacement.
    Ripple,
    /// A force of the square of the velocity, quasi-statically.
    Drag,
    /// The gain sags after activity and recovers: an output times a slow memory of its own square.
    Fatigue,
}

impl Unlisted {
    pub const ALL: [Unlisted; 3] = [Unlisted::Ripple, Unlisted::Drag, Unlisted::Fatigue];
}

/// What is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hidden {
    Nothing,
    Listed(Term),
    Pair(Term, Term),
    Unlisted(Unlisted),
}

impl std::fmt::Display for Hidden {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Hidden::Nothing => formatter.write_str("none"),
            Hidden::Listed(term) => formatter.write_str(term.name()),
            Hidden::Pair(one, other) => write!(formatter, "{one} + {other}"),
            Hidden::Unlisted(own) => write!(formatter, "unlisted {own:?}"),
        }
    }
}

/// Uniform draws.
pub struct Draw(Noise);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Draw(Noise::new(seed, 77))
    }

    pub fn unit(&mut self) -> f64 {
        // Φ of a normal number is uniform.
        0.5 * (1.0 + libm::erf(self.0.normal() / std::f64::consts::SQRT_2))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn one_of<T: Copy>(&mut self, items: &[T]) -> T {
        items[((self.unit() * items.len() as f64) as usize).min(items.len() - 1)]
    }
}

/// A made run and its truth.
pub struct Made {
    pub run: MeasuredRun,
    pub hidden: Hidden,
    /// Rms of what is hidden, over the noise.
    pub gap: f64,
    /// Values of the terms, in the terms' order.
    pub truth: Vec<Vec<f64>>,
}

pub fn excitation(draw: &mut Draw, rows: usize) -> Vec<f64> {
    let amplitude = draw.between(8e3, 18e3);
    let kind = draw.one_of(&[0, 0, 1, 2, 3]);
    let duration = rows as f64 * TICK_S;
    let tau = std::f64::consts::TAU;
    let phases: Vec<f64> = (0..12).map(|_| draw.between(0.0, tau)).collect();
    let base = draw.between(20.0, 60.0);
    let highest = draw.between(120.0, 300.0);
    let value = |t: f64| -> f64 {
        let x = t / duration;
        let loops = |t: f64| (tau * 8.0 * t).sin();
        let sweep = |t: f64, from: f64, to: f64, length: f64| {
            let ratio = (to / from).ln();
            (tau * from * length / ratio * ((ratio * t / length).exp() - 1.0)).sin()
        };
        let multisine = |t: f64| -> f64 {
            phases
                .iter()
                .enumerate()
                .map(|(k, phase)| (tau * highest * (k + 1) as f64 / 12.0 * t + phase).sin())
                .sum::<f64>()
                / 6.0
        };
        let stairs = |x: f64| [0.3, 0.8, 0.5, -0.2, -0.9, -0.4, 0.1, 0.0][((x * 8.0) as usize).min(7)];
        match kind {
            0 => {
                let (part, within) = ((x * 4.0) as usize, (x * 4.0).fract());
                let t = within * duration / 4.0;
                match part {
                    0 => within * loops(t),
                    1 => 0.6 * sweep(t, 2.0, highest, duration / 4.0),
                    2 => stairs(within),
                    _ => 0.5 * multisine(t) * (20.0 * within).min(1.0) * (20.0 * (1.0 - within)).min(1.0),
                }
            }
            1 => ((tau * base * t).sin() + 0.3 * (tau * 3.0 * base * t).sin()) * (10.0 * x).min(1.0) / 1.3,
            2 => 0.8 * sweep(t, 1.0, highest, duration),
            _ => (0.6 * stairs(x) + 0.4 * multisine(t)) * (20.0 * x).min(1.0),
        }
    };
    // Steps are ramped as a real command would be.
    let mut smooth = 0.0;
    (0..rows)
        .map(|row| {
            smooth += (value(row as f64 * TICK_S) - smooth) * 0.1;
            (100.0 * amplitude * smooth).round() / 100.0
        })
        .collect()
}

pub fn run_of(model: &ActuatorModel, command: &[f64]) -> Option<ActuatorOutputs> {
    let mut outputs = ActuatorOutputs::default();
    simulate(model, TICK_S, ActuatorInputs::commands(command), &mut outputs).ok()?;
    Some(outputs)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The model with a term at a strength: 0 absent, growing without end.
fn with(model: &ActuatorModel, term: Term, strength: f64, sign: f64, shape: f64) -> Option<(ActuatorModel, Vec<f64>)> {
    let mut changed = model.clone();
    let values = match term {
        Term::Parameter(parameter) => {
            let nominal = parameter.of(model)?;
            let scale = if nominal.abs() < 0.05 { 0.02 } else { nominal.abs() };
            let value = nominal + sign * 1e-4 * strength * scale;
            parameter_set(&mut changed, term, value);
            vec![value]
        }
        Term::Effect(kind) => {
            let mut effect = Effect::typical(kind);
            for (value, own) in effect.values_mut().iter_mut().zip(kind.parameters()) {
                match own.role {
                    ParameterRole::Size { identity } if identity == own.upper => *value = own.upper.min(1e9) / strength,
                    ParameterRole::Size { identity } => {
                        let sign = if own.lower < 0.0 { sign } else { 1.0 };
                        *value = identity + sign * strength * own.typical;
                    }
                    ParameterRole::Shape => *value *= shape,
                    ParameterRole::Held => (),
                }
            }
            effect.validate().ok()?;
            changed = changed.with_effect(effect);
            effect.values().to_vec()
        }
    };
    changed.validate().ok()?;
    Some((changed, values))
}

fn parameter_set(model: &mut ActuatorModel, term: Term, value: f64) {
    let hysteresis = &mut model.material.hysteresis;
    let rod = model.rod.as_mut();
    match term.name() {
        "parameter_Ms" => hysteresis.saturation_magnetization_a_per_m = value,
        "parameter_a" => hysteresis.shape_a_per_m = value,
        "parameter_k" => hysteresis.pinning_a_per_m = value,
        "parameter_alpha" => hysteresis.coupling = value,
        "parameter_c" => hysteresis.reversibility = value,
        "parameter_w" => rod.expect("a rod").gain = value,
        "parameter_damping" => rod.expect("a rod").damping_per_s = value,
        "parameter_stiffness" => rod.expect("a rod").stiffness_per_s2 = value,
        other => panic!("{other} is no parameter"),
    }
}

/// Finds the strength that makes the wanted gap, by doubling and halving; None where the term cannot make it here.
fn of_gap(
    model: &ActuatorModel,
    term: Term,
    command: &[f64],
    wanted_m: f64,
    draw: &mut Draw,
) -> Option<(ActuatorModel, Vec<f64>)> {
    let (sign, shape) = (draw.one_of(&[-1.0, 1.0]), draw.log_between(0.5, 2.0));
    let base = run_of(model, command)?;
    let gap = |strength: f64| {
        let (changed, _) = with(model, term, strength, sign, shape)?;
        let outputs = run_of(&changed, command)?;
        Some(rms(outputs
            .displacement_m
            .iter()
            .zip(&base.displacement_m)
            .map(|(a, b)| a - b)))
    };
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    while gap(high)? < wanted_m {
        low = high;
        high *= 3.0;
        if high > 1e12 {
            return None;
        }
    }
    for _ in 0..12 {
        let middle = if low > 0.0 {
            (low * high).sqrt()
        } else {
            0.5 * (low + high)
        };
        if gap(middle)? < wanted_m {
            low = middle
        } else {
            high = middle
        }
    }
    with(model, term, high, sign, shape)
}

fn unlisted(which: Unlisted, outputs: &ActuatorOutputs, wanted_m: f64, draw: &mut Draw) -> Vec<f64> {
    let x = &outputs.displacement_m;
    let largest = x.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let period = largest / draw.between(4.0, 15.0);
    let mut memory = 0.0;
    let added: Vec<f64> = (0..x.len())
        .map(|row| match which {
            Unlisted::Ripple => (std::f64::consts::TAU * x[row] / period).sin(),
            Unlisted::Drag => {
                let velocity = (x[row] - x[row.saturating_sub(1)]) / TICK_S;
                -velocity * velocity.abs()
            }
            Unlisted::Fatigue => {
                memory += (x[row] * x[row] / (largest * largest) - memory) * TICK_S / 0.05;
                -x[row] * memory
            }
        })
        .collect();
    let scale = wanted_m / rms(added.iter().copied()).max(f64::MIN_POSITIVE);
    x.iter().zip(added).map(|(x, own)| x + scale * own).collect()
}

/// Makes a run; None where the drawn excitation does not let the term make the gap.
pub fn make(hidden: Hidden, rows: usize, gap: f64, seed: u64) -> Option<Made> {
    let mut draw = Draw::new(seed);
    let command = excitation(&mut draw, rows);
    let nominal = ActuatorModel::terfenol_d();
    let wanted = gap * OUTPUT_NOISE_M;
    let (model, truth) = match hidden {
        Hidden::Nothing | Hidden::Unlisted(_) => (nominal.clone(), Vec::new()),
        Hidden::Listed(term) => {
            let (model, values) = of_gap(&nominal, term, &command, wanted, &mut draw)?;
            (model, vec![values])
        }
        Hidden::Pair(one, other) => {
            let (first, first_values) = of_gap(&nominal, one, &command, wanted, &mut draw)?;
            let share = draw.between(0.4, 1.5);
            let (both, second_values) = of_gap(&first, other, &command, share * wanted, &mut draw)?;
            (both, vec![first_values, second_values])
        }
    };
    let outputs = run_of(&model, &command)?;
    let displacement = match hidden {
        Hidden::Unlisted(which) => unlisted(which, &outputs, wanted, &mut draw),
        _ => outputs.displacement_m.clone(),
    };
    let (mut output_noise, mut field_noise) = (Noise::new(seed, 1), Noise::new(seed, 2));
    let coarse = matches!(hidden, Hidden::Listed(Term::Effect(EffectKind::Quantisation)));
    let measured: Vec<f64> = displacement
        .iter()
        .map(|x| {
            let noisy = x + OUTPUT_NOISE_M * output_noise.normal();
            // A converter of coarse steps rounds the noise as well.
            let step = if coarse {
                truth[0][0].max(RESOLUTION_M)
            } else {
                RESOLUTION_M
            };
            (noisy / step).round() * step
        })
        .collect();
    let field: Vec<f64> = outputs
        .field_a_per_m
        .iter()
        .map(|h| (100.0 * (h + FIELD_NOISE_A_PER_M * field_noise.normal())).round() / 100.0)
        .collect();
    let run = MeasuredRun::in_memory(
        &format!("{hidden}, seed {seed}"),
        Some(TICK_S),
        vec![
            (Quantity::FieldCommand, command),
            (Quantity::Field, field),
            (Quantity::Displacement, measured),
        ],
    )
    .expect("a run");
    Some(Made {
        run,
        hidden,
        gap,
        truth,
    })
}
