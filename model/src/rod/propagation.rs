//! x(t + T) = Φ·x(t) + Γ₀·f(t) + Γ₁·(f(t + T) − f(t)) + Γ₂·e: the linear rod over one tick, exact for an input that varies
//! linearly within the tick (first-order hold), or along a parabola.
//!
//! x displacements (m) and velocities (m/s), f acceleration (m/s²) or tip force (N), e by how much its mean lies above that
//! of the straight line, T tick (s).
//! Φ, Γ₀, Γ₁, Γ₂ are blocks of one matrix exponential, e^{[A b 0 0; 0 0 1 0; 0 0 0 1; 0 0 0 0]·T}. Any tick is stable: the step-size
//! limit that the paper's explicit integration of (11) has does not exist here.

use super::elements::RodElements;
use super::exponential::exponential;
use super::two_pole::TwoPole;
use crate::ModelError;
use crate::error::require_positive;
use serde::{Deserialize, Serialize};

/// The two-pole rod's state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodState {
    pub displacement_m: f64,
    pub velocity_m_per_s: f64,
}

/// Exact propagation of a [`TwoPole`] over one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwoPolePropagator {
    /// Rows displacement, velocity; columns displacement, velocity, input, input's change, mean of its mean excess.
    rows: [[f64; 5]; 2],
}

impl TwoPolePropagator {
    /// Refuses a tick that is not positive and an invalid rod.
    pub fn new(two_pole: TwoPole, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "tick", "s")?;
        two_pole.validate()?;
        // Velocity is counted per tick, so that the entries have comparable size.
        let stiffness = two_pole.stiffness_per_s2 * tick_s * tick_s;
        let system = [0.0, 1.0, -stiffness, -(two_pole.damping_per_s * tick_s)];
        let e = over_one_tick(&system, &[0.0, tick_s * tick_s]);
        Ok(TwoPolePropagator {
            rows: [
                [e[0], e[1] * tick_s, e[2], e[3], e[4]],
                [e[5] / tick_s, e[6], e[7] / tick_s, e[8] / tick_s, e[9] / tick_s],
            ],
        })
    }

    /// State one tick later; the acceleration w·M + f·F (m/s²) goes linearly from `acceleration_from` to `acceleration_to`.
    #[inline]
    pub fn advance(&self, state: RodState, acceleration_from: f64, acceleration_to: f64) -> RodState {
        let change = acceleration_to - acceleration_from;
        let [displacement, velocity] = self.rows.map(|row| {
            row[0] * state.displacement_m
                + row[1] * state.velocity_m_per_s
                + row[2] * acceleration_from
                + row[3] * change
        });
        RodState {
            displacement_m: displacement,
            velocity_m_per_s: velocity,
        }
    }

    /// As [`TwoPolePropagator::advance`] for an acceleration on a parabola, whose mean over the tick lies
    /// `mean_excess` above that of the straight line.
    #[inline]
    pub fn advance_curved(
        &self,
        state: RodState,
        acceleration_from: f64,
        acceleration_to: f64,
        mean_excess: f64,
    ) -> RodState {
        let straight = self.advance(state, acceleration_from, acceleration_to);
        RodState {
            displacement_m: straight.displacement_m + self.rows[0][4] * mean_excess,
            velocity_m_per_s: straight.velocity_m_per_s + self.rows[1][4] * mean_excess,
        }
    }
}

/// A two-pole rod in motion, from rest at 0: its state, and the acceleration that acts on it now.
///
/// One [`TwoPolePropagator`] moves any number of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodMotion {
    pub state: RodState,
    /// w·M + f·F, m/s².
    pub acceleration: f64,
}

impl RodMotion {
    /// Displacement (m) one tick later, at whose end `acceleration` acts; it goes there linearly.
    #[inline]
    pub fn advance(&mut self, propagator: &TwoPolePropagator, acceleration: f64) -> f64 {
        self.state = propagator.advance(self.state, self.acceleration, acceleration);
        self.acceleration = acceleration;
        self.state.displacement_m
    }

    /// The same for an acceleration on a parabola, as [`TwoPolePropagator::advance_curved`].
    #[inline]
    pub fn advance_curved(&mut self, propagator: &TwoPolePropagator, acceleration: f64, mean_excess: f64) -> f64 {
        self.state = propagator.advance_curved(self.state, self.acceleration, acceleration, mean_excess);
        self.acceleration = acceleration;
        self.state.displacement_m
    }
}

