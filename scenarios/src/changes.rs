//! Changes of settings while a run goes on: each must leave a loop that the scenario's own checks would let begin.

use super::Scenario;
use crate::margins::LEAST_MODULUS_MARGIN;
use anhyst_ipc::{Change, Invalid, MAX_CHANGES, Tunable};

/// Places between the gains of before and those to come that are looked at.
const BETWEEN: u32 = 8;
const MAX_AMPLITUDE: f64 = 100.0;

fn refused(change: &Change, sentence: impl std::fmt::Display) -> Invalid {
    Invalid::new("changes", format!("{change}: {sentence}"))
}

impl Scenario {
    /// Adds changes that were made while it ran.
    pub fn add_changes(&mut self, changes: &[Change]) {
        self.changes.extend_from_slice(changes);
        self.changes.sort_by_key(|change| change.tick);
    }

    pub(super) fn validate_changes(&self) -> Result<(), Invalid> {
        let (count, ticks) = (self.changes.len(), self.ticks());
        if count > MAX_CHANGES {
            let sentence = format!("{count} changes are more than the {MAX_CHANGES} that a run takes");
            return Err(Invalid::new("changes", sentence));
        }
        if let Some(pair) = self.changes.windows(2).find(|pair| pair[0].tick > pair[1].tick) {
            let sentence = format!(
                "tick {} comes before {}: write them in order",
                pair[1].tick, pair[0].tick
            );
            return Err(Invalid::new("changes", sentence));
        }
        for (index, change) in self.changes.iter().enumerate() {
            if change.tick >= ticks {
                return Err(refused(
                    change,
                    format!("tick {} is after the last, {}", change.tick, ticks - 1),
                ));
            }
            self.validate_change(change, index)?;
        }
        self.validate_gains()
    }

    /// What can be said of a change alone, and of the motion with it and those before it.
    fn validate_change(&self, change: &Change, index: usize) -> Result<(), Invalid> {
        let value = change.value;
        let within = |invalid: Invalid| Invalid::new("changes", format!("{}: {}", change, invalid.sentence));
        let until_here = || Scenario {
            changes: self.changes[..=index].to_vec(),
            ..self.clone()
        };
        match change.set {
            Tunable::Kp | Tunable::KiPerS | Tunable::KdS if self.controller.feedback.is_none() => {
                Err(refused(change, "this scenario has no controller.feedback"))
            }
            Tunable::Kp | Tunable::KiPerS | Tunable::KdS => Ok(()),
            Tunable::Learning | Tunable::LearningGain => {
                let Some(mut learning) = self.controller.learning.clone() else {
                    return Err(refused(change, "this scenario has no controller.learning"));
                };
                if change.set == Tunable::LearningGain {
                    learning.gain = value;
                    return learning.validate().map_err(within);
                }
                let known = value == 0.0 || value == 1.0;
                if known {
                    Ok(())
                } else {
                    Err(refused(change, "it is on, 1, or off, 0"))
                }
            }
            Tunable::Amplitude => {
                Invalid::unless_between("", value, 0.0, MAX_AMPLITUDE, "times the stated one").map_err(within)?;
                let material = self.material()?;
                until_here().validate_reach(material).map_err(within)
            }
            Tunable::Tolerance => {
                Invalid::unless_positive("", value, "m").map_err(within)?;
                let mut told = until_here();
                told.expect.tolerance_m = Some(value);
                told.validate_tolerance().map_err(within)
            }
        }
    }

    /// The loop on the way to the gains of each tick: those that change in one tick go together.
    fn validate_gains(&self) -> Result<(), Invalid> {
        let Some(mut gains) = self.controller.feedback.clone() else {
            return Ok(());
        };
        for group in self.changes.chunk_by(|one, other| one.tick == other.tick) {
            let mut wanted = gains.clone();
            let mut last = None;
            for change in group {
                *match change.set {
                    Tunable::Kp => &mut wanted.kp,
                    Tunable::KiPerS => &mut wanted.ki_per_s,
                    Tunable::KdS => &mut wanted.kd_s,
                    _ => continue,
                } = change.value;
                last = Some(change);
            }
            let Some(change) = last else { continue };
            let of_gains = |invalid: Invalid| refused(change, format!("{}: {}", invalid.path, invalid.sentence));
            wanted.validate(self.tick_s).map_err(of_gains)?;
            // A loop that had less may keep what it had.
            let least = LEAST_MODULUS_MARGIN.min(self.loop_with(&gains)?.modulus_margin());
            let mut margin = f64::INFINITY;
            for place in 1..=BETWEEN {
                let part = f64::from(place) / f64::from(BETWEEN);
                margin = margin.min(self.modulus_margin(&gains.between(&wanted, part))?);
            }
            if margin < least {
                return Err(refused(change, too_near(margin, least)));
            }
            gains = wanted;
        }
        Ok(())
    }
}

fn too_near(margin: f64, least: f64) -> String {
    let limit = format!("the least is {least:.2} (Ms = {:.2})", 1.0 / least);
    if margin == 0.0 {
        return format!("the loop would be unstable; 1 + L must keep away from 0, and {limit}");
    }
    format!(
        "|1 + L| would go down to {margin:.2} (Ms = {:.2}), and {limit}",
        1.0 / margin
    )
}
