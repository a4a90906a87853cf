//! ρA·∂²u/∂t² = ∂N/∂x,  N = EA·∂u/∂x + c_D·A·∂²u/∂x∂t − EA·λ(t),
//! u(t, 0) = 0,  N(t, L) = −k_L·u − c_L·∂u/∂t − M_L·∂²u/∂t² + F  (at x = L).
//!
//! u displacement (m), λ free strain, uniform along the rod, F external tip force (N); constants in [`RodConstants`].
//! Assumptions: linear elasticity, Kelvin-Voigt damping, small displacements, uniform λ.
//! Source: the paper's (10)-(12). It prints the mass's force as M_L·∂²u/∂x∂t: wrong in dimension, and the printed poles come
//! out only with the inertia M_L·∂²u/∂t².

mod constants;
mod elements;
mod exponential;
mod propagation;
mod two_pole;

pub use constants::RodConstants;
pub use elements::RodElements;
pub use propagation::{RodElementsPropagator, RodMotion, RodState, TwoPolePropagator};
pub use two_pole::TwoPole;
