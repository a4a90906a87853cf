//! Magnetization from flux density: M = B/μ0 − H.
//!
//! M magnetization, H field inside the material (A/m), B flux density (T), μ0 (T·m/A).

/// μ0, T·m/A (CODATA 2022).
pub const VACUUM_PERMEABILITY_T_M_PER_A: f64 = 1.256_637_061_27e-6;

/// M = B/μ0 − H.
pub(crate) fn magnetization_a_per_m(flux_density_t: f64, field_a_per_m: f64) -> f64 {
    flux_density_t / VACUUM_PERMEABILITY_T_M_PER_A - field_a_per_m
}
