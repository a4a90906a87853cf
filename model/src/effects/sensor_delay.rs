//! y(t) = u(t − d): the sensor speaks later.
//!
//! u displacement, y what the sensor says (m), d delay (s), any fraction of a tick; y is continuous in d. Between samples u is
//! a straight line, as for a sensor that is sampled itself, and like everything else that enters the chain; that takes
//! (ωT)²/8 of the amplitude half way between two samples. An analogue delay has no such loss: a smoothness of 1 is the
//! cubic through the four nearest samples (Lagrange), with an error of 0.023 (ωT)⁴, 2e-5 at 280 Hz and 10 kHz.
//! Assumption: constant delay. Source: filters, converters and buses of sensors.

use serde::{Deserialize, Serialize};

use super::delay_line::DelayLine;
use super::description::{Description, Stage};
use super::signal::Signal;
use crate::ModelError;
use crate::parameter::ParameterSpec;

pub(super) const DESCRIPTION: Description = Description {
    stage: Stage::Sensor,
    summary: "the sensor's answer comes after a pure delay",
    signature: "phase −ωd at unit gain in the displacement and not in the measured field; gap proportional to rate",
    source: "filters, converters and buses of sensors",
    confused_with: &["loop_delay", "eddy_current", "amplifier_bandwidth"],
    parameters: &[
        ParameterSpec::size("delay_s", "s", [0.0, 0.05], 1e-6).by_ratio(),
        ParameterSpec::fixed("smoothness", "", [0.0, 1.0], 0.0).believed(0.5),
    ],
    ..Description::USUAL
};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorDelay {
    line: DelayLine,
    /// Age of the first of the four samples.
    youngest_ticks: usize,
    weights: [f64; 4],
}

impl Signal for SensorDelay {
    fn new(values: &[f64], tick_s: f64) -> Result<Self, ModelError> {
        let ticks = values[0] / tick_s;
        let line = DelayLine::new(ticks)?;
        let whole = libm::floor(ticks);
        let youngest = if whole > 1.0 { whole - 1.0 } else { 0.0 };
        // The sample sought lies p ticks before the youngest of the four.
        let p = ticks - youngest;
        let straight = if whole < 1.0 {
            [1.0 - p, p, 0.0, 0.0]
        } else {
            [0.0, 2.0 - p, p - 1.0, 0.0]
        };
        let cubic = [
            -(p - 1.0) * (p - 2.0) * (p - 3.0) / 6.0,
            p * (p - 2.0) * (p - 3.0) / 2.0,
            -p * (p - 1.0) * (p - 3.0) / 2.0,
            p * (p - 1.0) * (p - 2.0) / 6.0,
        ];
        let mut weights = straight;
        for (weight, cubic) in weights.iter_mut().zip(cubic) {
            *weight += values[1] * (cubic - *weight);
        }
        Ok(SensorDelay {
            line,
            youngest_ticks: youngest as usize,
            weights,
        })
    }

    fn steady_state(&mut self, input: f64) -> f64 {
        self.line.fill(input);
        input
    }

    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.line.push(input);
        let mut sum = 0.0;
        for (offset, weight) in self.weights.iter().enumerate() {
            sum += weight * self.line.sample(self.youngest_ticks + offset);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Motion<'a> = &'a dyn Fn(f64) -> f64;

    /// Guards delay and interpolation: the smooth one is exact on a cubic, and 4e-5 on a sine of 280 Hz at 10 kHz; the
    /// straight one is exact on a line, and loses (ωT)²/8 of the sine.
    #[test]
    fn a_cubic_and_a_sine_come_later_by_the_delay() {
        let tick_s = 1e-4;
        for delay_s in [0.0, 4.2e-5, 1e-4, 1.999e-4, 5.352e-4] {
            let cubic = |time_s: f64| 1.0 + 1e3 * time_s * (1.0 - 1e2 * time_s * (1.0 + 30.0 * time_s));
            let sine = |time_s: f64| libm::sin(2.0 * core::f64::consts::PI * 280.0 * time_s);
            let line = |time_s: f64| 5.0 - 300.0 * time_s;
            let cases: [(Motion, f64, f64); 4] = [
                (&cubic, 1.0, 1e-12),
                (&sine, 1.0, 4e-5),
                (&line, 0.0, 1e-12),
                (&sine, 0.0, 4e-3),
            ];
            for (signal, smoothness, tolerance) in cases {
                let mut delay = SensorDelay::new(&[delay_s, smoothness], tick_s).unwrap();
                delay.steady_state(signal(0.0));
                for k in 1..300 {
                    let time_s = tick_s * f64::from(k);
                    let output = delay.step(signal(time_s));
                    let expected = signal(time_s - delay_s);
                    assert!(k < 10 || (output - expected).abs() < tolerance, "{delay_s} s, tick {k}");
                }
            }
        }
    }

    /// Guards the fitter: no jump where the delay passes a whole number of ticks.
    #[test]
    fn it_is_continuous_in_the_delay() {
        let output = |delay_s: f64, smoothness: f64| {
            let mut delay = SensorDelay::new(&[delay_s, smoothness], 1e-4).unwrap();
            delay.steady_state(0.0);
            (1..40).fold(0.0, |_, k| delay.step(libm::sin(0.3 * f64::from(k))))
        };
        for ticks in 1..6 {
            let delay_s = 1e-4 * f64::from(ticks);
            for smoothness in [0.0, 1.0] {
                let (before, after) = (delay_s * (1.0 - 1e-9), delay_s * (1.0 + 1e-9));
                assert!((output(before, smoothness) - output(after, smoothness)).abs() < 1e-8);
            }
        }
    }
}
