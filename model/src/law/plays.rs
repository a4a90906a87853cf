//! y = Σ w s,  s ← min(max(s, g(v) − r), g(v) + r): weighted generalised plays.
//!
//! v input, s a play's output and r its radius (half width) in the unit of g, w weights (output per unit of g), g a rising
//! curve common to a group: g = v makes the Prandtl-Ishlinskii law; g = v + a (v − c)²/h (straight beyond c ± h) bends one side
//! of the loop more than the other, as piezo ceramics do; g = σ tanh(v/σ) saturates, as magnets do.
//! Properties for w ≥ 0: monotone, minor loops close, turning points are remembered and wiped out by larger ones, to the bit.
//! Without history at v = 0: s = clip(0) to g(0) ± r. Rate-independent.
//! Sources: Prandtl (1928), Ishlinskii (1944); the kernel: Krasnosel'skii and Pokrovskii, *Systems with Hysteresis* (1989);
//! generalised plays: Al Janaideh, Rakheja and Su, Mechatronics 19 (2009) 656.

use serde::{Deserialize, Serialize};

use super::sums::sum_of_products;
use super::{HysteresisLaw, LawParameter};
use crate::ModelError;
use crate::error::{require, require_not_negative, require_positive};

/// g of a group of plays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Warp {
    /// g = v.
    Straight,
    /// g = v + a (v − c)²/h within c ± h, tangent beyond.
    Quadratic {
        /// a, |a| < 1/2.
        bend: f64,
        /// c, unit of the input.
        middle: f64,
        /// h > 0, unit of the input.
        half_span: f64,
    },
    /// g = σ tanh(v/σ).
    Tanh {
        /// σ > 0, unit of the input.
        scale: f64,
    },
}

impl Warp {
    /// g at v.
    pub fn value(&self, input: f64) -> f64 {
        self.value_and_slope(input).0
    }

    /// g and dg/dv at v.
    #[inline]
    pub fn value_and_slope(&self, input: f64) -> (f64, f64) {
        match *self {
            Warp::Straight => (input, 1.0),
            Warp::Quadratic {
                bend,
                middle,
                half_span,
            } => {
                let from_middle = input - middle;
                let share = (from_middle / half_span).clamp(-1.0, 1.0);
                let slope = 1.0 + 2.0 * bend * share;
                // Within: v + a h x². Beyond, the tangent at x = ±1: v + a h x (2 (v − c)/h − x).
                (input + bend * share * (2.0 * from_middle - share * half_span), slope)
            }
            Warp::Tanh { scale } => {
                let share = libm::tanh(input / scale);
                (scale * share, 1.0 - share * share)
            }
        }
    }

    fn parameters(&self) -> Vec<LawParameter> {
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        match *self {
            Warp::Straight => Vec::new(),
            // Middle and span are those of the data, not chosen by a fit.
            Warp::Quadratic { bend, .. } => vec![LawParameter::new("bend", bend, [-0.5, 0.5])],
            Warp::Tanh { scale } => vec![LawParameter::new("scale", scale, [0.0, any[1]])],
        }
    }

    fn validate(&self) -> Result<(), ModelError> {
        match *self {
            Warp::Straight => Ok(()),
            Warp::Quadratic {
                bend,
                middle,
                half_span,
            } => {
                require(bend.abs() < 0.5, "bend of a warp", bend, "", "above -0.5 and below 0.5")?;
                require(true, "middle of a warp", middle, "(unit of the input)", "finite")?;
                require_positive(half_span, "half span of a warp", "(unit of the input)")
            }
            Warp::Tanh { scale } => require_positive(scale, "scale of a warp", "(unit of the input)"),
        }
    }
}

/// Plays behind one curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayGroup {
    /// g.
    pub warp: Warp,
    /// r of each, unit of g.
    pub radii: Vec<f64>,
    /// w of each, output per unit of g.
    pub weights: Vec<f64>,
}

impl PlayGroup {
    /// g(v) and what the group's plays come to there, with the slope on the side from which v comes.
    #[inline]
    fn ahead(&self, plays: &[f64], input: f64, rising: bool) -> (f64, f64) {
        let (value, slope) = self.warp.value_and_slope(input);
        // In the order of `sum_of_products`: the same bits as those of the output there.
        let (mut output, mut moving) = ([0.0; 4], [0.0; 4]);
        let mut add = |lane: usize, play: f64, radius: f64, weight: f64, rest: Option<&mut f64>| {
            let (low, high) = (value - radius, value + radius);
            *rest.unwrap_or(&mut output[lane]) += weight * clip(play, low, high);
            let moves = if rising { play <= low } else { play >= high };
            moving[lane] += if moves { weight } else { 0.0 };
        };
        let (four, radii, weights) = (
            plays.as_chunks::<4>(),
            self.radii.as_chunks::<4>(),
            self.weights.as_chunks::<4>(),
        );
        for ((plays, radii), weights) in four.0.iter().zip(radii.0).zip(weights.0) {
            for lane in 0..4 {
                add(lane, plays[lane], radii[lane], weights[lane], None);
            }
        }
        let mut last = 0.0;
        for ((play, radius), weight) in four.1.iter().zip(radii.1).zip(weights.1) {
            add(0, *play, *radius, *weight, Some(&mut last));
        }
        let sum = (output[0] + output[1]) + (output[2] + output[3]) + last;
        (sum, slope * (moving[0] + moving[1] + moving[2] + moving[3]))
    }
}

