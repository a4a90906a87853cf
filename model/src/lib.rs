//! Physics of a hysteretic actuator: no I/O, no messages, no clock.
//!
//! Field H → magnetization M ([`Hysteresis`], [`Bank`]) → free strain ([`Magnetostriction`]) → displacement (the rod),
//! with heat, sensors and the play operator for noisy fields beside them. [`Actuator`] is the whole chain from the
//! command to what the sensor says, with any of the physical [`effects`] in it.
//! SI units throughout; a bare number's unit is in its name. Every step is a pure function of its state and inputs, allocates
//! nothing, and gives the same bits in debug and release builds and on every processor: only basic operations, `libm`,
//! fixed order, no fused multiply-add.

pub mod actuator;
pub mod amplifier;
pub mod anhysteretic;
mod curve;
pub mod effects;
mod error;
pub mod excitation;
pub mod flicker;
mod kernel;
mod law;
pub mod magnetostriction;
mod material;
mod number;
pub mod parameter;
pub mod play;
pub mod rod;
pub mod sensor;
pub mod turn;

pub use actuator::{
    Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutput, ActuatorOutputs, ActuatorRod, CoilGain,
    Creep, Drive, Expansion, FieldPath, MagneticHalf, MagneticStart, OwnForces, PinningGrowth, SignalPath,
    rod_per_magnetization, rod_per_strain, simulate, validate_effects, with_known_effects,
};
pub use amplifier::{Amplifier, AmplifierConstants, AmplifierOutput};
pub use anhysteretic::Anhysteretic;
pub use effects::lag::Lag;
pub use effects::warming::Warming;
pub use effects::{Effect, EffectKind, Stage};
pub use error::ModelError;
pub use excitation::DriveSignal;
pub use flicker::Flicker;
pub use law::domain_wall::{
    Bank, Hysteresis, HysteresisParameter, Instructions, Inversion, MagneticState, SensitiveState,
};
pub use law::{
    BoucWen, Density, HysteresisLaw, Law, LawModel, LawModelState, LawParameter, LawState, PlayGroup, PlaySum,
    PlaySumState, Preisach, PreisachState, ScaledDomainWall, SlowLag, Warp,
};
pub use magnetostriction::Magnetostriction;
pub use material::{Material, MaterialLaw};
pub use parameter::{NominalParameter, ParameterRole, ParameterSpec, Screening, Signal};
pub use play::Play;
pub use rod::{RodConstants, RodElements, RodElementsPropagator, RodMotion, RodState, TwoPole, TwoPolePropagator};
pub use sensor::{Noise, Sensor};
