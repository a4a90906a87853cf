//! Settings of the min-max law for several parameters.

use super::members::Members;
use anhyst_ipc::Invalid;
use anhyst_model::{Hysteresis, HysteresisParameter};
use serde::{Deserialize, Serialize};

/// Largest bank of a full factorial.
const MOST_LEVELS: usize = 33;
const MOST_MEMBERS: usize = 1331;

/// One axis of the box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MinMaxParameter {
    /// Which one; it starts at its value in the nominal material.
    pub parameter: HysteresisParameter,
    /// The estimate stays within, and the guarantee needs the truth within.
    pub range: (f64, f64),
    /// Covers are built over the members this near to the estimate on this axis, in the parameter's unit; none: over
    /// the whole range. Not for four and five parameters, whose members are too few.
    #[serde(default)]
    pub window: Option<f64>,
    /// Typical change of the output with the parameter, in their units.
    pub sensitivity: f64,
}

/// Settings of [`super::SeveralMinMax`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MinMaxSettings {
    /// One to five, each once.
    pub parameters: Vec<MinMaxParameter>,
    /// Members on each axis, up to three parameters.
    #[serde(default = "default_levels")]
    pub levels: usize,
    /// κ: both filters' corner, 1/s.
    pub filter_per_s: f64,
    /// ε: output errors up to this change nothing; in the output's unit.
    pub dead_zone: f64,
    /// How fast a parameter alone follows where the output is as sensitive as said.
    pub adaptation_rate_per_s: f64,
    /// How much of the measured interpolation error is allowed for between the members: 1 for the guarantee, 0 for the
    /// covers of the members alone.
    #[serde(default = "default_allowance")]
    pub interpolation_allowance: f64,
}

fn default_levels() -> usize {
    3
}

fn default_allowance() -> f64 {
    1.0
}

impl MinMaxParameter {
    /// γ_i, in units of the parameter and the output: rate/sensitivity².
    pub(super) fn gain(&self, adaptation_rate_per_s: f64) -> f64 {
        adaptation_rate_per_s / (self.sensitivity * self.sensitivity)
    }

    /// Half the width of the range.
    pub(super) fn half(&self) -> f64 {
        0.5 * (self.range.1 - self.range.0)
    }

    /// θ at x ∈ [−1, 1].
    pub(super) fn value_at(&self, x: f64) -> f64 {
        0.5 * (self.range.0 + self.range.1) + self.half() * x
    }

    /// x of θ.
    pub(super) fn coordinate(&self, value: f64) -> f64 {
        (value - 0.5 * (self.range.0 + self.range.1)) / self.half()
    }

    fn validate(&self, nominal: &Hysteresis, count: usize, rate: f64) -> Result<(), Invalid> {
        let (symbol, unit) = (self.parameter.symbol(), self.parameter.unit());
        let path = format!("{symbol}.range");
        let (low, high) = self.range;
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(Invalid::new(
                path,
                format!("the lower edge {low} {unit} must be below the upper edge {high} {unit}, both finite"),
            ));
        }
        Invalid::unless_between(&path, self.parameter.of(nominal), low, high, unit)?;
        Invalid::unless_positive(&format!("{symbol}.sensitivity"), self.sensitivity, "")?;
        let gain = self.gain(rate);
        if !(gain.is_finite() && gain > 0.0) {
            let sensitivity = self.sensitivity;
            return Err(Invalid::new(
                format!("{symbol}.sensitivity"),
                format!("{sensitivity} makes rate/sensitivity^2 {gain}, which must be finite and above 0"),
            ));
        }
        if let Some(window) = self.window {
            Invalid::unless_positive(&format!("{symbol}.window"), window, unit)?;
            if count > 3 {
                return Err(Invalid::new(
                    format!("{symbol}.window"),
                    format!(
                        "{count} parameters have no members but corners and centres: no window can be cut out of them"
                    ),
                ));
            }
        }
        Ok(())
    }
}

impl MinMaxSettings {
    /// Checks every field against the material that the estimate starts from.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn validate(&self, nominal: &Hysteresis) -> Result<(), Invalid> {
        let count = self.parameters.len();
        Invalid::unless_between(
            "parameters",
            count as f64,
            1.0,
            HysteresisParameter::COUNT as f64,
            "parameters",
        )?;
        Invalid::unless_positive("adaptation_rate_per_s", self.adaptation_rate_per_s, "1/s")?;
        for (index, axis) in self.parameters.iter().enumerate() {
            let before = &self.parameters[..index];
            if before.iter().any(|other| other.parameter == axis.parameter) {
                let symbol = axis.parameter.symbol();
                return Err(Invalid::new("parameters", format!("{symbol} is listed twice")));
            }
            axis.validate(nominal, count, self.adaptation_rate_per_s)
                .map_err(|invalid| invalid.within("parameters"))?;
        }
        Invalid::unless_between("levels", self.levels as f64, 3.0, MOST_LEVELS as f64, "")?;
        if count <= 3 && self.levels.pow(count as u32) > MOST_MEMBERS {
            let (levels, members) = (self.levels, self.levels.pow(count as u32));
            return Err(Invalid::new(
                "levels",
                format!(
                    "{levels} on each of {count} axes make {members} models, but at most {MOST_MEMBERS} are carried"
                ),
            ));
        }
        Invalid::unless_positive("filter_per_s", self.filter_per_s, "1/s")?;
        Invalid::unless_positive("dead_zone", self.dead_zone, "(unit of the output)")?;
        Invalid::unless_between("interpolation_allowance", self.interpolation_allowance, 0.0, 10.0, "")
    }

    /// The same law over a smaller box around an estimate: each range and window `share` as wide, cut off where the
    /// present range ends. For another pass over recorded data; the guarantee then needs the truth in the smaller box.
    #[must_use]
    pub fn narrowed(&self, estimate: &Hysteresis, share: f64) -> Self {
        let narrow = |axis: &MinMaxParameter| {
            let (value, half) = (axis.parameter.of(estimate), share * axis.half());
            MinMaxParameter {
                range: ((value - half).max(axis.range.0), (value + half).min(axis.range.1)),
                window: axis.window.map(|window| share * window),
                ..*axis
            }
        };
        Self {
            parameters: self.parameters.iter().map(narrow).collect(),
            ..self.clone()
        }
    }

    /// The material of every member.
    pub(super) fn materials(&self, nominal: &Hysteresis, members: &Members) -> Vec<Hysteresis> {
        let at = |point: &[f64; HysteresisParameter::COUNT]| {
            let axes = self.parameters.iter().zip(point);
            axes.fold(*nominal, |material, (axis, x)| {
                axis.parameter.with(material, axis.value_at(*x))
            })
        };
        members.points().iter().map(at).collect()
    }
}
