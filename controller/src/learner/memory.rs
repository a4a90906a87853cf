//! From run to run: what a learner takes along, and how the next one begins with it.
//!
//! Amplitudes and ways of each speed, how the error scatters, and how large it was without learner: so an error that is larger than
//! that, because the rig is not what it was, is taken back as ever.

use super::way::Way;
use super::{BEFORE, Harmonic, KEPT_SPEEDS, Learner};
use crate::complex::Complex;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a run has learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Memory {
    noise_m: f64,
    scatter_m: f64,
    base_m: f64,
    /// The speed of the end comes last.
    speeds: Vec<Speed>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Speed {
    turns_per_s: f64,
    harmonics: Vec<(Complex, Way)>,
}

impl Speed {
    /// Without those that were too fast to be learned at it.
    fn of(turns_per_s: f64, harmonics: &[Harmonic]) -> Self {
        let used = harmonics.iter().take_while(|own| own.way.is_usable());
        let both = used.map(|own| (own.amplitude_m, own.way));
        Self {
            turns_per_s,
            harmonics: both.collect(),
        }
    }

    fn is_usable(&self) -> bool {
        let numbers = |(amplitude_m, way): &(Complex, Way)| amplitude_m.square().is_finite() && way.is_usable();
        self.turns_per_s.is_finite() && self.turns_per_s > 0.0 && self.harmonics.iter().all(numbers)
    }
}

impl Learner {
    /// For the next run, as JSON; none before anything was learned.
    pub fn memory(&self) -> Option<String> {
        if !self.is_learning() {
            return None;
        }
        let kept = self.kept.iter().filter(|kept| kept.turns_per_s > 0.0);
        let mut speeds: Vec<Speed> = kept.map(|kept| Speed::of(kept.turns_per_s, &kept.harmonics)).collect();
        speeds.retain(|own| own.turns_per_s != self.turns_per_s);
        speeds.push(Speed::of(self.turns_per_s, &self.harmonics[..self.used]));
        let memory = Memory {
            noise_m: self.noise_m,
            scatter_m: self.scatter_m,
            base_m: self.base_m,
            speeds,
        };
        serde_json::to_string(&memory).ok()
    }

    /// Begins with what an earlier run has learned.
    ///
    /// # Errors
    /// A file that cannot be read, or is none of ours.
    pub fn remembering(mut self, path: &Path) -> Result<Self, Invalid> {
        let shown = path.display();
        let refused = |sentence: String| Invalid::new("from", sentence);
        let text = std::fs::read_to_string(path).map_err(|error| refused(format!("{shown}: {error}")))?;
        let memory: Memory = serde_json::from_str(&text)
            .map_err(|error| refused(format!("{shown} is not what a run has learned: {error}")))?;
        let sizes = [memory.noise_m, memory.scatter_m, memory.base_m];
        let usable = memory.speeds.iter().all(Speed::is_usable);
        if !usable || !sizes.iter().all(|own| own.is_finite() && *own >= 0.0) {
            return Err(refused(format!("{shown} has numbers in it that no run learns")));
        }
        let newest = memory.speeds.iter().rev().take(KEPT_SPEEDS);
        for (kept, known) in self.kept.iter_mut().rev().zip(newest) {
            kept.turns_per_s = known.turns_per_s;
            for (index, own) in kept.harmonics.iter_mut().enumerate() {
                let believed = || {
                    let model = self
                        .shape
                        .demand_to_displacement((index + 1) as f64 * known.turns_per_s);
                    (Complex::ZERO, Way::believed(model))
                };
                (own.amplitude_m, own.way) = known.harmonics.get(index).copied().unwrap_or_else(believed);
            }
        }
        (self.noise_m, self.scatter_m, self.base_m) = (memory.noise_m, memory.scatter_m, memory.base_m);
        Ok(self)
    }

    /// At the first speed: its amplitudes, if an earlier run was there.
    pub(super) fn recall(&mut self, turns_per_s: f64) {
        let limit_m = self.limit_m;
        let Some(known) = self.kept.iter().find(|kept| kept.is_near(turns_per_s)) else {
            return;
        };
        for (own, known) in self.harmonics[..self.used].iter_mut().zip(&known.harmonics) {
            let size_m = known.amplitude_m.magnitude();
            let share = if size_m > limit_m { limit_m / size_m } else { 1.0 };
            (own.way, own.amplitude_m) = (known.way, known.amplitude_m.scaled(share));
        }
        self.heard = BEFORE;
    }
}
