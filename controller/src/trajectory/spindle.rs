//! r(t) = mean + Σ A·sin(n·θ(t) + φ),  θ' = 2π·speed: a workpiece whose speed changes.
//!
//! From one speed to the next by the blend S of `blend.rs`, so that θ has five continuous derivatives.

use super::blend::{Blend, area};
use super::jet::Jet;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Another speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedChange {
    /// When it begins.
    pub at_s: f64,
    /// Speed after it.
    pub rpm: f64,
    /// How long it takes.
    pub over_s: f64,
}

/// A stretch of time from one speed to another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Stretch {
    at_s: f64,
    over_s: f64,
    /// At its beginning.
    turns: f64,
    from_per_s: f64,
    to_per_s: f64,
}

/// A profile on a spindle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Turning {
    mean_m: f64,
    lobes: Vec<(u32, f64, f64)>,
    stretches: Vec<Stretch>,
}

impl Turning {
    /// Of lobes as (number per turn, amplitude in m, phase in rad).
    pub fn new(rpm: f64, changes: &[SpeedChange], mean_m: f64, lobes: &[(u32, f64, f64)]) -> Self {
        let mut stretches = vec![Stretch {
            at_s: 0.0,
            over_s: 0.0,
            turns: 0.0,
            from_per_s: rpm / 60.0,
            to_per_s: rpm / 60.0,
        }];
        for change in changes {
            let before = stretches[stretches.len() - 1];
            stretches.push(Stretch {
                at_s: change.at_s,
                over_s: change.over_s,
                turns: before.turns(change.at_s),
                from_per_s: before.to_per_s,
                to_per_s: change.rpm / 60.0,
            });
        }
        Self {
            mean_m,
            lobes: lobes.to_vec(),
            stretches,
        }
    }

    fn stretch(&self, time_s: f64) -> &Stretch {
        let later = self.stretches.iter().rev().find(|own| own.at_s <= time_s);
        later.unwrap_or(&self.stretches[0])
    }

    pub fn turns(&self, time_s: f64) -> f64 {
        self.stretch(time_s).turns(time_s)
    }

    pub fn at(&self, time_s: f64) -> Jet {
        let stretch = self.stretch(time_s);
        let Jet([a, b, c, d, _]) = stretch.turns_per_s(time_s);
        let turns = Jet([stretch.turns(time_s), a, b, c, d]);
        self.lobes
            .iter()
            .fold(Jet::constant(self.mean_m), |sum, &(lobe, amplitude_m, phase)| {
                let own = turns.scaled(f64::from(lobe)).plus(Jet::constant(phase / TAU));
                sum.plus(own.sine_of_turns().scaled(amplitude_m))
            })
    }
}

impl Stretch {
    fn turns(&self, time_s: f64) -> f64 {
        let gone_s = time_s - self.at_s;
        let at_new_s = if self.over_s > 0.0 {
            self.over_s * area(gone_s / self.over_s)
        } else {
            gone_s
        };
        self.turns + self.from_per_s * gone_s + (self.to_per_s - self.from_per_s) * at_new_s
    }

    fn turns_per_s(&self, time_s: f64) -> Jet {
        if self.over_s <= 0.0 {
            return Jet::constant(self.to_per_s);
        }
        let blend = Blend {
            from_s: self.at_s,
            length_s: self.over_s,
        };
        Jet::constant(self.from_per_s).plus(blend.at(time_s).scaled(self.to_per_s - self.from_per_s))
    }
}
