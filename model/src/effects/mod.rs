//! What a nominal actuator leaves out: one physical effect a file, each with its equation, bounds, signature and source.
//!
//! An [`Effect`] is a kind and its values; [`crate::ActuatorModel`] puts effects where they belong in the chain
//! command → coil field → field in the material → M → M with creep → free strain → tip → what the sensor says.
//! With every *size* of an effect at its identity the effect is absent, and the chain is the nominal one; just beside
//! it the output changes smoothly where [`EffectKind::differentiable`] says so, which is what a score test needs.
//! Adding one: a file here, a line in `library!`, its place in `crate::actuator`, and the table in `docs/effects.md`.

mod description;
mod effect;
mod notation;

pub(crate) mod delay_line;
pub(crate) mod field_lag;
pub(crate) mod intersample_field;
pub(crate) mod lag;
pub(crate) mod limit;
pub(crate) mod second_order;
pub(crate) mod signal;
pub(crate) mod warming;

pub(crate) mod accommodation;
pub(crate) mod after_effect;
pub(crate) mod amplifier_bandwidth;
pub(crate) mod amplifier_saturation;
pub(crate) mod amplifier_slew;
pub(crate) mod backlash;
pub(crate) mod bias_shift;
pub(crate) mod coil_heating;
pub(crate) mod delta_e;
pub(crate) mod eddy_current;
pub(crate) mod excess_loss;
pub(crate) mod friction;
pub(crate) mod load_change;
pub(crate) mod loop_delay;
pub(crate) mod periodic_disturbance;
pub(crate) mod prestress;
pub(crate) mod quadratic_magnetostriction;
pub(crate) mod quantisation;
pub(crate) mod second_mode;
pub(crate) mod sensor_delay;
pub(crate) mod sensor_drift;
pub(crate) mod sensor_gain;
pub(crate) mod sensor_saturation;
pub(crate) mod stiffening;
pub(crate) mod thermal_drift;
pub(crate) mod thermal_expansion;

use serde::{Deserialize, Serialize};

use crate::Material;
use crate::parameter::ParameterSpec;

pub use description::{CoilNeed, Description, Stage};
pub use effect::Effect;

/// Declares the kinds from one list: name and file are the same word.
macro_rules! library {
    ($($kind:ident in $file:ident),* $(,)?) => {
        /// The effects of the library, in the order of the chain.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum EffectKind {
            $(#[doc = concat!("`", stringify!($file), "`")] $kind,)*
        }

        const NAMES: &[&str] = &[$(stringify!($file)),*];
        /// As they stand in a model file.
        const VARIANTS: &[&str] = &[$(stringify!($kind)),*];
        const DESCRIPTIONS: [&Description; NAMES.len()] = [$(&$file::DESCRIPTION),*];

        impl EffectKind {
            /// Every kind, in the order of the chain.
            pub const ALL: [EffectKind; NAMES.len()] = [$(EffectKind::$kind),*];
        }
    };
}

library! {
    LoopDelay in loop_delay,
    AmplifierSaturation in amplifier_saturation,
    AmplifierSlew in amplifier_slew,
    AmplifierBandwidth in amplifier_bandwidth,
    CoilHeating in coil_heating,
    EddyCurrent in eddy_current,
    BiasShift in bias_shift,
    ExcessLoss in excess_loss,
    ThermalDrift in thermal_drift,
    Prestress in prestress,
    Accommodation in accommodation,
    AfterEffect in after_effect,
    QuadraticMagnetostriction in quadratic_magnetostriction,
    ThermalExpansion in thermal_expansion,
    LoadChange in load_change,
    DeltaE in delta_e,
    Stiffening in stiffening,
    Friction in friction,
    PeriodicDisturbance in periodic_disturbance,
    Backlash in backlash,
    SecondMode in second_mode,
    SensorDelay in sensor_delay,
    SensorGain in sensor_gain,
    SensorDrift in sensor_drift,
    SensorSaturation in sensor_saturation,
    Quantisation in quantisation,
}

impl EffectKind {
    /// Name in reports, `eddy_current`.
    pub fn name(self) -> &'static str {
        NAMES[self as usize]
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Name in a model file, `EddyCurrent`.
    pub(crate) fn variant(self) -> &'static str {
        VARIANTS[self as usize]
    }

    /// All that is said of it, as data.
    pub fn description(self) -> &'static Description {
        DESCRIPTIONS[self as usize]
    }

    /// As in its [`Description`].
    pub fn stage(self) -> Stage {
        self.description().stage
    }

    /// As in its [`Description`].
    pub fn parameters(self) -> &'static [ParameterSpec] {
        self.description().parameters
    }

    /// The same for an actuator of that material: fields and lengths count in what its law takes and gives.
    pub fn parameters_of(self, material: &Material) -> impl Iterator<Item = ParameterSpec> {
        let sizes = material.decades();
        self.parameters().iter().map(move |own| own.sized(sizes))
    }

    /// As in its [`Description`].
    pub fn needs_time(self) -> bool {
        self.description().needs_time
    }

    /// It acts on the moving rod, so a model without a rod cannot have it.
    pub fn needs_rod(self) -> bool {
        self.stage() == Stage::Rod
    }

    /// Without a coil it is not there.
    pub fn needs_coil(self, temperature_is_measured: bool) -> bool {
        match self.description().coil {
            CoilNeed::Never => false,
            CoilNeed::UnlessTemperatureIsMeasured => !temperature_is_measured,
            CoilNeed::Always => true,
        }
    }
}
