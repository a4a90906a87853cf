//! Magnetization → free strain: the law's polynomial, its quadratic part, and thermal expansion.
//!
//! Its mean excess follows from that of M: λ′·mean excess − λ″ΔM²/12 over a tick in which M goes by ΔM.

use serde::{Deserialize, Serialize};

use crate::effects::quadratic_magnetostriction::square_term;
use crate::effects::thermal_expansion::ThermalExpansion;
use crate::{ActuatorModel, EffectKind};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FreeStrain {
    /// Of M, M² and M⁴.
    linear: f64,
    square: f64,
    fourth: f64,
    expansion: Option<ThermalExpansion>,
    ambient_temperature_k: f64,
    /// At the last sample, A/m.
    magnetization: f64,
}

/// What a stretch of the run brings to the strain.
pub(super) struct Magnetized<'a> {
    pub first: bool,
    /// In the coil, where it heats, A/m.
    pub coil_field: &'a [f64],
    pub magnetization: &'a [f64],
    /// Where it need not be reckoned here, K.
    pub temperature: Option<&'a [f64]>,
}

impl FreeStrain {
    pub fn new(model: &ActuatorModel, tick_s: f64) -> Self {
        let saturation = model.material.hysteresis.saturation_magnetization_a_per_m;
        let (linear, square, fourth) = model.material.magnetostriction.coefficients(saturation);
        let values = |kind| model.effect(kind).map(|effect| effect.values());
        let excess = values(EffectKind::QuadraticMagnetostriction).map(|values| square_term(values, &model.material));
        FreeStrain {
            linear,
            square: square + excess.unwrap_or(0.0),
            fourth,
            expansion: values(EffectKind::ThermalExpansion).map(|values| ThermalExpansion::new(values, tick_s)),
            ambient_temperature_k: model.ambient_temperature_k,
            magnetization: 0.0,
        }
    }

    /// Writes the strain, and in `mean_excess` its own for that of M.
    #[inline]
    pub fn pass(&mut self, magnetized: &Magnetized, strain: &mut [f64], mean_excess: &mut [f64]) {
        let magnetization = magnetized.magnetization;
        if magnetized.first {
            self.magnetization = magnetization[0];
        }
        for ((&m, strain), mean_excess) in magnetization.iter().zip(strain).zip(mean_excess) {
            *strain = m * (self.linear + m * (self.square + m * m * self.fourth));
            let (middle, change) = (0.5 * (m + self.magnetization), m - self.magnetization);
            let slope = self.linear + middle * (2.0 * self.square + 4.0 * middle * middle * self.fourth);
            let curvature = 2.0 * self.square + 12.0 * middle * middle * self.fourth;
            *mean_excess = slope * *mean_excess - curvature * change * change * (1.0 / 12.0);
            self.magnetization = m;
        }
    }

    /// Adds thermal expansion, and writes the temperature if it is wanted from here.
    #[inline]
    pub fn expand(&mut self, magnetized: &Magnetized, strain: &mut [f64], mut temperature: Option<&mut [f64]>) {
        let Some(expansion) = &mut self.expansion else {
            return;
        };
        for (index, strain) in strain.iter_mut().enumerate() {
            let rise_k = match magnetized.temperature {
                Some(known) => known[index] - self.ambient_temperature_k,
                None if magnetized.first && index == 0 => {
                    expansion.warming.steady_state(magnetized.coil_field[0]);
                    0.0
                }
                None => expansion.warming.step(magnetized.coil_field[index]),
            };
            *strain += expansion.expansion_per_k * rise_k;
            if let Some(temperature) = temperature.as_deref_mut() {
                temperature[index] = self.ambient_temperature_k + rise_k;
            }
        }
    }
}
