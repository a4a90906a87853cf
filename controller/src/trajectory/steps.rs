//! r(t) = lᵢ + (lᵢ₊₁ − lᵢ)·S((t − tᵢ)/Lᵢ): from level to level, standing still in each, with S the blend of `blend.rs`.
//!
//! l levels (m), tᵢ when a step begins (s), Lᵢ how long it takes (s): `over_s`, or what the limits ask for if that is longer,
//! 2.461·h/v and √(9.372·h/a) for a step of h (m), a speed of v (m/s) and an acceleration of a (m/s²) at most.

use super::blend::{Blend, MOST_CURVED, STEEPEST};
use super::jet::Jet;
use super::unless_turned;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Levels and how the tip goes from one to the next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepsSettings {
    /// Level after level; it begins in the first.
    pub levels_m: Vec<f64>,
    /// How long it stands still in each.
    pub dwell_s: f64,
    /// How long a step takes at least.
    #[serde(default)]
    pub over_s: f64,
    /// Fastest a step may be.
    #[serde(default)]
    pub velocity_limit_m_per_s: Option<f64>,
    /// Most that a step may be accelerated.
    #[serde(default)]
    pub acceleration_limit_m_per_s2: Option<f64>,
    /// Go back to the first level after the last, and on.
    #[serde(default)]
    pub repeat: bool,
}

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// When it begins.
    pub at_s: f64,
    /// How long it takes.
    pub over_s: f64,
    /// Level before it.
    pub from_m: f64,
    /// Level after it.
    pub to_m: f64,
}

/// The steps in their time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Steps {
    first_m: f64,
    steps: Vec<Step>,
    /// Of steps that repeat.
    period_s: Option<f64>,
}

impl StepsSettings {
    pub(super) fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        let levels = &self.levels_m;
        if levels.len() < 2 {
            let sentence = format!("{} levels make no step: give at least 2", levels.len());
            return Err(Invalid::new("levels_m", sentence));
        }
        if let Some(place) = levels.iter().position(|level_m| !level_m.is_finite()) {
            let sentence = format!("{} m must be finite", levels[place]);
            return Err(Invalid::new(format!("levels_m.{place}"), sentence));
        }
        Invalid::unless_between("dwell_s", self.dwell_s, tick_s, 1e9, "s")?;
        Invalid::unless_between("over_s", self.over_s, 0.0, 1e9, "s")?;
        for (path, limit, unit) in [
            ("velocity_limit_m_per_s", self.velocity_limit_m_per_s, "m/s"),
            ("acceleration_limit_m_per_s2", self.acceleration_limit_m_per_s2, "m/s²"),
        ] {
            limit.map_or(Ok(()), |limit| Invalid::unless_positive(path, limit, unit))?;
        }
        for (place, step) in Steps::new(self).steps.iter().enumerate() {
            let path = format!("levels_m.{}", (place + 1) % levels.len());
            if step.from_m == step.to_m {
                let sentence = format!("{} m is the level before: that is no step", step.to_m);
                return Err(Invalid::new(path, sentence));
            }
            unless_turned(&path, "the step to this level", step.over_s, "over_s", tick_s)?;
        }
        Ok(())
    }

    fn length_s(&self, height_m: f64) -> f64 {
        let by_velocity_s = self
            .velocity_limit_m_per_s
            .map_or(0.0, |limit| STEEPEST * height_m / limit);
        let by_acceleration_s = self
            .acceleration_limit_m_per_s2
            .map_or(0.0, |limit| (MOST_CURVED * height_m / limit).sqrt());
        self.over_s.max(by_velocity_s).max(by_acceleration_s)
    }
}

impl Steps {
    pub(super) fn new(settings: &StepsSettings) -> Self {
        let levels = &settings.levels_m;
        let (mut at_s, mut steps) = (settings.dwell_s, Vec::with_capacity(levels.len()));
        let back = levels.first().filter(|_| settings.repeat);
        let ways = levels.iter().zip(levels.iter().skip(1).chain(back));
        for (&from_m, &to_m) in ways {
            let over_s = settings.length_s((to_m - from_m).abs());
            steps.push(Step {
                at_s,
                over_s,
                from_m,
                to_m,
            });
            at_s += over_s + settings.dwell_s;
        }
        Self {
            first_m: levels.first().copied().unwrap_or_default(),
            steps,
            // It begins with a whole dwell and ends at the end of the last step.
            period_s: settings.repeat.then_some(at_s - settings.dwell_s),
        }
    }

    /// All of them, of one period if they repeat.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Place of the step that has begun last, and for how long.
    pub fn begun(&self, time_s: f64) -> Option<(usize, f64)> {
        let own_s = self.folded(time_s);
        let later = self.steps.partition_point(|step| step.at_s <= own_s);
        if let Some(place) = later.checked_sub(1) {
            return Some((place, own_s - self.steps[place].at_s));
        }
        // The first dwell of a later period belongs to the last step of the one before.
        let (period_s, last) = (self.period_s?, self.steps.len().checked_sub(1)?);
        (time_s >= period_s).then(|| (last, own_s + period_s - self.steps[last].at_s))
    }

    fn folded(&self, time_s: f64) -> f64 {
        self.period_s
            .map_or(time_s, |period_s| time_s - (time_s / period_s).floor() * period_s)
    }

    pub(super) fn turns_per_s(&self) -> Option<f64> {
        self.period_s.map(f64::recip)
    }

    pub(super) fn at(&self, time_s: f64) -> Jet {
        let own_s = self.folded(time_s);
        let later = self.steps.partition_point(|step| step.at_s <= own_s);
        let Some(step) = later.checked_sub(1).map(|place| &self.steps[place]) else {
            return Jet::constant(self.first_m);
        };
        let blend = Blend {
            from_s: step.at_s,
            length_s: step.over_s,
        };
        Jet::constant(step.from_m).plus(blend.at(own_s).scaled(step.to_m - step.from_m))
    }
}
