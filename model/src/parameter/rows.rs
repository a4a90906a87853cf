//! Rows of the constants of the nominal chain: material, strain law, rod.
//!
//! Priors hold where all are calibrated together: 20 % of Ms, a, k, w and of the rod's constants, 0.05 in α, 0.2 in c (ranges
//! of published Terfenol-D). Tolerances hold where a model is believed and only its small errors are taken up: what repeated
//! identification of one actuator spreads by. c ends at 0.98 everywhere: soft ferrites are fitted up to there, and a model
//! that one command writes must lie within the bounds of the next; at 1 nothing is irreversible and k has no meaning.

/// What bounds, smallest change and prior of a row are counted in.
#[derive(Clone, Copy)]
pub(crate) enum Counted {
    /// Shares of the nominal value.
    Shares,
    /// Its unit, bounds from the nominal value on.
    Offsets,
    /// Its unit.
    Values,
}

/// A row before the nominal value is known.
pub(crate) struct Row {
    pub name: &'static str,
    pub symbol: &'static str,
    /// As the term of a diagnosis.
    pub term: &'static str,
    pub unit: &'static str,
    pub counted: Counted,
    pub bounds: [f64; 2],
    /// A change worth noticing.
    pub change: f64,
    pub prior_deviation: f64,
    /// Standard deviation of the constant itself: a share of its value, or of what it is counted in.
    pub tolerance: f64,
}

const fn shares(
    name: &'static str,
    symbol: &'static str,
    term: &'static str,
    unit: &'static str,
    tolerance: f64,
) -> Row {
    Row {
        name,
        symbol,
        term,
        unit,
        counted: Counted::Shares,
        bounds: [0.2, 5.0],
        change: 1e-3,
        prior_deviation: 0.2,
        tolerance,
    }
}

/// Of c, in every search.
pub const REVERSIBILITY_BOUNDS: (f64, f64) = (0.0, 0.98);

/// In the order of [`crate::HysteresisParameter::ALL`].
pub(crate) const HYSTERESIS: [Row; 5] = [
    shares("saturation_magnetization_a_per_m", "Ms", "parameter_Ms", "A/m", 0.01),
    shares("shape_a_per_m", "a", "parameter_a", "A/m", 0.015),
    shares("pinning_a_per_m", "k", "parameter_k", "A/m", 0.03),
    Row {
        counted: Counted::Offsets,
        bounds: [-0.3, 0.3],
        change: 1e-4,
        prior_deviation: 0.05,
        ..shares("coupling", "alpha", "parameter_alpha", "", 5e-4)
    },
    Row {
        counted: Counted::Values,
        bounds: [REVERSIBILITY_BOUNDS.0, REVERSIBILITY_BOUNDS.1],
        ..shares("reversibility", "c", "parameter_c", "", 0.06)
    },
];
const ROD_GAIN: Row = shares("gain", "w", "parameter_w", "m/s² per A/m", 0.01);
const STRAIN_CONSTANT: Row = shares("saturation_magnetostriction", "w", "parameter_w", "", 0.01);
const DAMPING: Row = shares("damping_per_s", "damping", "parameter_damping", "1/s", 0.05);
const STIFFNESS: Row = shares("stiffness_per_s2", "stiffness", "parameter_stiffness", "1/s²", 0.02);

/// Of the nominal chain, in the order of [`crate::NominalParameter::ALL`].
pub(crate) fn nominal_rows(with_rod: bool) -> [&'static Row; 8] {
    let [saturation, shape, pinning, coupling, reversibility] = &HYSTERESIS;
    let gain = if with_rod { &ROD_GAIN } else { &STRAIN_CONSTANT };
    [
        saturation,
        shape,
        pinning,
        coupling,
        reversibility,
        gain,
        &DAMPING,
        &STIFFNESS,
    ]
}
