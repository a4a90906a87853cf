//! u_k = clip(wₖ·(kp·e_k + D_k) + I_k, ±limit),  e = r − y,
//! I_k = I_{k−1} + wₖ·T·ki·e_k (bent by the anti-windup),  D_k = β·D_{k−1} + (1 − β)·kd·(s_k − s_{k−1})/T,  β = exp(−T/τ).
//!
//! Transfer function (w = 1, no limit): kp + ki·T/(1 − z⁻¹) + kd·(1 − β)/(1 − βz⁻¹)·(1 − z⁻¹)/T.
//! Ports: in reference r and measurement y at t_k (m), what became of the demand before; out u (m of quasi-static displacement).
//! kp has no unit, ki is in 1/s, kd in s, τ = `derivative_filter_s`; s is −y (derivative on measurement: a step of the reference
//! gives no kick, a moving reference meets a brake) or e (no brake). w eases the gains in from 0 to 1 over `ease_in_s`.
//!
//! Bumpless: at the first measurement (and after [`Pid::restart`]) I is set so that u is a given value, 0 at first. A PID
//! without ki keeps I = 0 there, because nothing would ever remove the offset: give it `ease_in_s`.
//! Where the loop was opened, that value is I of the tick before the one that was not let through: what made the guard act
//! (a spike of the sensor) reached e and I in its own tick, before anybody knew.
//! A measurement that is not a number, or beyond ±1 m, is missing: the last error is held, I stands still, D fades.

use crate::anti_windup::{AntiWindup, Applied};
use crate::trajectory::blend;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// No rod moves by a metre; beyond, a number is a fault of the sensor, and bounding it keeps everything below finite.
const MAX_MEASUREMENT_M: f64 = 1.0;

/// True for a displacement that can be used; NaN fails the comparison.
pub(crate) fn is_measured(displacement_m: f64) -> bool {
    displacement_m.abs() <= MAX_MEASUREMENT_M
}

/// Gains and what belongs to them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PidSettings {
    /// Metres of demand per metre of error.
    pub kp: f64,
    /// Metres of demand per metre of error and second.
    #[serde(default)]
    pub ki_per_s: f64,
    /// Metres of demand per metre per second.
    #[serde(default)]
    pub kd_s: f64,
    /// Time constant of the derivative's filter; needed with `kd_s`.
    #[serde(default)]
    pub derivative_filter_s: f64,
    /// What the derivative is taken of.
    #[serde(default)]
    pub derivative_on: DerivativeOn,
    /// Largest magnitude of the output, or none.
    #[serde(default)]
    pub output_limit_m: Option<f64>,
    /// Strategy against windup.
    #[serde(default)]
    pub anti_windup: AntiWindup,
    /// Time over which the gains are eased in.
    #[serde(default)]
    pub ease_in_s: f64,
}

/// What the derivative is taken of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum DerivativeOn {
    /// s = −y.
    #[default]
    Measurement,
    /// s = r − y.
    Error,
}

impl PidSettings {
    /// Gains so far on the way to others.
    #[must_use]
    pub fn between(&self, other: &Self, part: f64) -> Self {
        let mix = |from: f64, to: f64| from + part * (to - from);
        Self {
            kp: mix(self.kp, other.kp),
            ki_per_s: mix(self.ki_per_s, other.ki_per_s),
            kd_s: mix(self.kd_s, other.kd_s),
            ..self.clone()
        }
    }

    /// Looks at each gain and at the gains together. Stability with the rod is checked where the rod is known.
    ///
    /// # Errors
    /// The first refusal, with value and limit.
    pub fn validate(&self, tick_s: f64) -> Result<(), Invalid> {
        Invalid::unless_between("kp", self.kp, 0.0, 1e3, "m/m")?;
        Invalid::unless_between("ki_per_s", self.ki_per_s, 0.0, 1.0 / tick_s, "1/s")?;
        Invalid::unless_between("kd_s", self.kd_s, 0.0, 1.0, "s")?;
        Invalid::unless_between("derivative_filter_s", self.derivative_filter_s, 0.0, 10.0, "s")?;
        Invalid::unless_between("ease_in_s", self.ease_in_s, 0.0, 1e6, "s")?;
        if self.kp == 0.0 && self.ki_per_s == 0.0 && self.kd_s == 0.0 {
            return Err(Invalid::new(
                "kp",
                "kp, ki_per_s and kd_s are all 0: leave the feedback out instead",
            ));
        }
        if self.kd_s > 0.0 && self.derivative_filter_s < tick_s {
            let sentence = format!(
                "{} s is below one tick of {tick_s} s: with kd_s = {} s the derivative would pass the sensor's noise on, \
                 multiplied by kd_s/tick = {}",
                self.derivative_filter_s,
                self.kd_s,
                self.kd_s / tick_s
            );
            return Err(Invalid::new("derivative_filter_s", sentence));
        }
        if let Some(limit_m) = self.output_limit_m {
            Invalid::unless_positive("output_limit_m", limit_m, "m")?;
        }
        self.anti_windup.validate(self.ki_per_s, tick_s)
    }
}