/// Exact propagation of the finite-element rod over one tick, with its state and the force on its tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RodElementsPropagator {
    nodes: usize,
    tick_s: f64,
    /// Γ₀, Γ₁, Γ₂ and Φ by columns: one input after the other goes to all states side by side.
    columns: Vec<f64>,
    /// Displacements of nodes 1…n (m), then their velocities times the tick (m).
    state: Vec<f64>,
    next: Vec<f64>,
    force_n: f64,
}

impl RodElementsPropagator {
    /// Starts at rest. Refuses a tick that is not positive. Allocates here and never again.
    pub fn new(elements: &RodElements, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "tick", "s")?;
        let nodes = elements.count();
        let states = 2 * nodes;
        let mut system = vec![0.0; states * states];
        for node in 0..nodes {
            system[node * states + nodes + node] = 1.0;
        }
        for column in 0..nodes {
            for (matrix, place, factor) in [
                (&elements.stiffness, column, -tick_s * tick_s),
                (&elements.damping, nodes + column, -tick_s),
            ] {
                for (node, entry) in solve_mass(elements, matrix.column(column)).into_iter().enumerate() {
                    system[(nodes + node) * states + place] = factor * entry;
                }
            }
        }
        let mut tip = vec![0.0; nodes];
        tip[nodes - 1] = 1.0;
        let mut input = vec![0.0; nodes];
        input.extend(
            solve_mass(elements, tip)
                .into_iter()
                .map(|entry| tick_s * tick_s * entry),
        );
        let rows = over_one_tick(&system, &input);
        let size = states + 3;
        let columns = (states..size)
            .chain(0..states)
            .flat_map(|column| rows[column..].iter().step_by(size).copied())
            .collect();
        Ok(RodElementsPropagator {
            nodes,
            tick_s,
            columns,
            state: vec![0.0; states],
            next: vec![0.0; states],
            force_n: 0.0,
        })
    }

    /// Displacement of the tip (m) one tick later. The force on it, EA·λ for a free strain λ and external force together,
    /// goes to `force_n` on a parabola whose mean lies `mean_excess_n` above that of the straight line.
    pub fn advance(&mut self, force_n: f64, mean_excess_n: f64) -> f64 {
        let states = self.state.len();
        let change = force_n - self.force_n;
        let (held, varying) = self.columns.split_at(states);
        for (next, entry) in self.next.iter_mut().zip(held) {
            *next = entry * self.force_n;
        }
        let inputs = [change, mean_excess_n].into_iter().chain(self.state.iter().copied());
        for (column, input) in varying.chunks_exact(states).zip(inputs) {
            for (next, entry) in self.next.iter_mut().zip(column) {
                *next += entry * input;
            }
        }
        std::mem::swap(&mut self.state, &mut self.next);
        self.force_n = force_n;
        self.tip().displacement_m
    }

    /// Displacement and velocity of the tip.
    pub fn tip(&self) -> RodState {
        RodState {
            displacement_m: self.state[self.nodes - 1],
            velocity_m_per_s: self.state[2 * self.nodes - 1] / self.tick_s,
        }
    }
}

/// [Φ Γ₀ Γ₁ Γ₂] by rows for a `system` (by rows) and its input's column, both over one tick.
fn over_one_tick(system: &[f64], input: &[f64]) -> Vec<f64> {
    let states = input.len();
    let size = states + 3;
    let mut matrix = vec![0.0; size * size];
    for row in 0..states {
        matrix[row * size..][..states].copy_from_slice(&system[row * states..][..states]);
        matrix[row * size + states] = input[row];
    }
    for row in states..states + 2 {
        matrix[row * size + row + 1] = 1.0;
    }
    let mut rows = exponential(&matrix, size);
    rows.truncate(states * size);
    for row in rows.chunks_mut(size) {
        // A mean excess 6 s(1 − s) over the tick has mean 1, starts with slope 6 and has the second derivative −12.
        row[states + 2] = 6.0 * row[states + 1] - 12.0 * row[states + 2];
    }
    rows
}

/// M⁻¹·load for the tridiagonal mass matrix (Thomas's algorithm; the matrix is diagonally dominant).
fn solve_mass(elements: &RodElements, mut load: Vec<f64>) -> Vec<f64> {
    let (own, beside) = (&elements.mass.diagonal, elements.mass.beside);
    let mut pivots = own.clone();
    for node in 1..load.len() {
        let ratio = beside / pivots[node - 1];
        pivots[node] -= ratio * beside;
        load[node] -= ratio * load[node - 1];
    }
    for node in (0..load.len()).rev() {
        if node + 1 < load.len() {
            load[node] -= beside * load[node + 1];
        }
        load[node] /= pivots[node];
    }
    load
}
