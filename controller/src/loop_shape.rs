//! L(z) = K(z)·P(z)·z⁻²⁻ᵈ: the loop that the PID closes, hysteresis taken as inverted.
//!
//! K the PID's transfer function (see `pid.rs`), P = ĉ/(ĉ − ω² + jk̂ω)·(sin(ωT/2)/(ωT/2))² the rod behind the first-order hold, two
//! ticks of delay and the amplifier's d; z = e^{jωT}; further delay t and lag τ of known effects multiply it by e^{−jωt}/(1 + jωτ). Assumption: above half the sampling rate the rod passes nothing that folds back.
//!
//! Stability (Nyquist): F(z) = (1 − z⁻¹)(1 + L), without the factor if there is no integrator, has no pole outside the unit
//! circle, so the loop is stable exactly if F does not turn around 0 on the half circle 0 < ωT < π, F being real at both ends.

use crate::PidSettings;
use crate::complex::Complex;
use crate::effects::delay_and_lag_s;
use anhyst_ipc::Invalid;
use anhyst_model::{Effect, TwoPole};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// One tick of computing, one of the hold.
const MIN_DELAY_TICKS: u32 = 2;

/// Points on the half circle.
const POINTS: u32 = 8192;

/// Rod, PID (if any) and tick: the linear loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoopShape {
    damping_per_s: f64,
    stiffness_per_s2: f64,
    pid: Option<PidSettings>,
    tick_s: f64,
    further_delay_s: f64,
    further_lag_s: f64,
    /// Of the loop: computing and hold, and what the amplifier adds.
    delay_ticks: u32,
    /// What was measured of rod, hysteresis and delays together, over what they are believed to be.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    measured: Vec<Ratio>,
}

/// Measured over believed response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Ratio {
    omega: f64,
    ln_gain: f64,
    phase_rad: f64,
}

/// What came of a demand at one frequency: displacement over demanded displacement of the same tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeasuredResponse {
    /// Where; rising from one to the next.
    pub frequency_hz: f64,
    /// No unit.
    pub gain: f64,
    /// Negative: late.
    pub phase_rad: f64,
}

impl LoopShape {
    /// The loop of this rod and PID.
    pub fn new(rod: &TwoPole, pid: Option<&PidSettings>, tick_s: f64) -> Self {
        Self {
            damping_per_s: rod.damping_per_s,
            stiffness_per_s2: rod.stiffness_per_s2,
            pid: pid.cloned(),
            tick_s,
            delay_ticks: MIN_DELAY_TICKS,
            further_delay_s: 0.0,
            further_lag_s: 0.0,
            measured: Vec::new(),
        }
    }

    /// The same with the delay and the lag that known effects put into it.
    #[must_use]
    pub fn with_effects(self, effects: &[Effect]) -> Self {
        let (further_delay_s, further_lag_s) = delay_and_lag_s(effects);
        Self {
            further_delay_s,
            further_lag_s,
            ..self
        }
    }

    /// The same loop behind an amplifier that is late by so many ticks.
    #[must_use]
    pub fn with_amplifier_delay(self, ticks: u32) -> Self {
        Self {
            delay_ticks: MIN_DELAY_TICKS.saturating_add(ticks),
            ..self
        }
    }

    /// The same with what was measured in the place of what is believed: between two frequencies the ratio of both goes straight in its logarithm,
    /// below them its phase goes to 0, above them it stays what it is at the last.
    #[must_use]
    pub fn with_measured(self, responses: &[MeasuredResponse]) -> Self {
        let mut before_rad = 0.0;
        let ratios = responses.iter().map(|own| {
            let omega = TAU * own.frequency_hz;
            let believed = self.believed(omega);
            let phase_rad = own.phase_rad - libm::atan2(believed.im, believed.re);
            before_rad = phase_rad + TAU * libm::round((before_rad - phase_rad) / TAU);
            Ratio {
                omega,
                ln_gain: libm::log(own.gain / believed.magnitude()),
                phase_rad: before_rad,
            }
        });
        let measured = ratios.collect();
        Self { measured, ..self }
    }

    /// What the PID's output does by belief, gain and phase (rad).
    pub fn believed_response(&self, frequency_hz: f64) -> (f64, f64) {
        let own = self.believed(TAU * frequency_hz);
        (own.magnitude(), libm::atan2(own.im, own.re))
    }

    /// P(z)·z⁻²⁻ᵈ.
    fn believed(&self, omega: f64) -> Complex {
        let ticks = f64::from(self.delay_ticks);
        let delay = Complex::unit(-ticks * omega * self.tick_s - omega * self.further_delay_s);
        self.lagging(omega, self.rod(omega).times(delay))
    }

    /// Measured over believed.
    fn ratio(&self, omega: f64) -> Complex {
        let after = self.measured.partition_point(|own| own.omega < omega);
        let Some(to) = self.measured.get(after).or(self.measured.last()) else {
            return Complex::real(1.0);
        };
        // At 0 nothing is late.
        let still = Ratio {
            omega: 0.0,
            phase_rad: 0.0,
            ..*to
        };
        let from = after.checked_sub(1).map_or(still, |before| self.measured[before]);
        let width = to.omega - from.omega;
        let part = if width > 0.0 { (omega - from.omega) / width } else { 0.0 };
        let between = |from: f64, to: f64| from + part * (to - from);
        Complex::unit(between(from.phase_rad, to.phase_rad)).scaled(libm::exp(between(from.ln_gain, to.ln_gain)))
    }

