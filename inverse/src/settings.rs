//! What a scenario says about the inverse: its structure, its limit, and whether it leads the amplifier's lag.

use anhyst_ipc::Invalid;
use anhyst_model::DriveSignal;
use serde::{Deserialize, Serialize};

/// Settings of the inverse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InverseSettings {
    /// Where the inversion starts from.
    pub structure: Structure,
    /// No command goes beyond this field, either way; none: the guard's limit.
    pub field_limit_a_per_m: Option<f64>,
    /// Command u = H + τ dH/dt, so that the amplifier's first-order lag τ is made up for.
    pub compensate_amplifier: bool,
    /// Send this instead of inverting anything: an open-loop experiment.
    pub drive: Option<DriveSignal>,
    /// Several of them, one after the other, each from its own beginning for so many seconds; the last one goes on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drives: Vec<(DriveSignal, f64)>,
}

/// Where the inversion starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Structure {
    /// From the estimator's state at t_k, carried to t_k+1 with the field that is already on its way.
    #[default]
    FromEstimate,
    /// From its own last answer: pure feedforward, with the estimate's `a` but blind to where the material really is.
    /// For comparison: nothing that changes the field after it (limits, slew, a fallback of the guard) reaches its memory.
    OwnMemory,
    /// H = M/χ with χ = χ₀/(1 − αχ₀), the susceptibility of the material's anhysteretic curve at M = 0 (χ₀ = Ms/3a for
    /// Langevin, Ms/a for Ising): no hysteresis at all. For comparison, and for a PID alone.
    Gain,
}

impl Default for InverseSettings {
    fn default() -> Self {
        Self {
            structure: Structure::default(),
            field_limit_a_per_m: None,
            compensate_amplifier: true,
            drive: None,
            drives: Vec::new(),
        }
    }
}

impl InverseSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self) -> Result<(), Invalid> {
        crate::drive::validate(&self.driven())?;
        if self.drive.is_some() && !self.drives.is_empty() {
            let sentence = "a drive and several of them cannot both be sent: leave one out";
            return Err(Invalid::new("drives", sentence));
        }
        self.field_limit_a_per_m.map_or(Ok(()), |limit| {
            Invalid::unless_positive("field_limit_a_per_m", limit, "A/m")
        })
    }

    /// Fields are prescribed: nothing is inverted, and nothing followed.
    pub fn is_open_loop(&self) -> bool {
        self.drive.is_some() || !self.drives.is_empty()
    }

    /// What is sent, and for how long (s); nothing where something is followed.
    pub fn driven(&self) -> Vec<(DriveSignal, f64)> {
        let single = self.drive.iter().map(|signal| (*signal, f64::INFINITY));
        single.chain(self.drives.iter().copied()).collect()
    }
}
