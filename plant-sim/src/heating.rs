//! C·dT/dt = P − (T − T_ambient)/R,  P = (H/κ)²·R_coil(1 + β(T − T₀)): what warms the rod, in the numbers of data sheets.
//!
//! T temperature (K), C heat capacity (J/K), R thermal resistance (K/W), P loss (W), H field in the coil (A/m), κ field per
//! current (A/m per A), β copper's temperature coefficient (1/K). The model is [`Warming`], its expansion the effect of that name.

use anhyst_ipc::Invalid;
use anhyst_model::{Effect, EffectKind, ModelError, Warming};
use serde::{Deserialize, Serialize};

/// Heat into the rod: coil loss, and the cut's while the tool is in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heating {
    /// Loss of the coil; none: a coil with a cooling of its own.
    #[serde(default)]
    pub coil: Option<CoilLoss>,
    /// The rod between its heaters and the surroundings.
    pub circuit: ThermalCircuit,
}

/// One lumped temperature between a heater and the surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalCircuit {
    /// Of the surroundings.
    pub ambient_k: f64,
    /// C.
    pub heat_capacity_j_per_k: f64,
    /// R.
    pub resistance_k_per_w: f64,
}

/// Ohmic loss of the coil.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoilLoss {
    /// At `reference_temperature_k`.
    pub resistance_ohm: f64,
    /// κ, A/m per A.
    pub field_per_ampere: f64,
    /// 0.0039 1/K for copper.
    pub copper_temperature_coefficient_per_k: f64,
    /// T₀.
    pub reference_temperature_k: f64,
}

/// λ_T = ε(T − T₀): the rod's own expansion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExpansionSettings {
    /// ε, 12e-6 1/K for Terfenol-D.
    pub coefficient_per_k: f64,
    /// T₀.
    pub reference_temperature_k: f64,
}

impl Heating {
    /// A rod that starts at this temperature.
    pub(crate) fn warming(&self, start_temperature_k: f64, tick_s: f64) -> Warming {
        let circuit = &self.circuit;
        let loss_time_s = circuit.resistance_k_per_w * circuit.heat_capacity_j_per_k;
        let (heating_k_per_s, resistance, resistance_per_k) = self.coil.map_or((0.0, 1.0, 0.0), |coil| {
            let current = Warming::REFERENCE_FIELD_A_PER_M / coil.field_per_ampere;
            let per_k = coil.copper_temperature_coefficient_per_k;
            (
                current * current * coil.resistance_ohm / circuit.heat_capacity_j_per_k,
                1.0 + per_k * (circuit.ambient_k - coil.reference_temperature_k),
                per_k,
            )
        });
        Warming::new(heating_k_per_s, loss_time_s, tick_s)
            .with_resistance(resistance, resistance_per_k)
            .risen_by(start_temperature_k - circuit.ambient_k)
    }

    /// # Errors
    /// The first number that no rod and no coil has; products of two such numbers might no longer be numbers.
    pub(crate) fn validate(&self) -> Result<(), Invalid> {
        let circuit = &self.circuit;
        let hot = (0.0, 1e4, "at most 10 000 K");
        positive("circuit", "ambient temperature", circuit.ambient_k, "K", hot)?;
        let most = (0.0, 1e9, "at most 1e9 J/K");
        positive("circuit", "heat capacity", circuit.heat_capacity_j_per_k, "J/K", most)?;
        let most = (0.0, 1e9, "at most 1e9 K/W");
        positive("circuit", "thermal resistance", circuit.resistance_k_per_w, "K/W", most)?;
        let Some(coil) = &self.coil else { return Ok(()) };
        let most = (0.0, 1e9, "at most 1e9 ohm");
        not_negative("coil", "coil resistance", coil.resistance_ohm, "ohm", most)?;
        let range = (1e-3, 1e9, "between 1e-3 and 1e9 A/m per A");
        positive("coil", "field per ampere", coil.field_per_ampere, "A/m per A", range)?;
        let (name, per_k) = (
            "temperature coefficient of the coil",
            coil.copper_temperature_coefficient_per_k,
        );
        not_negative("coil", name, per_k, "1/K", (0.0, 1.0, "at most 1 1/K"))?;
        positive(
            "coil",
            "coil reference temperature",
            coil.reference_temperature_k,
            "K",
            hot,
        )
    }
}

impl ExpansionSettings {
    /// The effect of an actuator whose ambient temperature is the reference, and whose own temperature is known.
    ///
    /// # Errors
    /// A coefficient that no rod has.
    pub(crate) fn effect(&self) -> Result<Effect, ModelError> {
        Effect::identity(EffectKind::ThermalExpansion).with("expansion_per_k", self.coefficient_per_k)
    }

    pub(crate) fn validate(&self) -> Result<(), Invalid> {
        self.effect().map_err(|error| Invalid::new("", error.to_string()))?;
        let everything = (0.0, f64::MAX, "");
        positive(
            "",
            "expansion reference temperature",
            self.reference_temperature_k,
            "K",
            everything,
        )
    }
}

fn positive(path: &str, quantity: &'static str, value: f64, unit: &'static str, range: Range) -> Result<(), Invalid> {
    within(path, quantity, value, unit, (value > 0.0, "finite and above 0"), range)
}

fn not_negative(
    path: &str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    range: Range,
) -> Result<(), Invalid> {
    within(
        path,
        quantity,
        value,
        unit,
        (value >= 0.0, "finite and not below 0"),
        range,
    )
}

/// Lower and upper limit, and what to say beyond.
type Range = (f64, f64, &'static str);

fn within(
    path: &str,
    quantity: &'static str,
    value: f64,
    unit: &'static str,
    sign: (bool, &'static str),
    (low, high, beyond): Range,
) -> Result<(), Invalid> {
    let requirement = match sign {
        (true, _) if (low..=high).contains(&value) => return Ok(()),
        (true, _) if value.is_finite() => beyond,
        (_, requirement) => requirement,
    };
    let refusal = ModelError::OutOfRange {
        quantity,
        value,
        unit,
        requirement,
    };
    Err(Invalid::new(path, refusal.to_string()))
}
