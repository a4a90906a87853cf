//! Effects that a drawn run can hide, by the names of `docs/effects.md`; those that no library should hold begin with `x_`.
//!
//! Each grows with one strength: 0 absent, 1 some hundred nanometres with an ordinary drive. Sign, proportions and, where they are
//! free, the constants inside come from the run's seed.

use crate::draw::Draw;
use crate::hidden::Constants;
use crate::rig::Rig;

/// A named number of what is hidden, as a diagnosis calls it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    pub name: &'static str,
    pub value: f64,
}

/// What can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    LoopDelay,
    AmplifierSaturation,
    AmplifierSlew,
    AmplifierBandwidth,
    CoilHeating,
    EddyCurrent,
    BiasShift,
    ExcessLoss,
    ThermalDrift,
    Prestress,
    Accommodation,
    AfterEffect,
    QuadraticMagnetostriction,
    ThermalExpansion,
    LoadChange,
    DeltaE,
    Stiffening,
    Friction,
    Backlash,
    SecondMode,
    SensorDelay,
    SensorSaturation,
    Quantisation,
    /// M(1 + r sin(M/M_r)).
    XRipple,
    /// More stiffness at one place.
    XBump,
    /// An encoder's interpolation error.
    XEncoder,
    /// Drag of the square of the speed.
    XDrag,
    /// A gain that sags after activity.
    XFatigue,
    /// Another pinning on the way up than on the way down.
    XAsymmetry,
}

/// How large the run without the effect is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peaks {
    pub field_a_per_m: f64,
    pub field_rate: f64,
    pub displacement_m: f64,
}

/// Draws of one effect that stay while its strength is sought.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    sign: f64,
    /// Between 0 and 1.
    places: [f64; 3],
    constants: Constants,
    damping_ratio: f64,
}

impl Shape {
    /// `free`: constants inside effects are drawn, and not the usual ones.
    pub fn drawn(draw: &mut Draw, free: bool) -> Self {
        let mut factor = |low: f64, high: f64| {
            let drawn = draw.log_between(low, high);
            if free { drawn } else { 1.0 }
        };
        let usual = Constants::USUAL;
        let constants = Constants {
            creep_stretch: factor(0.5, 2.0),
            friction_speed_m_per_s: usual.friction_speed_m_per_s * factor(0.3, 3.0),
            loss_time_s: usual.loss_time_s * factor(0.3, 3.0),
            coil_loss_time_s: usual.coil_loss_time_s * factor(0.3, 3.0),
            loss_exponent: usual.loss_exponent * factor(0.7, 1.4),
            ..usual
        };
        let damping_ratio = 0.03 * factor(0.3, 2.5);
        let play_start = if free { draw.between(-1.0, 1.0) } else { 0.0 };
        let places = std::array::from_fn(|_| draw.between(0.0, 1.0));
        Shape {
            sign: draw.sign(),
            places,
            constants: Constants {
                play_start,
                ripple_a_per_m: 15e3 * 4_f64.powf(places[0]),
                bump_m: [(places[0] - 0.5) * 3e-5, 3e-6 * 3_f64.powf(places[1])],
                ..constants
            },
            damping_ratio,
        }
    }

    /// Uniform in the logarithm.
    fn place(&self, place: usize, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.places[place])
    }
}