/// What one tick gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PidOutput {
    /// u.
    pub feedback_m: f64,
    /// The error used: of this tick, or the last one that could be had.
    pub error_m: f64,
    /// I.
    pub integral_m: f64,
    /// The anti-windup stopped or bent the integration, or the measurement was missing.
    pub integration_stopped: bool,
    /// The gains are still being eased in.
    pub easing: bool,
}

/// A PID and its memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pid {
    settings: PidSettings,
    tick_s: f64,
    filter: f64,
    integral_m: f64,
    /// I of the tick before.
    integral_before_m: f64,
    derivative_m: f64,
    differentiated_m: f64,
    error_m: f64,
    /// w − a of its own limit in the tick before.
    excess_m: f64,
    /// Output to begin with; `None` once it has begun.
    begin_m: Option<f64>,
    ticks: u64,
}

impl Pid {
    /// A PID at rest; settings are taken as validated.
    pub fn new(settings: &PidSettings, tick_s: f64) -> Self {
        let tau_s = settings.derivative_filter_s;
        Self {
            settings: settings.clone(),
            tick_s,
            filter: if tau_s > 0.0 { libm::exp(-tick_s / tau_s) } else { 0.0 },
            integral_m: 0.0,
            integral_before_m: 0.0,
            derivative_m: 0.0,
            differentiated_m: 0.0,
            error_m: 0.0,
            excess_m: 0.0,
            begin_m: Some(0.0),
            ticks: 0,
        }
    }

    /// Other gains from now on. I is kept: it holds what was integrated, not what is to come.
    pub(crate) fn set_gains(&mut self, kp: f64, ki_per_s: f64, kd_s: f64) {
        (self.settings.kp, self.settings.ki_per_s, self.settings.kd_s) = (kp, ki_per_s, kd_s);
    }

    /// Begins anew at the next measurement, with this output there: bumpless after a time without effect.
    pub fn restart(&mut self, output_m: f64) {
        self.begin_m = Some(output_m);
        self.integral_m = output_m;
        self.integral_before_m = output_m;
        self.derivative_m = 0.0;
        self.excess_m = 0.0;
        self.ticks = 0;
    }

    /// Advances by one tick. `applied` tells what became of the demand before, its own limit apart.
    pub fn step(&mut self, reference_m: f64, measured_m: f64, applied: Applied) -> PidOutput {
        if applied == Applied::Open {
            self.restart(self.integral_before_m);
        }
        let heard = is_measured(measured_m);
        if self.begin_m.is_some() && (!heard || applied == Applied::Open) {
            if heard {
                self.error_m = reference_m - measured_m;
            }
            return self.output(self.integral_m, true);
        }
        self.integral_before_m = self.integral_m;
        let ease = blend(self.ticks as f64 * self.tick_s, self.settings.ease_in_s);
        let stopped = if heard {
            self.error_m = reference_m - measured_m;
            self.hear(reference_m, measured_m, ease, applied)
        } else {
            self.derivative_m *= self.filter;
            true
        };
        self.ticks += 1;
        let wanted_m = ease * (self.settings.kp * self.error_m + self.derivative_m) + self.integral_m;
        let feedback_m = self
            .settings
            .output_limit_m
            .map_or(wanted_m, |limit_m| wanted_m.clamp(-limit_m, limit_m));
        self.excess_m = wanted_m - feedback_m;
        self.output(feedback_m, stopped)
    }

    /// Takes a measurement in; true if the integration was stopped or bent.
    fn hear(&mut self, reference_m: f64, measured_m: f64, ease: f64, applied: Applied) -> bool {
        let differentiated_m = match self.settings.derivative_on {
            DerivativeOn::Measurement => -measured_m,
            DerivativeOn::Error => reference_m - measured_m,
        };
        let change_m = differentiated_m - std::mem::replace(&mut self.differentiated_m, differentiated_m);
        if let Some(output_m) = self.begin_m.take() {
            // The first difference has no past; the integrator takes the proportional part's opposite.
            if self.settings.ki_per_s > 0.0 {
                self.integral_m = output_m - ease * self.settings.kp * self.error_m;
            }
            return false;
        }
        let rate_m = self.settings.kd_s * change_m / self.tick_s;
        self.derivative_m = self.filter * self.derivative_m + (1.0 - self.filter) * rate_m;
        let growth_m = ease * self.tick_s * self.settings.ki_per_s * self.error_m;
        let (change_m, stopped) =
            self.settings
                .anti_windup
                .change_m(growth_m, self.with_own_limit(applied), self.tick_s);
        self.integral_m += change_m;
        stopped
    }

    fn with_own_limit(&self, applied: Applied) -> Applied {
        match applied {
            Applied::Fully if self.excess_m != 0.0 => Applied::Short {
                excess_m: self.excess_m,
            },
            Applied::Short { excess_m } => Applied::Short {
                excess_m: excess_m + self.excess_m,
            },
            other => other,
        }
    }

    fn output(&self, feedback_m: f64, integration_stopped: bool) -> PidOutput {
        PidOutput {
            feedback_m,
            error_m: self.error_m,
            integral_m: self.integral_m,
            integration_stopped,
            easing: self.begin_m.is_some() || (self.ticks as f64) * self.tick_s < self.settings.ease_in_s,
        }
    }
}