    /// P/(1 + L): displacement per demand added behind the PID.
    pub(crate) fn demand_to_displacement(&self, frequency_hz: f64) -> Complex {
        let omega = TAU * frequency_hz;
        self.rod(omega).over(Complex::real(1.0).plus(self.open(omega)))
    }

    fn rod(&self, omega: f64) -> Complex {
        let half = 0.5 * omega * self.tick_s;
        let sinc = if half > 0.0 { libm::sin(half) / half } else { 1.0 };
        let denominator = Complex {
            re: self.stiffness_per_s2 - omega * omega,
            im: self.damping_per_s * omega,
        };
        Complex::real(self.stiffness_per_s2 * sinc * sinc).over(denominator)
    }

    fn controller(&self, omega: f64) -> Complex {
        let Some(pid) = &self.pid else {
            return Complex::real(0.0);
        };
        let back = Complex::unit(-omega * self.tick_s);
        let difference = Complex::real(1.0).plus(back.scaled(-1.0));
        let mut sum = Complex::real(pid.kp);
        if pid.ki_per_s > 0.0 {
            sum = sum.plus(Complex::real(pid.ki_per_s * self.tick_s).over(difference));
        }
        if pid.kd_s > 0.0 {
            let filter = libm::exp(-self.tick_s / pid.derivative_filter_s);
            let smooth = Complex::real(1.0 - filter).over(Complex::real(1.0).plus(back.scaled(-filter)));
            sum = sum.plus(difference.times(smooth).scaled(pid.kd_s / self.tick_s));
        }
        sum
    }

    pub(crate) fn open(&self, omega: f64) -> Complex {
        let ticks = f64::from(self.delay_ticks);
        let delay = Complex::unit(-ticks * omega * self.tick_s - omega * self.further_delay_s);
        let mut open = self.controller(omega).times(self.rod(omega)).times(delay);
        if !self.measured.is_empty() {
            open = open.times(self.ratio(omega));
        }
        self.lagging(omega, open)
    }

    /// Behind the further lag.
    fn lagging(&self, omega: f64, value: Complex) -> Complex {
        if self.further_lag_s == 0.0 {
            return value;
        }
        value.over(Complex {
            re: 1.0,
            im: omega * self.further_lag_s,
        })
    }

    /// 1 + L on the half circle, without its ends.
    pub(crate) fn return_differences(&self) -> impl Iterator<Item = (f64, Complex)> + '_ {
        (1..POINTS).map(|index| {
            let omega = PI / self.tick_s * f64::from(index) / f64::from(POINTS);
            (omega, Complex::real(1.0).plus(self.open(omega)))
        })
    }

    /// Half the sampling rate.
    pub(crate) fn highest_hz(&self) -> f64 {
        0.5 / self.tick_s
    }

    /// Distance of L from −1, no unit: 1 without feedback, 0 at the edge of stability; 0.5 is a usual design value.
    pub fn modulus_margin(&self) -> f64 {
        self.return_differences()
            .fold(1.0, |least: f64, (_, value)| least.min(value.magnitude()))
    }

    /// True if the linear loop is stable.
    pub fn is_stable(&self) -> bool {
        let integrates = self.pid.as_ref().is_some_and(|pid| pid.ki_per_s > 0.0);
        let (mut turned, mut before) = (0.0, Complex::real(1.0));
        for (omega, value) in self.return_differences() {
            let factor = if integrates {
                Complex::real(1.0).plus(Complex::unit(-omega * self.tick_s).scaled(-1.0))
            } else {
                Complex::real(1.0)
            };
            let point = value.times(factor);
            let step = point.over(before);
            turned += libm::atan2(step.im, step.re);
            before = point;
        }
        // From a positive real number to a real one: a stable loop ends where it began, an unstable one π or more away.
        turned.abs() < 0.5 * PI
    }

    /// Refuses gains that make the linear loop unstable.
    ///
    /// # Errors
    /// If so, with the gains.
    pub fn validate(&self) -> Result<(), Invalid> {
        if self.is_stable() {
            return Ok(());
        }
        let Some(pid) = &self.pid else { return Ok(()) };
        let delay = match self.delay_ticks {
            MIN_DELAY_TICKS => "two".to_owned(),
            ticks => ticks.to_string(),
        };
        Err(Invalid::new(
            "feedback",
            format!(
                "kp = {} m/m, ki_per_s = {} 1/s and kd_s = {} s together are unstable with this rod ({:.0} Hz) and {delay} ticks of {} s of delay{}, \
                 even with the hysteresis inverted exactly: lower them",
                pid.kp,
                pid.ki_per_s,
                pid.kd_s,
                libm::sqrt(self.stiffness_per_s2) / TAU,
                self.tick_s,
                self.further()
            ),
        ))
    }

    /// In words, for refusals.
    fn further(&self) -> String {
        let (delay_s, lag_s) = (self.further_delay_s, self.further_lag_s);
        if delay_s == 0.0 && lag_s == 0.0 {
            return String::new();
        }
        format!(" and, of the known effects, {delay_s} s of delay and {lag_s} s of lag")
    }
}