impl Effect {
    /// In the order of the chain.
    pub const LISTED: [Effect; 23] = [
        Effect::LoopDelay,
        Effect::AmplifierSaturation,
        Effect::AmplifierSlew,
        Effect::AmplifierBandwidth,
        Effect::CoilHeating,
        Effect::EddyCurrent,
        Effect::BiasShift,
        Effect::ExcessLoss,
        Effect::ThermalDrift,
        Effect::Prestress,
        Effect::Accommodation,
        Effect::AfterEffect,
        Effect::QuadraticMagnetostriction,
        Effect::ThermalExpansion,
        Effect::LoadChange,
        Effect::DeltaE,
        Effect::Stiffening,
        Effect::Friction,
        Effect::Backlash,
        Effect::SecondMode,
        Effect::SensorDelay,
        Effect::SensorSaturation,
        Effect::Quantisation,
    ];
    pub const UNLISTED: [Effect; 6] = [
        Effect::XRipple,
        Effect::XBump,
        Effect::XEncoder,
        Effect::XDrag,
        Effect::XFatigue,
        Effect::XAsymmetry,
    ];
    /// Those for which physics knows more than one law.
    pub const OF_TWO_LAWS: [Effect; 11] = [
        Effect::AmplifierSaturation,
        Effect::AmplifierBandwidth,
        Effect::EddyCurrent,
        Effect::ExcessLoss,
        Effect::ThermalDrift,
        Effect::AfterEffect,
        Effect::QuadraticMagnetostriction,
        Effect::Friction,
        Effect::Backlash,
        Effect::SecondMode,
        Effect::SensorSaturation,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Effect::LoopDelay => "loop_delay",
            Effect::AmplifierSaturation => "amplifier_saturation",
            Effect::AmplifierSlew => "amplifier_slew",
            Effect::AmplifierBandwidth => "amplifier_bandwidth",
            Effect::CoilHeating => "coil_heating",
            Effect::EddyCurrent => "eddy_current",
            Effect::BiasShift => "bias_shift",
            Effect::ExcessLoss => "excess_loss",
            Effect::ThermalDrift => "thermal_drift",
            Effect::Prestress => "prestress",
            Effect::Accommodation => "accommodation",
            Effect::AfterEffect => "after_effect",
            Effect::QuadraticMagnetostriction => "quadratic_magnetostriction",
            Effect::ThermalExpansion => "thermal_expansion",
            Effect::LoadChange => "load_change",
            Effect::DeltaE => "delta_e",
            Effect::Stiffening => "stiffening",
            Effect::Friction => "friction",
            Effect::Backlash => "backlash",
            Effect::SecondMode => "second_mode",
            Effect::SensorDelay => "sensor_delay",
            Effect::SensorSaturation => "sensor_saturation",
            Effect::Quantisation => "quantisation",
            Effect::XRipple => "x_ripple",
            Effect::XBump => "x_bump",
            Effect::XEncoder => "x_encoder",
            Effect::XDrag => "x_drag",
            Effect::XFatigue => "x_fatigue",
            Effect::XAsymmetry => "x_asymmetry",
        }
    }

    pub fn is_listed(self) -> bool {
        !Effect::UNLISTED.contains(&self)
    }

    /// Puts it into a rig at a strength; its numbers.
    pub(crate) fn hide(self, rig: &mut Rig, strength: f64, shape: &Shape, peaks: &Peaks) -> Vec<Value> {
        let Rig { hidden, sensor, .. } = rig;
        let mut values = Vec::new();
        let mut is = |name: &'static str, value: f64| {
            values.push(Value { name, value });
            value
        };
        let (s, signed, own) = (strength, strength * shape.sign, shape.constants);
        let constants = &mut hidden.constants;
        match self {
            Effect::LoopDelay => hidden.loop_delay_s = is("delay_s", 5e-5 * s),
            Effect::AmplifierSaturation => {
                hidden.field_limit_a_per_m = is("field_limit_a_per_m", peaks.field_a_per_m / (1.0 + 0.1 * s));
            }
            Effect::AmplifierSlew => {
                hidden.slew_a_per_m_s = is("slew_limit_a_per_m_s", peaks.field_rate / (1.0 + 0.5 * s));
            }
            Effect::AmplifierBandwidth => hidden.amplifier_lag_s = is("time_constant_s", 5e-5 * s),
            Effect::CoilHeating => {
                hidden.coil_heating_k_per_s = is("heating_k_per_s", 2.0 * s);
                constants.coil_loss_time_s = is("loss_time_s", own.coil_loss_time_s);
            }
            Effect::EddyCurrent => hidden.eddy_current_s = is("time_constant_s", 5e-5 * s),
            Effect::BiasShift => hidden.bias_a_per_m = is("bias_field_a_per_m", 50.0 * signed),
            Effect::ExcessLoss => {
                hidden.pinning_growth = is("pinning_growth", 0.05 * s);
                constants.loss_exponent = is("exponent", own.loss_exponent);
            }
            Effect::ThermalDrift => {
                hidden.rod_heating_k_per_s = is("heating_k_per_s", 3.0 * s);
                constants.loss_time_s = is("loss_time_s", own.loss_time_s);
            }
            Effect::Prestress => hidden.cubic_coupling = is("cubic_coupling_m2_per_a2", 1e-14 * signed),
            Effect::Accommodation => hidden.relaxing_share = is("relaxing_share", 0.02 * s),
            Effect::AfterEffect => {
                hidden.creep = is("fraction", 0.02 * s);
                constants.creep_stretch = own.creep_stretch;
                is("shortest_s", 0.03 * own.creep_stretch);
                is("longest_s", 3.0 * own.creep_stretch);
            }
            Effect::QuadraticMagnetostriction => hidden.quadratic = is("quadratic_fraction", 0.05 * signed),
            Effect::ThermalExpansion => {
                hidden.expanding_heating_k_per_s = is("heating_k_per_s", 0.2 * s);
                constants.loss_time_s = is("loss_time_s", own.loss_time_s);
            }
            Effect::LoadChange => {
                hidden.more_stiffness = is("relative_stiffness", 0.02 * signed * shape.places[0]);
                hidden.more_mass = is("relative_mass", 0.3 * signed * (1.0 - shape.places[0]));
            }
            Effect::DeltaE => hidden.delta_e = is("relative_growth", 0.5 * s),
            Effect::Stiffening => hidden.cubic_stiffness_per_m2 = is("cubic_stiffness_per_m2", 1e7 * s),
            Effect::Friction => {
                hidden.friction_m = is("friction_m", 0.7e-6 * s);
                constants.friction_speed_m_per_s = is("speed_m_per_s", own.friction_speed_m_per_s);
            }
            Effect::Backlash => {
                hidden.backlash_m = is("gap_m", 1e-6 * s);
                constants.play_start = own.play_start;
            }
            Effect::SecondMode => {
                sensor.mode.gain = is("gain", 0.05 * signed);
                sensor.mode.hz = is("frequency_hz", shape.place(1, 150.0, 900.0));
                sensor.mode.damping_ratio = is("damping_ratio", shape.damping_ratio);
            }
            Effect::SensorDelay => sensor.delay_s = is("delay_s", 5e-5 * s),
            Effect::SensorSaturation => sensor.limit_m = is("limit_m", peaks.displacement_m / (1.0 + 0.1 * s)),
            Effect::Quantisation => sensor.resolution_m = is("step_m", 1e-6 * s),
            Effect::XRipple => {
                hidden.ripple = is("ripple", 0.02 * s);
                constants.ripple_a_per_m = is("period_a_per_m", own.ripple_a_per_m);
            }
            Effect::XBump => {
                hidden.bump = is("bump", 0.2 * s);
                constants.bump_m = own.bump_m;
            }
            Effect::XEncoder => {
                sensor.encoder_m = [is("error_m", 0.3e-6 * s), is("period_m", shape.place(0, 2e-6, 1.2e-5))];
            }
            Effect::XDrag => hidden.drag_per_m = is("drag_per_m", 5e5 * s),
            Effect::XFatigue => sensor.fatigue = is("fatigue", 0.03 * s),
            Effect::XAsymmetry => hidden.asymmetry = is("asymmetry", 0.03 * s * shape.sign),
        }
        values
    }

    /// Whether these numbers are physics still.
    pub(crate) fn is_sane(rig: &Rig) -> bool {
        let (hidden, sensor) = (&rig.hidden, &rig.sensor);
        hidden.relaxing_share <= 1.0
            && hidden.delta_e <= 5.0
            && hidden.creep <= 0.5
            && hidden.quadratic.abs() <= 1.0
            && hidden.asymmetry.abs() <= 0.5
            && hidden.more_mass > -0.8
            && hidden.more_stiffness > -0.8
            && hidden.cubic_coupling.abs() <= 5e-13
            && !rig.material.stressed(hidden.cubic_coupling).folds()
            && hidden.loop_delay_s <= 0.01
            && hidden.friction_m <= 2e-5
            && sensor.mode.gain.abs() <= 1.0
            && sensor.delay_s <= 0.01
    }

    /// Whether a load is beyond three tolerances of the rod's constants: a smaller one is the same rod with other constants, and no effect.
    pub(crate) fn is_no_calibration(rig: &Rig) -> bool {
        let (mass, stiffness) = (rig.hidden.more_mass, rig.hidden.more_stiffness);
        (mass, stiffness) == (0.0, 0.0) || mass.abs() > 0.15 || stiffness.abs() > 0.06
    }
}
