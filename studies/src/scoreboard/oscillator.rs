//! The Bouc-Wen benchmark: m ÿ + c ẏ + k y + z = u,  ż = α ẏ − β(γ|ẏ||z|^(ν−1) z + δ ẏ|z|^ν); force u (N) in, displacement y (m) out.
//!
//! The data are made here, by an integrator of its own, from the published constants: nothing of `model/` is in them. What is fitted is an
//! oscillator whose spring is a hysteresis law of ours: m ÿ + c ẏ + k y + h(y) = u, by a free run along a noisy multisine; what counts is
//! the free run along another multisine and a sine sweep, both without noise.
//! The model is stepped by the leapfrog, [`SUBSTEPS`] steps a sample; the input between samples is that of the excitation.
//! Source: Noël and Schoukens, Hysteretic benchmark with a dynamic nonlinearity (2016), nonlinearbenchmark.org.

use anhyst_identify::engine::{Coordinate, Problem, Stop};
use anhyst_model::{BoucWen, Density, HysteresisLaw, Law, LawModel, Noise, PlaySum, Preisach};
use serde::Serialize;
use std::f64::consts::TAU;

const RATE_HZ: f64 = 750.0;
/// Of the model, a sample.
const SUBSTEPS: usize = 16;
/// Of what makes the data, for one of those.
const FINER: usize = 4;
/// Of the sensor while it is trained, rms, m: 40 dB below the response.
const NOISE_M: f64 = 8e-6;
/// One period of a multisine.
const PERIOD: usize = 8192;
/// Samples that are fitted, one after the other.
const STRETCHES: [usize; 4] = [256, 1024, 4096, 2 * PERIOD];
const PLAYS: usize = 10;
const ROWS: usize = 60;

/// One law on the benchmark.
#[derive(Clone, Debug, Serialize)]
pub struct OscillatorScore {
    pub law: &'static str,
    /// Numbers that were fitted.
    pub parameters: usize,
    /// rms of the free run along the test signals, m.
    pub multisine_m: f64,
    pub sweep_m: f64,
}

/// A force over time, N: what it is at any moment.
struct Force {
    terms: Vec<(f64, f64, f64)>,
    sweep: bool,
    samples: usize,
}

impl Force {
    /// Sines of random phase from 5 to 150 Hz, 50 N rms together.
    fn multisine(seed: u64) -> Self {
        let mut draws = Noise::new(seed, 0);
        let lines: Vec<f64> = (1..PERIOD)
            .map(|line| line as f64 * RATE_HZ / PERIOD as f64)
            .filter(|hertz| (5.0..=150.0).contains(hertz))
            .collect();
        let size = 50.0 * (2.0 / lines.len() as f64).sqrt();
        // The normal's own distribution folds to any phase.
        let term = |hertz: f64| (size, TAU * hertz, 100.0 * draws.normal());
        Self {
            terms: lines.into_iter().map(term).collect(),
            sweep: false,
            samples: 2 * PERIOD,
        }
    }

    /// From 20 to 50 Hz at 10 Hz a minute, 40 N.
    fn sweep() -> Self {
        Self {
            terms: vec![(40.0, TAU * 20.0, 0.0)],
            sweep: true,
            samples: (180.0 * RATE_HZ) as usize,
        }
    }

    fn at(&self, time_s: f64) -> f64 {
        if self.sweep {
            let (size, rate, _) = self.terms[0];
            return size * (rate * time_s + 0.5 * TAU * (10.0 / 60.0) * time_s * time_s).sin();
        }
        self.terms
            .iter()
            .map(|(size, rate, phase)| size * (rate * time_s + phase).cos())
            .sum()
    }

    /// At the ends of the finest steps: of a multisine by turning phasors, for there are many.
    fn fine(&self) -> Vec<f64> {
        let step_s = 1.0 / (RATE_HZ * (SUBSTEPS * FINER) as f64);
        let count = self.samples * SUBSTEPS * FINER + 1;
        if self.sweep {
            return (0..count).map(|step| self.at(step as f64 * step_s)).collect();
        }
        // A period repeats.
        let period = PERIOD * SUBSTEPS * FINER;
        let mut one = vec![0.0; period];
        for (size, rate, phase) in &self.terms {
            let (turn_cos, turn_sin) = ((rate * step_s).cos(), (rate * step_s).sin());
            let (mut x, mut y) = (size * phase.cos(), size * phase.sin());
            for value in &mut one {
                *value += x;
                (x, y) = (x * turn_cos - y * turn_sin, x * turn_sin + y * turn_cos);
            }
        }
        (0..count).map(|step| one[step % period]).collect()
    }
}