/// s into [low, high].
#[inline(always)]
fn clip(play: f64, low: f64, high: f64) -> f64 {
    let raised = if play < low { low } else { play };
    if raised > high { high } else { raised }
}

/// A sum of groups.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaySum {
    /// At least one play in all.
    pub groups: Vec<PlayGroup>,
}

/// Where the plays are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaySumState {
    /// v.
    pub input: f64,
    /// s of every play, group by group.
    pub plays: Vec<f64>,
}

impl PlaySum {
    /// Prandtl-Ishlinskii: plays of these radii and weights.
    pub fn prandtl_ishlinskii(radii: Vec<f64>, weights: Vec<f64>) -> Self {
        PlaySum {
            groups: vec![PlayGroup {
                warp: Warp::Straight,
                radii,
                weights,
            }],
        }
    }

    /// Leaves out plays without weight, and groups without plays.
    pub fn drop_zeros(&mut self) {
        for group in &mut self.groups {
            let of = std::mem::take(&mut group.radii)
                .into_iter()
                .zip(std::mem::take(&mut group.weights));
            (group.radii, group.weights) = of.filter(|(_, weight)| *weight != 0.0).unzip();
        }
        self.groups.retain(|group| !group.radii.is_empty());
    }

    /// Moves plays to an input and leaves what each of them is in `plays`: what a fit of the weights needs.
    pub fn follow(&self, state: &mut PlaySumState, input_to: f64) {
        state.input = input_to;
        let mut plays = &mut state.plays[..];
        for group in &self.groups {
            let value = group.warp.value(input_to);
            let (own, rest) = plays.split_at_mut(group.radii.len());
            for (play, radius) in own.iter_mut().zip(&group.radii) {
                *play = clip(*play, value - radius, value + radius);
            }
            plays = rest;
        }
    }
}

impl HysteresisLaw for PlaySum {
    type State = PlaySumState;

    fn rest(&self) -> PlaySumState {
        let count = self.groups.iter().map(|group| group.radii.len()).sum();
        let mut state = PlaySumState {
            input: 0.0,
            plays: vec![0.0; count],
        };
        self.follow(&mut state, 0.0);
        state
    }

    fn parameters(&self) -> Vec<LawParameter> {
        let of_group = |(index, group): (usize, &PlayGroup)| {
            let weights = group.weights.iter().zip(&group.radii);
            let named = weights.map(move |(weight, radius)| {
                LawParameter::weight(format!("weight {index} of radius {radius:.4e}"), *weight)
            });
            group.warp.parameters().into_iter().chain(named).collect::<Vec<_>>()
        };
        self.groups.iter().enumerate().flat_map(of_group).collect()
    }

    fn validate(&self) -> Result<(), ModelError> {
        let mut plays = 0;
        for group in &self.groups {
            group.warp.validate()?;
            if group.weights.len() != group.radii.len() {
                return Err(ModelError::LengthsDiffer {
                    quantity: "weights of plays",
                    needed: group.radii.len(),
                    given: group.weights.len(),
                });
            }
            for (radius, weight) in group.radii.iter().zip(&group.weights) {
                require_not_negative(*radius, "radius of a play", "(unit of the input)")?;
                require_not_negative(*weight, "weight of a play", "(output per input)")?;
            }
            plays += group.radii.len();
        }
        if plays == 0 {
            return Err(ModelError::TooFew {
                what: "a sum of plays",
                least: 1,
                given: 0,
            });
        }
        Ok(())
    }

    fn input(state: &PlaySumState) -> f64 {
        state.input
    }

    fn output(&self, state: &PlaySumState) -> f64 {
        // From 0.0, not from the -0.0 of an empty sum: the same as on the way there.
        let mut output = 0.0;
        let mut plays = &state.plays[..];
        for group in &self.groups {
            let (own, rest) = plays.split_at(group.radii.len());
            output += sum_of_products(&group.weights, own);
            plays = rest;
        }
        output
    }

    fn advance(&self, state: &mut PlaySumState, input_to: f64) {
        self.follow(state, input_to);
    }

    fn ahead(&self, state: &PlaySumState, input_to: f64) -> (f64, f64) {
        let rising = input_to > state.input;
        let (mut output, mut slope) = (0.0, 0.0);
        let mut plays = &state.plays[..];
        for group in &self.groups {
            let (own, rest) = plays.split_at(group.radii.len());
            let (of_group, slope_of_group) = group.ahead(own, input_to, rising);
            output += of_group;
            slope += slope_of_group;
            plays = rest;
        }
        (output, slope)
    }

    fn slope(&self, state: &PlaySumState, rising: bool) -> f64 {
        let mut slope = 0.0;
        let mut plays = &state.plays[..];
        for group in &self.groups {
            let (own, rest) = plays.split_at(group.radii.len());
            slope += group.ahead(own, state.input, rising).1;
            plays = rest;
        }
        slope
    }
}
