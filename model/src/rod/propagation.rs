//! x(t + T) = Φ·x(t) + Γ₀·f(t) + Γ₁·(f(t + T) − f(t)): the linear rod over one tick, exact for an input that varies
//! linearly within the tick (first-order hold).
//!
//! x displacements (m) and velocities (m/s), f acceleration (m/s²) or tip force (N), T tick (s).
//! Φ, Γ₀, Γ₁ are blocks of one matrix exponential, e^{[A b 0; 0 0 1; 0 0 0]·T}. Any tick is stable: the step-size limit that
//! the paper's explicit integration of (11) has does not exist here.

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
    /// Rows displacement, velocity; columns displacement, velocity, input, input's change, mean of its bulge.
    rows: [[f64; 5]; 2],
}

impl TwoPolePropagator {
    /// Refuses a tick that is not positive and an invalid rod.
    pub fn new(two_pole: TwoPole, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "tick", "s")?;
        two_pole.validate()?;
        // Velocity is counted per tick, so that the entries have comparable size.
        let (stiffness, damping) = (
            two_pole.stiffness_per_s2 * tick_s * tick_s,
            two_pole.damping_per_s * tick_s,
        );
        #[rustfmt::skip]
        let matrix = [
            0.0, 1.0, 0.0, 0.0, 0.0,
            -stiffness, -damping, tick_s * tick_s, 0.0, 0.0,
            0.0, 0.0, 0.0, 1.0, 0.0,
            0.0, 0.0, 0.0, 0.0, 1.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        let e = exponential(&matrix, 5);
        // A bulge 6 s(1 − s) over the tick has mean 1, starts with slope 6 and has the second derivative −12.
        let bulge = |row: usize| 6.0 * e[row + 3] - 12.0 * e[row + 4];
        Ok(TwoPolePropagator {
            rows: [
                [e[0], e[1] * tick_s, e[2], e[3], bulge(0)],
                [e[5] / tick_s, e[6], e[7] / tick_s, e[8] / tick_s, bulge(5) / tick_s],
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

/// Exact propagation of the finite-element rod over one tick, with its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RodElementsPropagator {
    nodes: usize,
    tick_s: f64,
    force_per_strain_n: f64,
    /// Φ by rows, (2n)².
    transition: Vec<f64>,
    /// Γ₀ and Γ₁, 2n each.
    held: Vec<f64>,
    changing: Vec<f64>,
    /// Displacements of nodes 1…n (m), then their velocities times the tick (m).
    state: Vec<f64>,
    next: Vec<f64>,
}

impl RodElementsPropagator {
    /// Starts at rest. Refuses a tick that is not positive. Allocates here and never again.
    pub fn new(elements: &RodElements, tick_s: f64) -> Result<Self, ModelError> {
        require_positive(tick_s, "tick", "s")?;
        let nodes = elements.count();
        let size = 2 * nodes + 2;
        let mut matrix = vec![0.0; size * size];
        for node in 0..nodes {
            matrix[node * size + nodes + node] = 1.0;
        }
        let mut place = |column: usize, load: Vec<f64>, factor: f64| {
            for (node, entry) in solve_mass(elements, load).into_iter().enumerate() {
                matrix[(nodes + node) * size + column] = factor * entry;
            }
        };
        for column in 0..nodes {
            let column_of = |own: &[f64], beside: f64| {
                let mut load = vec![0.0; nodes];
                load[column] = own[column];
                if column > 0 {
                    load[column - 1] = beside;
                }
                if column + 1 < nodes {
                    load[column + 1] = beside;
                }
                load
            };
            let (stiffness, damping) = (&elements.stiffness, &elements.damping);
            place(
                column,
                column_of(&stiffness.diagonal, stiffness.beside),
                -tick_s * tick_s,
            );
            place(nodes + column, column_of(&damping.diagonal, damping.beside), -tick_s);
        }
        let mut tip = vec![0.0; nodes];
        tip[nodes - 1] = 1.0;
        place(2 * nodes, tip, tick_s * tick_s);
        matrix[(size - 2) * size + size - 1] = 1.0;
        let e = exponential(&matrix, size);
        let states = 2 * nodes;
        let column = |index: usize| (0..states).map(|row| e[row * size + index]).collect();
        Ok(RodElementsPropagator {
            nodes,
            tick_s,
            force_per_strain_n: elements.constants().force_per_strain_n(),
            transition: (0..states)
                .flat_map(|row| e[row * size..row * size + states].to_vec())
                .collect(),
            held: column(states),
            changing: column(states + 1),
            state: vec![0.0; states],
            next: vec![0.0; states],
        })
    }

    /// One tick: free strain (no unit) and tip force (N) each go linearly from the first to the second of their pair.
    pub fn advance(&mut self, strain: (f64, f64), force_n: (f64, f64)) {
        let from = self.force_per_strain_n * strain.0 + force_n.0;
        let change = self.force_per_strain_n * strain.1 + force_n.1 - from;
        let states = self.state.len();
        for (row, next) in self.next.iter_mut().enumerate() {
            let mut sum = self.held[row] * from + self.changing[row] * change;
            let entries = &self.transition[row * states..(row + 1) * states];
            for (entry, state) in entries.iter().zip(&self.state) {
                sum += entry * state;
            }
            *next = sum;
        }
        std::mem::swap(&mut self.state, &mut self.next);
    }

    /// Displacement of the tip, m.
    pub fn tip_displacement_m(&self) -> f64 {
        self.state[self.nodes - 1]
    }

    /// Velocity of the tip, m/s.
    pub fn tip_velocity_m_per_s(&self) -> f64 {
        self.state[2 * self.nodes - 1] / self.tick_s
    }
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