/// The benchmark's own oscillator, by the method of Runge and Kutta: displacements at the samples.
fn made(force: &[f64], samples: usize) -> Vec<f64> {
    const M: f64 = 2.0;
    const C: f64 = 10.0;
    const K: f64 = 5e4;
    const ALPHA: f64 = 5e4;
    // β γ and β δ, ν = 1.
    const BETA_GAMMA: f64 = 800.0;
    const BETA_DELTA: f64 = -1100.0;
    // Two steps of the force are one of the method.
    let h = 2.0 / (RATE_HZ * (SUBSTEPS * FINER) as f64);
    let rate = |[y, v, z]: [f64; 3], u: f64| {
        [
            v,
            (u - C * v - K * y - z) / M,
            ALPHA * v - (BETA_GAMMA * v.abs() * z + BETA_DELTA * v * z.abs()),
        ]
    };
    let along = |x: [f64; 3], by: f64, k: [f64; 3]| std::array::from_fn(|i| x[i] + by * k[i]);
    let mut state = [0.0; 3];
    let mut displacements = Vec::with_capacity(samples);
    for sample in 0..samples {
        displacements.push(state[0]);
        for step in 0..SUBSTEPS * FINER / 2 {
            let at = sample * SUBSTEPS * FINER + 2 * step;
            let first = rate(state, force[at]);
            let second = rate(along(state, 0.5 * h, first), force[at + 1]);
            let third = rate(along(state, 0.5 * h, second), force[at + 1]);
            let fourth = rate(along(state, h, third), force[at + 2]);
            state = std::array::from_fn(|i| state[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]));
        }
    }
    displacements
}

/// The oscillator with a law of ours as its spring; none where it runs away.
fn simulated(law: &LawModel, [mass, damping, stiffness]: [f64; 3], force: &[f64], samples: usize) -> Option<Vec<f64>> {
    let step_s = 1.0 / (RATE_HZ * SUBSTEPS as f64);
    let mut state = law.rest();
    let (mut y, mut v) = (0.0, 0.0);
    let mut displacements = Vec::with_capacity(samples);
    // Damping is taken in the middle of a step, which solves for itself.
    let (keep, gain) = (
        (1.0 - 0.5 * step_s * damping / mass) / (1.0 + 0.5 * step_s * damping / mass),
        step_s / mass / (1.0 + 0.5 * step_s * damping / mass),
    );
    let mut first = true;
    for sample in 0..samples {
        displacements.push(y);
        for step in 0..SUBSTEPS {
            let pull = force[(sample * SUBSTEPS + step) * FINER] - stiffness * y - law.output(&state);
            // The first half step brings the speed between two displacements.
            v = if first {
                0.5 * step_s / mass * pull
            } else {
                keep * v + gain * pull
            };
            first = false;
            y += step_s * v;
            law.advance(&mut state, y);
        }
        if y.is_nan() || y.abs() >= 1.0 {
            return None;
        }
    }
    Some(displacements)
}

/// A spring, and the numbers of it that are fitted: after mass, damping and stiffness.
struct Spring {
    name: &'static str,
    start: Vec<f64>,
    coordinates: Vec<Coordinate>,
    law: fn(&[f64], f64) -> LawModel,
}

fn free(lower: f64, upper: f64, logarithmic: bool, scale: f64) -> Coordinate {
    Coordinate {
        scale,
        logarithmic,
        lower,
        upper,
        prior: None,
    }
}

fn of(law: Law) -> LawModel {
    LawModel {
        laws: vec![law],
        ..LawModel::default()
    }
}

/// Springs to be tried; `size` is the largest displacement, m, `stiffness` what a line gave, N/m.
fn springs(size: f64, stiffness: f64) -> Vec<Spring> {
    let log = |value: f64, factor: f64| free(value / factor, value * factor, true, 1.0);
    let force = 0.3 * stiffness * size;
    vec![
        Spring {
            name: "linear",
            start: vec![],
            coordinates: vec![],
            law: |_, _| LawModel::default(),
        },
        Spring {
            name: "prandtl-ishlinskii",
            start: vec![0.1 * stiffness; PLAYS],
            coordinates: vec![free(0.0, 10.0 * stiffness, false, 0.1 * stiffness); PLAYS],
            law: |weights, size| {
                let radii = (0..PLAYS).map(|play| size * ((play + 1) as f64 / (PLAYS + 1) as f64).powi(2));
                of(Law::Plays(PlaySum::prandtl_ishlinskii(
                    radii.collect(),
                    weights.to_vec(),
                )))
            },
        },
        Spring {
            name: "preisach-lorentz",
            start: vec![force, 0.2 * size, 0.5 * size],
            coordinates: vec![log(force, 1e3), log(0.2 * size, 1e2), log(0.5 * size, 1e2)],
            law: |own, size| {
                let [amplitude, coercivity, width] = [own[0], own[1], own[2]];
                of(Law::Preisach(Preisach::from(Density::Lorentz {
                    amplitude,
                    coercivity,
                    width,
                    reach: 1.5 * size,
                    rows: ROWS,
                })))
            },
        },
        Spring {
            name: "bouc-wen",
            start: vec![force, size, 0.8],
            coordinates: vec![log(force, 1e3), log(size, 1e3), free(0.5, 1.0, false, 0.1)],
            law: |own, _| bouc_wen(own, false),
        },
        Spring {
            name: "bouc-wen, stiffening",
            start: vec![force, size, 0.0],
            coordinates: vec![log(force, 1e3), log(size, 1e3), free(-20.0, 0.5, false, 1.0)],
            law: |own, _| bouc_wen(own, true),
        },
    ]
}

