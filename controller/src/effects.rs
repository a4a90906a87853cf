//! What the controller makes of effects that it knows: it asks earlier, asks for less, and compares like with like.
//!
//! A delay d of the loop: the demand is for t_k+2 + d. Warming: its strain is taken off the demand, p ← p − G·λ_T. The
//! sensor: the reference goes through what the sensor does to a displacement before it is compared, e = s(r) − y; else
//! the PID would fight a delay, a play or a wrong scale as if the tip were wrong. Then a tip on its reference gives no
//! error but the noise. G static displacement per strain (m), λ_T strain by warming, reckoned from the permitted field
//! (A/m). The rod: a cubic spring asks for β·r³ more (metres of quasi-static displacement), dry friction for d·n, a stiffness that grows
//! by g with M for less, −g/(1 + g)·(r″ + k̂ r′)/ĉ. Rounding of the sensor is not imitated: it is right in the mean.

use crate::Motion;
use anhyst_model::{
    Effect, EffectKind, Expansion, Material, ModelError, OwnForces, RodState, SignalPath, Stage, TwoPole,
};
use serde::{Deserialize, Serialize};

/// The known effects and their memories.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct KnownEffects {
    sensor: SignalPath,
    expansion: Option<Expansion>,
    ahead_s: f64,
    own_forces: Option<OwnForces>,
    magnetization_a_per_m: f64,
    last_own_m: f64,
    tick_s: f64,
}

impl KnownEffects {
    /// None where nothing is known.
    ///
    /// # Errors
    /// An effect that cannot be built for this tick.
    pub fn new(
        effects: &[Effect],
        rod: &TwoPole,
        material: &Material,
        tick_s: f64,
    ) -> Result<Option<Self>, ModelError> {
        if effects.is_empty() {
            return Ok(None);
        }
        let seen: Vec<Effect> = effects
            .iter()
            .filter(|effect| effect.kind() != EffectKind::Quantisation)
            .copied()
            .collect();
        Ok(Some(KnownEffects {
            sensor: SignalPath::new(&seen, Stage::Sensor, tick_s)?,
            expansion: Expansion::new(effects, tick_s),
            ahead_s: value(effects, EffectKind::LoopDelay, "delay_s"),
            own_forces: OwnForces::new(effects, material, *rod, tick_s)?,
            magnetization_a_per_m: 0.0,
            last_own_m: 0.0,
            tick_s,
        }))
    }

    /// By how much later than at t_k+2 a command has its effect.
    pub fn ahead_s(&self) -> f64 {
        self.ahead_s
    }

    /// What the sensor would say at t_k if the tip were on its reference.
    pub fn expected_m(&mut self, reference_m: f64) -> f64 {
        self.sensor.step(reference_m)
    }

    /// Strain by warming while the field stays as it is permitted now.
    pub fn warm_strain(&mut self, field_a_per_m: f64) -> f64 {
        let finite = if field_a_per_m.is_finite() { field_a_per_m } else { 0.0 };
        self.expansion.as_mut().map_or(0.0, |expansion| expansion.step(finite))
    }

    /// Quasi-static displacement that the rod's own forces take along the reference, m.
    pub fn own_forces_m(&self, motion: &Motion) -> f64 {
        let Some(forces) = &self.own_forces else {
            return 0.0;
        };
        forces.along_m(state(motion), motion.acceleration_m_per_s2, self.magnetization_a_per_m)
    }

    /// The same of this tick's motion, and its rate (m/s), for the lags to lead by; the magnetization (A/m) is that of the tick before.
    pub fn advance_own_forces(&mut self, motion: &Motion, magnetization_a_per_m: f64) -> (f64, f64) {
        let Some(forces) = &mut self.own_forces else {
            return (0.0, 0.0);
        };
        forces.follow(state(motion));
        self.magnetization_a_per_m = magnetization_a_per_m;
        let own_m = self.own_forces_m(motion);
        // Between the ticks before and behind: friction turns round in a few.
        let rate_m_per_s = (self.own_forces_m(&motion.after(self.tick_s)) - self.last_own_m) / (2.0 * self.tick_s);
        self.last_own_m = own_m;
        (own_m, rate_m_per_s)
    }
}

fn state(motion: &Motion) -> RodState {
    RodState {
        displacement_m: motion.position_m,
        velocity_m_per_s: motion.velocity_m_per_s,
    }
}

/// A parameter of the effect of that kind, or 0.
fn value(effects: &[Effect], kind: EffectKind, parameter: &str) -> f64 {
    let known = effects.iter().find(|effect| effect.kind() == kind);
    known.and_then(|effect| effect.value(parameter)).unwrap_or(0.0)
}

/// Delay and lag (s) that effects put into the loop beyond the two ticks, for its stability.
pub(crate) fn delay_and_lag_s(effects: &[Effect]) -> (f64, f64) {
    let size = |kind, parameter| value(effects, kind, parameter);
    let delay_s = size(EffectKind::LoopDelay, "delay_s") + size(EffectKind::SensorDelay, "delay_s");
    let lag_s =
        size(EffectKind::EddyCurrent, "time_constant_s") + size(EffectKind::AmplifierBandwidth, "time_constant_s");
    (delay_s, lag_s)
}
