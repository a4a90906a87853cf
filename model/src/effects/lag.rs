//! τ dy/dt = x − y, exact for x that is a straight line within a tick (first-order hold).
//!
//! y_k+1 = E y_k + (g − E) x_k + (1 − g) x_k+1,  E = e^(−T/τ),  g = (τ/T)(1 − E);  τ time constant, T tick (s).
//! Any τ is stable, and y → x with a derivative in τ as τ → 0. Source: the variation of constants.

use serde::{Deserialize, Serialize};

/// E and 1 − g; 0 and 1 without a lag, where the output is the input.
pub(crate) fn ramp_weights(time_constant_s: f64, tick_s: f64) -> (f64, f64) {
    if time_constant_s > 0.0 {
        // 1 − E keeps its digits for a lag much longer than a tick.
        let fallen = -libm::expm1(-tick_s / time_constant_s);
        (1.0 - fallen, 1.0 - fallen * time_constant_s / tick_s)
    } else {
        (0.0, 1.0)
    }
}

/// A first-order lag with its state, from rest at 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lag {
    weight_output: f64,
    weight_from: f64,
    weight_to: f64,
    input: f64,
    output: f64,
}

impl Lag {
    /// τ of 0 passes the input on.
    pub fn new(time_constant_s: f64, tick_s: f64) -> Self {
        let (decay, weight_to) = ramp_weights(time_constant_s, tick_s);
        Lag {
            weight_output: decay,
            weight_from: 1.0 - decay - weight_to,
            weight_to,
            input: 0.0,
            output: 0.0,
        }
    }

    /// The next output is the first number plus the second times the next input.
    pub fn response(&self) -> (f64, f64) {
        let rest = self.weight_output * self.output + self.weight_from * self.input;
        (rest, self.weight_to)
    }

    /// Takes an input that has stood for ever.
    pub fn steady_state(&mut self, input: f64) -> f64 {
        (self.input, self.output) = (input, input);
        input
    }

    /// The input of the last step.
    pub fn input(&self) -> f64 {
        self.input
    }

    /// The output of the last step.
    pub fn output(&self) -> f64 {
        self.output
    }

    /// The output one tick later, when the input has gone linearly to `input`.
    #[inline]
    pub fn step(&mut self, input: f64) -> f64 {
        self.output = self.weight_output * self.output + self.weight_from * self.input + self.weight_to * input;
        self.input = input;
        self.output
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards every lag of the library: a ramp r·t gives r(t − τ(1 − e^(−t/τ))), with τ from far below a tick to
    /// far above, where an explicit rule would diverge.
    #[test]
    fn a_ramp_comes_out_exactly() {
        let tick_s = 1e-4;
        for time_constant_s in [1e-9, 2e-5, 1e-4, 1.8e-3, 3.0] {
            let mut lag = Lag::new(time_constant_s, tick_s);
            lag.steady_state(0.0);
            for k in 1..2000 {
                let time_s = tick_s * f64::from(k);
                let expected = time_s + time_constant_s * libm::expm1(-time_s / time_constant_s);
                let output = lag.step(time_s);
                assert!(
                    (output - expected).abs() <= 1e-12 * time_s,
                    "{time_constant_s} s, tick {k}"
                );
            }
        }
    }

    /// Guards the derivative at the identity: output minus input is −τ dx/dt for small τ, and 0 at τ = 0.
    #[test]
    fn it_vanishes_smoothly() {
        let difference = |time_constant_s: f64| {
            let mut lag = Lag::new(time_constant_s, 1e-4);
            lag.steady_state(0.0);
            lag.step(3.0) - 3.0
        };
        assert_eq!(difference(0.0), 0.0);
        for time_constant_s in [1e-9, 1e-7] {
            assert!((difference(time_constant_s) / time_constant_s + 3e4).abs() < 3e-4);
        }
    }
}
