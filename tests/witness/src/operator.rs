//! Hysteresis other than the domain wall's, from an input v to an output o, by the textbooks' definitions:
//!
//! o = b v + Σ w s + Σ w_ij s_ij + Y z + Σ d x;   plays s ← max(g(v) − r, min(s, g(v) + r));   Preisach's half plane in cells between levels l:
//! s_ij ← up to p_i(v) where v rises, down to p_j(v) where it falls, p_i = (v − l_i)/(l_i+1 − l_i) within [0, 1], j ≤ i;
//! Bouc-Wen dz/dv = (1 − κ|z|ⁿ (σ sgn(z dv) + 1 − σ))/w, κ = −1 where it stiffens;   creep ẋ = (v − x)/τ;
//! the domain wall's (`material.rs`) with v for the field, times G.
//!
//! g(v) = v, v + a h φ((v − c)/h) with φ(x) = x² within ±1 and its tangents beyond, or S tanh(v/S). At first v = 0, cells with l_i + l_j < 0 are up.
//! A field H drives it by v = f H, and what it gives, counted from rest, is the magnetization M = g (o − o₀).

use crate::material::Material;
use std::sync::Arc;

/// Steps of Runge and Kutta over the whole way to yielding.
const STEPS_TO_YIELDING: f64 = 50.0;
/// And as far as a.
const STEPS_TO_SHAPE: f64 = 100.0;

/// g of plays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Warp {
    Straight,
    /// a, c, h.
    Bent([f64; 3]),
    /// S.
    Saturating(f64),
}

impl Warp {
    fn at(self, v: f64) -> f64 {
        match self {
            Warp::Straight => v,
            Warp::Bent([bend, middle, half_span]) => {
                let x = (v - middle) / half_span;
                let square = if x.abs() < 1.0 { x * x } else { 2.0 * x.abs() - 1.0 };
                v + bend * half_span * square
            }
            Warp::Saturating(scale) => scale * (v / scale).tanh(),
        }
    }
}

/// One kind of hysteresis in an operator.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    Plays {
        warp: Warp,
        radii: Vec<f64>,
        weights: Vec<f64>,
    },
    /// Rising levels; weights row by row, row i with columns 0 to i.
    Preisach { levels: Vec<f64>, weights: Vec<f64> },
    BoucWen {
        amplitude: f64,
        yield_input: f64,
        exponent: f64,
        loading_share: f64,
        stiffens: bool,
    },
    /// With its G, unit of o per A/m.
    DomainWall { material: Material, gain: f64 },
}

/// b, what remembers, and time (s) and weight of every creep.
#[derive(Clone, Debug, PartialEq)]
pub struct Operator {
    pub slope: f64,
    pub parts: Vec<Element>,
    pub creep: Vec<(f64, f64)>,
}

/// An operator in the place of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    pub operator: Arc<Operator>,
    /// f, unit of v per A/m.
    pub input_per_field: f64,
    /// g, A/m per unit of o.
    pub magnetization_per_output: f64,
    /// Its input is 0 or above.
    pub one_sided: bool,
}

/// What remembers, in motion.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    law: Law,
    input: f64,
    parts: Vec<Vec<f64>>,
    lags: Vec<f64>,
    at_rest: f64,
}

impl Memory {
    pub fn new(law: Law) -> Self {
        let operator = &law.operator;
        let mut own = Memory {
            input: 0.0,
            parts: operator.parts.iter().map(Element::at_rest).collect(),
            lags: vec![0.0; operator.creep.len()],
            at_rest: 0.0,
            law,
        };
        own.at_rest = own.output();
        own
    }

    /// The field goes straight there within so many seconds; M, A/m.
    pub fn go(&mut self, field: f64, seconds: f64) -> f64 {
        let (from, to) = (self.input, self.law.input_per_field * field);
        let operator = self.law.operator.clone();
        for (part, state) in operator.parts.iter().zip(&mut self.parts) {
            part.go(state, from, to);
        }
        for ((time_s, _), lag) in operator.creep.iter().zip(&mut self.lags) {
            // Behind a straight line: x − v decays towards −τ v̇.
            let behind = time_s * (to - from) / seconds;
            *lag = to - behind + (*lag - from + behind) * (-seconds / time_s).exp();
        }
        self.input = to;
        self.magnetization_a_per_m()
    }

    pub fn magnetization_a_per_m(&self) -> f64 {
        self.law.magnetization_per_output * (self.output() - self.at_rest)
    }

    fn output(&self) -> f64 {
        let operator = &self.law.operator;
        let parts = operator.parts.iter().zip(&self.parts);
        let creep = operator.creep.iter().zip(&self.lags);
        operator.slope * self.input
            + parts.map(|(part, state)| part.output(state)).sum::<f64>()
            + creep.map(|((_, weight), lag)| weight * lag).sum::<f64>()
    }
}

