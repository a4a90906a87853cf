//! What can be told of a run before it: the resonance, what the motion asks of the actuator and what that can give, and what the
//! sensor's noise leaves.

use super::Scenario;
use anhyst_controller::StrainLaw;
use anhyst_ipc::Invalid;
use anhyst_model::{HysteresisLaw, MagneticState, Material, TwoPole};
use serde::Serialize;

/// Numbers are in the scenario's units ([`Scenario::units`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Foresight {
    /// Of the rod or the stage as it is believed, undamped.
    pub resonance_hz: f64,
    pub damping_ratio: f64,
    /// Ends of the displacement that the trajectory asks of the actuator at rest, start included; none where nothing is followed.
    pub asks_m: Option<[f64; 2]>,
    /// What it gives within the guard's limit, from rest.
    pub gives_m: [f64; 2],
    /// What brings the largest displacement that is asked for, from rest and slowly.
    pub field_a_per_m: Option<f64>,
    pub field_limit_a_per_m: f64,
    /// What the tip does of the sensor's noise through the feedback, rms: no error stays below.
    pub floor_rms_m: Option<f64>,
}

/// From rest to a magnetization.
pub(crate) struct Way {
    /// The input that brings it, or the limit.
    pub input: f64,
    pub reached: f64,
    pub reaches: bool,
}

impl Scenario {
    /// See [`Foresight`].
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn foresight(&self) -> Result<Foresight, Invalid> {
        let (material, rod) = self.believed()?;
        let limit = self.guard.acting_field_limit_a_per_m();
        let controller = (!self.inverse.is_open_loop()).then(|| self.controller()).transpose()?;
        let peak = controller.as_ref().map(|own| own.peak_magnetization(self.duration_s));
        let noise_m = self.plant.sensors.displacement_noise_m;
        let floor = self.controller.feedback.as_ref().filter(|_| controller.is_some());
        Ok(Foresight {
            resonance_hz: rod.natural_frequency_hz(),
            damping_ratio: rod.damping_ratio(),
            asks_m: controller.map(|own| own.asks_m(self.duration_s).into()),
            gives_m: gives_m(&material, &rod, limit),
            field_a_per_m: peak.map(|peak| self.way_to(&material, peak.magnetization_a_per_m, limit).input),
            field_limit_a_per_m: limit,
            floor_rms_m: floor
                .map(|_| Ok(noise_m * self.loop_shape()?.noise_gain()))
                .transpose()?,
        })
    }

    /// From rest to a magnetization, within a limit of the input.
    pub(crate) fn way_to(&self, material: &Material, asked: f64, limit: f64) -> Way {
        if let Some(law) = &material.law {
            let rest = law.model.rest();
            let zero = law.model.output(&rest);
            let (input, reaches) = law.model.input_for(&rest, asked + zero, limit);
            let reached = law.model.ahead(&rest, input).0 - zero;
            return Way {
                input,
                reached,
                reaches,
            };
        }
        let rest = MagneticState::default();
        let way = material.hysteresis.advance_to_magnetization(rest, asked, limit);
        Way {
            input: way.state.field_a_per_m,
            reached: way.state.magnetization_a_per_m,
            reaches: !way.limited,
        }
    }
}

/// Ends of the displacement from rest within a limit of the input, of a law within the inputs that it was fitted to, too.
pub fn gives_m(material: &Material, rod: &TwoPole, limit: f64) -> [f64; 2] {
    if let Some(law) = &material.law {
        let [low, high] = law.input_extent;
        let within = anhyst_model::MaterialLaw {
            input_extent: [low.max(-limit), high.min(limit)],
            ..law.clone()
        };
        return within.reach();
    }
    let strain = StrainLaw::new(rod, material);
    let saturation = strain.saturation_a_per_m();
    let rest = MagneticState::default();
    let ends = [-saturation, saturation].map(|asked| {
        let way = material.hysteresis.advance_to_magnetization(rest, asked, limit);
        strain.displacement_m(way.state.magnetization_a_per_m)
    });
    [ends[0].min(ends[1]), ends[0].max(ends[1])]
}
