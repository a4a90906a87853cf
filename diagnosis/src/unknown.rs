//! A number that is fitted: what it belongs to, its range, and what is believed of it beforehand.

use anhyst_identify::engine::Coordinate;
use anhyst_model::{EffectKind, Material, NominalParameter, ParameterSpec};

use crate::acquisition::LowPass;
use crate::channel::ChannelKind;
use crate::term::Term;

/// A constant may lie this many standard deviations of its prior from its nominal value.
const BOX_DEVIATIONS: f64 = 3.0;
/// A constant that is set free is believed to this ratio.
const FREE_DEVIATION: f64 = 0.5;
/// Standard deviation of what is believed of the first magnetization, and its bounds, as shares of saturation.
const START_DEVIATION: f64 = 0.26;
const START_BOUND: f64 = 0.9;
/// Of where another law turned round before, as shares of the extent of its input.
const TURN_DEVIATION: f64 = 0.5;
/// Of the zero of a record of the drive, as a share of a: 2 A/m for Terfenol-D.
const DRIVE_ZERO: f64 = 2.0 / 7012.0;
/// Of the corner of a low pass, by ratio: of one that noise shows, and of one that is supposed.
const CORNER_DEVIATION: [f64; 2] = [0.05, 0.3];

/// What a number belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    Nominal(NominalParameter),
    /// A value of an effect, by its place.
    Effect(EffectKind, usize),
    /// Magnetization of a run's first sample, A/m.
    Start(usize),
    /// Field at which another law had turned round before a run, A/m.
    Turn(usize),
    /// By how much the drive exceeds what the record says, A/m.
    DriveZero,
    /// By how much the mean of `a` in a run is above that of the first, A/m.
    ShapeOffset(usize),
    /// By how much `a` drifts over a run, A/m.
    ShapeDrift(usize),
    /// Corner of the recorder's low pass on a kind of channel, Hz.
    Corner(ChannelKind),
}

/// A number that is fitted. A prior's deviation is by ratio where the coordinate is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unknown {
    pub slot: Slot,
    pub value: f64,
    pub coordinate: Coordinate,
}

impl Unknown {
    /// A constant within the box of its prior; one of a model that was itself fitted is free.
    pub fn calibrated(parameter: NominalParameter, spec: &ParameterSpec, fitted: bool) -> Self {
        let nominal = spec.neutral();
        if fitted {
            return Unknown::free(parameter, spec, nominal, nominal);
        }
        let deviation = spec.tolerance.unwrap_or(0.0);
        let reach = BOX_DEVIATIONS * deviation;
        Unknown {
            slot: Slot::Nominal(parameter),
            value: nominal,
            coordinate: Coordinate {
                lower: (nominal - reach).max(spec.lower),
                upper: (nominal + reach).min(spec.upper),
                prior: Some((nominal, deviation)),
                ..Coordinate::of(spec)
            },
        }
    }

    /// A constant that is bound by its range only.
    pub fn free(parameter: NominalParameter, spec: &ParameterSpec, mean: f64, value: f64) -> Self {
        // What a deviation of one means.
        let spread = spec.neutral().abs().max(spec.prior_deviation.unwrap_or(0.0));
        Unknown {
            slot: Slot::Nominal(parameter),
            value,
            coordinate: Coordinate {
                prior: Some((mean, FREE_DEVIATION * spread)),
                ..Coordinate::of(spec)
            },
        }
    }

    /// A value of an effect, of which nothing is believed.
    pub fn of_effect(kind: EffectKind, place: usize, spec: &ParameterSpec, value: f64) -> Self {
        let mut coordinate = Coordinate {
            prior: None,
            ..Coordinate::of(spec)
        };
        if Term::Effect(kind).is_lattice() {
            // The model's answer to its step has no derivative.
            (coordinate.lower, coordinate.upper) = (value, value);
        }
        Unknown {
            slot: Slot::Effect(kind, place),
            value,
            coordinate,
        }
    }

    /// A value inside an effect that is not asked for, believed to a ratio or to a deviation.
    pub fn inner(slot: Slot, spec: &ParameterSpec, usual: f64, deviation: f64) -> Self {
        Unknown {
            slot,
            value: usual,
            coordinate: Coordinate {
                lower: spec.lower,
                upper: spec.upper,
                scale: 0.1,
                logarithmic: spec.logarithmic,
                prior: Some((usual, deviation)),
            },
        }
    }

    /// The magnetization that a run starts from.
    pub fn start(run: usize, material: &Material) -> Self {
        let size = material.start_scale();
        Unknown::about_zero(
            Slot::Start(run),
            START_DEVIATION * size,
            [-START_BOUND * size, START_BOUND * size],
            0.01 * size,
        )
    }

    /// The field at which another law turned round before a run; `extent` of its input, A/m.
    pub fn turn(run: usize, extent: [f64; 2]) -> Self {
        let size = extent[1].max(-extent[0]);
        Unknown::about_zero(Slot::Turn(run), TURN_DEVIATION * size, extent, 0.01 * size)
    }

    /// What is near zero but for a few deviations.
    pub fn wandering(slot: Slot, deviation: f64, scale: f64) -> Self {
        let reach = BOX_DEVIATIONS * deviation;
        Unknown::about_zero(slot, deviation, [-reach, reach], scale)
    }

    fn about_zero(slot: Slot, deviation: f64, [lower, upper]: [f64; 2], scale: f64) -> Self {
        Unknown {
            slot,
            value: 0.0,
            coordinate: Coordinate {
                lower,
                upper,
                scale,
                logarithmic: false,
                prior: Some((0.0, deviation)),
            },
        }
    }

    /// The corner of a recorder's low pass.
    pub fn corner(kind: ChannelKind, low_pass: LowPass) -> Self {
        let deviation = CORNER_DEVIATION[usize::from(low_pass.is_supposed)];
        Unknown {
            slot: Slot::Corner(kind),
            value: low_pass.corner_hz,
            coordinate: Coordinate {
                lower: low_pass.corner_hz * (-BOX_DEVIATIONS * deviation).exp(),
                upper: low_pass.corner_hz * (BOX_DEVIATIONS * deviation).exp(),
                scale: 1.0,
                logarithmic: true,
                prior: Some((low_pass.corner_hz, deviation)),
            },
        }
    }

    /// How far from what was believed, in standard deviations; 0 where nothing was.
    pub fn surprise(&self) -> f64 {
        match self.coordinate.prior {
            Some((mean, deviation)) if self.coordinate.logarithmic => (self.value / mean).ln() / deviation,
            Some((mean, deviation)) => (self.value - mean) / deviation,
            None => 0.0,
        }
    }

    /// It stands at a bound, and a step of its coordinate would leave.
    pub fn leaves(&self, step: f64) -> bool {
        let own = &self.coordinate;
        let at = |bound: f64| (own.free(self.value) - own.free(bound)).abs() < 1e-9;
        (step < 0.0 && at(own.lower)) || (step > 0.0 && at(own.upper))
    }

    /// Change of [`Unknown::surprise`] by a unit of the coordinate.
    pub fn surprise_slope(&self) -> f64 {
        match self.coordinate.prior {
            Some((_, deviation)) if self.coordinate.logarithmic => 1.0 / deviation,
            Some((_, deviation)) => self.coordinate.scale / deviation,
            None => 0.0,
        }
    }
}

/// Standard deviation of the zero of a record of the drive, A/m.
pub(crate) fn drive_zero_a_per_m(material: &Material) -> f64 {
    DRIVE_ZERO * material.hysteresis.shape_a_per_m
}