impl Element {
    /// Plays; the sum of all cells before the cells; z; M_irr and M.
    fn at_rest(&self) -> Vec<f64> {
        match self {
            Element::Plays { warp, radii, .. } => radii
                .iter()
                .map(|radius| 0.0_f64.clamp(warp.at(0.0) - radius, warp.at(0.0) + radius))
                .collect(),
            Element::Preisach { levels, weights } => {
                let cells = (0..levels.len() - 1).flat_map(|row| (0..=row).map(move |column| (row, column)));
                let up = cells.map(|(row, column)| {
                    let middles = (levels[row] + levels[row + 1]) + (levels[column] + levels[column + 1]);
                    let up = if middles < 0.0 { 1.0 } else { 0.0 };
                    let up = if middles == 0.0 { 0.5 } else { up };
                    ramp(levels, row, 0.0).max(ramp(levels, column, 0.0).min(up))
                });
                let mut state = vec![0.0];
                state.extend(up);
                state[0] = weights.iter().zip(&state[1..]).map(|(weight, up)| weight * up).sum();
                state
            }
            Element::BoucWen { .. } => vec![0.0],
            Element::DomainWall { .. } => vec![0.0; 2],
        }
    }

    fn go(&self, state: &mut [f64], from: f64, to: f64) {
        match self {
            Element::Plays { warp, radii, .. } => {
                let g = warp.at(to);
                for (play, radius) in state.iter_mut().zip(radii) {
                    *play = (g - radius).max(play.min(g + radius));
                }
            }
            Element::Preisach { levels, weights } => {
                let (low, high) = (from.min(to), from.max(to));
                let passed = (0..levels.len() - 1).filter(|level| levels[level + 1] > low && levels[*level] < high);
                for level in passed {
                    let ramp = ramp(levels, level, to);
                    let mut move_cell = |row: usize, column: usize| {
                        let cell = row * (row + 1) / 2 + column;
                        let was = state[1 + cell];
                        let is = if to > from { was.max(ramp) } else { was.min(ramp) };
                        state[1 + cell] = is;
                        state[0] += weights[cell] * (is - was);
                    };
                    if to > from {
                        (0..=level).for_each(|column| move_cell(level, column));
                    } else {
                        (level..levels.len() - 1).for_each(|row| move_cell(row, level));
                    }
                }
            }
            Element::BoucWen {
                yield_input,
                exponent,
                loading_share,
                stiffens,
                ..
            } => {
                let way = (to - from) / yield_input;
                // Where it unloads more steeply than it loads it goes the further.
                let steepest = (1.0 - 2.0 * loading_share).max(1.0);
                let kappa = if *stiffens { -1.0 } else { 1.0 };
                let rate = |z: f64, _: f64| {
                    let loads = if z * way >= 0.0 { 1.0 } else { -1.0 };
                    1.0 - kappa * z.abs().powf(*exponent) * (loading_share * loads + 1.0 - loading_share)
                };
                integrate(&mut state[0], [0.0, way], STEPS_TO_YIELDING * steepest, rate);
            }
            Element::DomainWall { material, .. } => {
                let rate = |irreversible: f64, field: f64| {
                    let here = material.magnetization(field, irreversible);
                    let direction = (to - from).signum();
                    direction * material.irreversible_rate(here, irreversible, direction, 0.0)
                };
                let steps = STEPS_TO_SHAPE / material.shape_a_per_m;
                integrate(&mut state[0], [from, to], steps, rate);
                state[1] = material.magnetization(to, state[0]).0;
            }
        }
    }

    fn output(&self, state: &[f64]) -> f64 {
        match self {
            Element::Plays { weights, .. } => weights.iter().zip(state).map(|(weight, play)| weight * play).sum(),
            Element::Preisach { .. } => state[0],
            Element::BoucWen { amplitude, .. } => amplitude * state[0],
            Element::DomainWall { gain, .. } => gain * state[1],
        }
    }
}

/// Runge and Kutta along the way of x in so many steps a unit of it; dy/dx at y and x.
fn integrate(y: &mut f64, [from, to]: [f64; 2], steps: f64, rate: impl Fn(f64, f64) -> f64) {
    let steps = ((to - from).abs() * steps).ceil().max(1.0);
    let h = (to - from) / steps;
    for step in 0..steps as usize {
        let x = from + h * step as f64;
        let k1 = rate(*y, x);
        let k2 = rate(*y + 0.5 * h * k1, x + 0.5 * h);
        let k3 = rate(*y + 0.5 * h * k2, x + 0.5 * h);
        let k4 = rate(*y + h * k3, x + h);
        *y += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
    }
}

fn ramp(levels: &[f64], level: usize, v: f64) -> f64 {
    ((v - levels[level]) / (levels[level + 1] - levels[level])).clamp(0.0, 1.0)
}
