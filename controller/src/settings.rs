//! What the controller is told.

use crate::{LearningSettings, PidSettings, TrajectorySettings};
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerSettings {
    /// What the tip is to do.
    pub trajectory: TrajectorySettings,
    /// Length of the smooth start from rest at 0 into the trajectory.
    #[serde(default)]
    pub start_s: f64,
    /// Invert the rod along the trajectory. Without it only the feedback acts.
    #[serde(default = "yes")]
    pub feedforward: bool,
    /// Correct the feedforward for the straight lines between ticks.
    #[serde(default = "yes")]
    pub hold_correction: bool,
    /// The PID, or none.
    #[serde(default)]
    pub feedback: Option<PidSettings>,
    /// Learning of what repeats with the trajectory, or none.
    #[serde(default)]
    pub learning: Option<LearningSettings>,
}

fn yes() -> bool {
    true
}

impl ControllerSettings {
    /// Refuses settings that contradict themselves, each other, the tick or the length of the run.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self, tick_s: f64, duration_s: f64) -> Result<(), Invalid> {
        Invalid::unless_between("start_s", self.start_s, 0.0, duration_s, "s")?;
        self.validate_parts(tick_s)?;
        let within = self.trajectory.validate_within(duration_s);
        within.map_err(|refusal| refusal.within("trajectory"))
    }

    /// All that can be said without the length of the run.
    pub(crate) fn validate_parts(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_positive("tick_s", tick_s, "s")?;
        Invalid::unless_between("start_s", self.start_s, 0.0, 1e9, "s")?;
        self.trajectory
            .validate(tick_s)
            .map_err(|refusal| refusal.within("trajectory"))?;
        if let Some(pid) = &self.feedback {
            pid.validate(tick_s).map_err(|refusal| refusal.within("feedback"))?;
        }
        if let Some(learning) = &self.learning {
            learning.validate().map_err(|refusal| refusal.within("learning"))?;
        }
        Ok(())
    }
}