fn bouc_wen(own: &[f64], stiffens: bool) -> LawModel {
    of(Law::BoucWen(BoucWen {
        amplitude: own[0],
        yield_input: own[1],
        exponent: 1.0,
        loading_share: own[2],
        stiffens,
    }))
}

fn rms(one: &[f64], other: &[f64]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum();
    (squares / one.len() as f64).sqrt()
}

/// Fits every spring that is wanted to one multisine and runs it freely along the test signals; best first.
pub fn oscillator(threads: usize, wanted: impl Fn(&str) -> bool) -> Vec<OscillatorScore> {
    let training = Force::multisine(1);
    let forces = [training, Force::multisine(2), Force::sweep()];
    let fine: Vec<Vec<f64>> = forces.iter().map(Force::fine).collect();
    let truth: Vec<Vec<f64>> = forces
        .iter()
        .zip(&fine)
        .map(|(force, fine)| made(fine, force.samples))
        .collect();
    let mut noise = Noise::new(3, 0);
    let measured: Vec<f64> = truth[0]
        .iter()
        .map(|y| (y + NOISE_M * noise.normal()) / NOISE_M)
        .collect();
    let size = truth[0].iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    let chassis = [
        free(0.2, 20.0, true, 1.0),
        free(0.1, 1e3, true, 1.0),
        free(1e3, 1e7, true, 1.0),
    ];
    let mut start = vec![1.5, 30.0, 8e4];
    let mut scores = Vec::new();
    for spring in springs(size, 1e5).into_iter().filter(|spring| wanted(spring.name)) {
        let coordinates = [&chassis[..], &spring.coordinates].concat();
        let simulator = |values: &[f64], rows: usize| {
            let (chassis, own) = values.split_at(3);
            let y = simulated(
                &(spring.law)(own, size),
                [chassis[0], chassis[1], chassis[2]],
                &fine[0],
                rows,
            )?;
            Some(y.into_iter().map(|y| y / NOISE_M).collect())
        };
        // From a short stretch to all of it: over a long one a wrong frequency is a minimum of its own.
        let mut values = Some([&start[..], &spring.start].concat());
        for rows in STRETCHES {
            let simulator = |values: &[f64]| simulator(values, rows);
            let whole = 0..rows;
            let problem = Problem {
                measured: &measured[..rows],
                training: std::slice::from_ref(&whole),
                linear: &[],
                coordinates: &coordinates,
                simulator: &simulator,
                stop: Stop {
                    steps: 40,
                    ..Stop::CHANCE
                },
                threads,
            };
            let found = values.and_then(|values| problem.solve(&values));
            values = found.map(|found| found.values);
        }
        let Some(values) = values else { continue };
        if spring.coordinates.is_empty() {
            // Half of what a line says of the spring is left to the law.
            start = vec![values[0], values[1], 0.6 * values[2]];
        }
        let (chassis, own) = values.split_at(3);
        let law = (spring.law)(own, size);
        let test = |of: usize| {
            let y = simulated(
                &law,
                [chassis[0], chassis[1], chassis[2]],
                &fine[of],
                forces[of].samples,
            );
            y.map_or(f64::INFINITY, |y| rms(&y, &truth[of]))
        };
        scores.push(OscillatorScore {
            law: spring.name,
            parameters: coordinates.len(),
            multisine_m: test(1),
            sweep_m: test(2),
        });
    }
    scores.sort_by(|one, other| one.multisine_m.total_cmp(&other.multisine_m));
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the benchmark's bar, 1e-5 m along both test signals, which is kept a hundredfold by the law that the data were made with,
    /// and by no line.
    #[test]
    fn bouc_wen_is_found_in_the_oscillators_motion() {
        let scores = oscillator(2, |name| ["linear", "bouc-wen, stiffening"].contains(&name));
        let of = |name: &str| scores.iter().find(|own| own.law == name).unwrap();
        let best = of("bouc-wen, stiffening");
        assert!(best.multisine_m < 2.2e-7 && best.sweep_m < 1e-7, "{best:?}");
        assert!(of("linear").multisine_m > 1e-4, "{scores:?}");
    }
}
