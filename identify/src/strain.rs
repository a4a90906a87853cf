//! λ = γ·M² + λ0: the quadratic strain law, fitted by linear least squares to measured strain and modelled M.
//!
//! λ strain, λ0 its arbitrary zero (one per loop), γ in m²/A², 3λs/2 = γ·Ms², so λs = 2γMs²/3 belongs to the Ms it is
//! quoted with. M in A/m, free of the instrument's offset. Source: the paper's (8).

use crate::observed::ObservedLoop;
use crate::simulate::range;

/// γ and the zero of strain of every loop.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrainLaw {
    pub gamma_m2_per_a2: f64,
    pub zero: Vec<f64>,
}

impl StrainLaw {
    /// Least squares over all loops that have strain, each weighted by its own range and length; none if none has it.
    pub fn solve(loops: &[ObservedLoop], magnetizations: &[Vec<f64>]) -> Option<Self> {
        let (mut product, mut square) = (0.0, 0.0);
        for (strain, magnetization) in with_strain(loops, magnetizations) {
            let weight = 1.0 / (range(strain).powi(2) * strain.len() as f64);
            let (mean_strain, mean_square) = (mean(strain), mean_of_squares(magnetization));
            for (seen, m) in strain.iter().zip(magnetization) {
                product += weight * (m * m - mean_square) * (seen - mean_strain);
                square += weight * (m * m - mean_square).powi(2);
            }
        }
        if square == 0.0 {
            return None;
        }
        let gamma_m2_per_a2 = product / square;
        let zero = loops.iter().zip(magnetizations).map(|(measured, magnetization)| {
            let strain = measured.strain.as_deref()?;
            Some(mean(strain) - gamma_m2_per_a2 * mean_of_squares(magnetization))
        });
        let zero = zero.map(Option::unwrap_or_default).collect();
        Some(StrainLaw { gamma_m2_per_a2, zero })
    }

    /// Strain along one loop.
    pub fn along(&self, loop_index: usize, magnetization: &[f64]) -> Vec<f64> {
        magnetization
            .iter()
            .map(|m| self.gamma_m2_per_a2 * m * m + self.zero[loop_index])
            .collect()
    }
}

fn with_strain<'a>(
    loops: &'a [ObservedLoop],
    magnetizations: &'a [Vec<f64>],
) -> impl Iterator<Item = (&'a [f64], &'a [f64])> {
    let both = |(measured, magnetization): (&'a ObservedLoop, &'a Vec<f64>)| {
        Some((measured.strain.as_deref()?, magnetization.as_slice()))
    };
    loops.iter().zip(magnetizations).filter_map(both)
}

fn mean(series: &[f64]) -> f64 {
    series.iter().sum::<f64>() / series.len() as f64
}

fn mean_of_squares(series: &[f64]) -> f64 {
    series.iter().map(|value| value * value).sum::<f64>() / series.len() as f64
}
