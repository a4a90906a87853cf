//! I = Σ w (Y′ − mean Y′)²/σ²,  s = 1/√I,  w = exp(−age/T): what the recent motion can say about `a`, whatever the law.
//!
//! Y′ = dY/dθ of the predicted displacement at the estimate (m per A/m), σ noise of the displacement sensor (m), T memory (s),
//! I Fisher information of `a` ((A/m)⁻²), s the Cramér-Rao bound on its standard deviation (A/m). The mean of Y′, weighted by w too, is
//! taken out because the zero of the displacement is not known (expansion, mean force): that is the information left when a
//! constant offset is estimated along with `a`. At rest and in a dwell Y′ is constant, I decays to 0 and the estimate is held.
//!
//! **Condition (19)**, β ∫ (f(û) − f(θ)) dτ ≥ 2ε + ε₀|θ̃| over some recent subinterval, β = 1 where f is convex at θ̂ and −1 where it
//! is concave, decides whether the min-max law with covers over all of Θ can leave its dead zone. θ is not known, but for a small
//! error f(û) − f(θ) = −Y′(θ − û): the largest integral of −βκY′ over a subinterval with one β serves a truth above the
//! estimate, that of +βκY′ one below. Each gives the least |θ̃| for which (19) holds with ε₀ → 0: 2ε over that integral.
//! Subintervals are found by Kadane's rule and fade with T. κ filter (1/s) and ε dead zone (m) are the folded law's; covers over a window
//! need (19) less the narrower they are.
//! Source: the paper's Theorem 1; Cramér-Rao with a nuisance parameter.

use crate::{ExcitationSettings, MinMaxSettings, SmoothPoint};
use serde::{Deserialize, Serialize};

/// What the recent motion says about `a`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Excitation {
    /// I, 1/(A/m)².
    pub information_per_a2_per_m2: f64,
    /// Bound on the standard deviation from that information alone, A/m; infinite where there is none.
    pub deviation_bound_a_per_m: f64,
    /// The bound is good enough to learn from.
    pub informed: bool,
    /// (19) holds for a true shape this much above the estimate or more, A/m; infinite where it does not hold.
    pub least_error_above_a_per_m: f64,
    /// The same for a true shape below the estimate.
    pub least_error_below_a_per_m: f64,
}

impl Default for Excitation {
    /// Nothing is known.
    fn default() -> Self {
        Self {
            information_per_a2_per_m2: 0.0,
            deviation_bound_a_per_m: f64::INFINITY,
            informed: false,
            least_error_above_a_per_m: f64::INFINITY,
            least_error_below_a_per_m: f64::INFINITY,
        }
    }
}

/// Largest integral over a recent subinterval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    current: f64,
    largest: f64,
}

impl Run {
    fn add(&mut self, keep: f64, integrand: f64, goes_on: bool) {
        let before = if goes_on { self.current * keep } else { 0.0 };
        self.current = (before + integrand).max(0.0);
        self.largest = (self.largest * keep).max(self.current);
    }

    /// The least |θ̃| for which (19) holds. Without a dead zone any error will do, but only on a motion that has moved.
    fn least_error(&self, dead_zone: f64) -> f64 {
        if self.largest > 0.0 {
            2.0 * dead_zone / self.largest
        } else {
            f64::INFINITY
        }
    }
}

/// Watches the slope of the predicted output at the estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExcitationMonitor {
    /// exp(−dt/T).
    keep: f64,
    noise_variance_m2: f64,
    worst_deviation_a_per_m: f64,
    /// κ dt.
    filter: f64,
    dead_zone_m: f64,
    /// Σ w.
    weight: f64,
    /// Weighted mean of Y′.
    mean: f64,
    /// Σ w (Y′ − mean)².
    squares: f64,
    /// β.
    convexity: f64,
    above: Run,
    below: Run,
}

impl ExcitationMonitor {
    /// A monitor that has seen nothing. κ and ε are taken from `law`.
    pub fn new(settings: &ExcitationSettings, law: &MinMaxSettings, tick_s: f64) -> Self {
        Self {
            keep: libm::exp(-tick_s / settings.memory_s),
            noise_variance_m2: settings.noise_m * settings.noise_m,
            worst_deviation_a_per_m: settings.worst_deviation_a_per_m,
            filter: law.filter_per_s * tick_s,
            dead_zone_m: law.dead_zone_m,
            weight: 0.0,
            mean: 0.0,
            squares: 0.0,
            convexity: 0.0,
            above: Run::default(),
            below: Run::default(),
        }
    }

    /// Takes one tick in; a tick without a usable measurement (`measured` false) only fades what was before.
    pub fn observe(&mut self, output: SmoothPoint, measured: bool) -> Excitation {
        self.weight *= self.keep;
        self.squares *= self.keep;
        let convexity = if measured { output.curvature } else { 0.0 };
        let convexity = if convexity == 0.0 { 0.0 } else { convexity.signum() };
        if measured {
            // West's update of a weighted variance: nothing cancels when Y′ hardly moves about a large mean.
            self.weight += 1.0;
            let away = output.slope - self.mean;
            self.mean += away / self.weight;
            self.squares += away * away * (1.0 - 1.0 / self.weight);
        }
        let goes_on = convexity == self.convexity;
        let integrand = convexity * self.filter * output.slope;
        self.convexity = convexity;
        self.above.add(self.keep, -integrand, goes_on);
        self.below.add(self.keep, integrand, goes_on);
        let information = self.squares / self.noise_variance_m2;
        let deviation = 1.0 / information.sqrt();
        Excitation {
            information_per_a2_per_m2: information,
            deviation_bound_a_per_m: deviation,
            informed: deviation <= self.worst_deviation_a_per_m,
            least_error_above_a_per_m: self.above.least_error(self.dead_zone_m),
            least_error_below_a_per_m: self.below.least_error(self.dead_zone_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 5e-5;

    fn monitor() -> ExcitationMonitor {
        ExcitationMonitor::new(&ExcitationSettings::default(), &MinMaxSettings::folded(), TICK_S)
    }

    fn point(slope: f64, curvature: f64) -> SmoothPoint {
        SmoothPoint {
            value: 0.0,
            slope,
            curvature,
        }
    }

    // Guards the information against its closed form: a sine of amplitude A has variance A²/2 over T/dt effective samples.
    #[test]
    fn a_sine_informs_as_much_as_it_should() {
        let mut monitor = monitor();
        let mut last = Excitation::default();
        for tick in 0..40_000 {
            let angle = 2.0 * std::f64::consts::PI * 500.0 * TICK_S * f64::from(tick);
            last = monitor.observe(point(2e-9 * libm::sin(angle), 0.0), true);
        }
        let expected = 0.1 / TICK_S * 0.5 * (2e-9_f64 / 10e-9).powi(2);
        assert!(
            (last.information_per_a2_per_m2 / expected - 1.0).abs() < 0.01,
            "{last:?}"
        );
        assert!((last.deviation_bound_a_per_m - 1.0 / expected.sqrt()).abs() < 1e-2 && last.informed);
    }

    // Guards the offset: however sensitive a dwell is, a constant says nothing, and a missing sensor lets all fade.
    #[test]
    fn rest_dwell_and_silence_do_not_inform() {
        let mut monitor = monitor();
        for _ in 0..1000 {
            assert_eq!(monitor.observe(point(5e-9, 1e-12), true).information_per_a2_per_m2, 0.0);
        }
        for tick in 0..1000 {
            monitor.observe(point(5e-9 * libm::sin(0.1 * f64::from(tick)), 1e-12), true);
        }
        let moving = monitor.observe(point(5e-9, 1e-12), true);
        let mut silent = monitor.clone();
        let dwell = (0..60_000).map(|_| monitor.observe(point(5e-9, 1e-12), true)).last();
        let silence = (0..60_000).map(|_| silent.observe(point(5e-9, 1e-12), false)).last();
        assert!(moving.informed && !dwell.unwrap_or(moving).informed && !silence.unwrap_or(moving).informed);
    }

    // Guards a law without a dead zone: before anything has moved it is told nothing, and never NaN.
    #[test]
    fn without_a_dead_zone_any_error_will_do_once_it_moves() {
        let folded = MinMaxSettings {
            dead_zone_m: 0.0,
            ..MinMaxSettings::folded()
        };
        let mut monitor = ExcitationMonitor::new(&ExcitationSettings::default(), &folded, TICK_S);
        let at_rest = monitor.observe(point(0.0, 0.0), true);
        assert_eq!(at_rest.least_error_above_a_per_m, f64::INFINITY);
        let moving = monitor.observe(point(-1e-9, 1e-12), true);
        assert_eq!(moving.least_error_above_a_per_m, 0.0);
    }

    // Guards (19): convex and falling in θ serves only a truth above, whatever the sign of the input, since both turn together;
    // a change of convexity alone serves both sides.
    #[test]
    fn condition_19_knows_its_side() {
        let mut langevin = monitor();
        let mut last = Excitation::default();
        for tick in 0..4000 {
            let sign = if tick % 400 < 200 { 1.0 } else { -1.0 };
            last = langevin.observe(point(-2e-9 * sign, 1e-12 * sign), true);
        }
        // 200 ticks of 2e-9 m per A/m at κ dt = 0.05 integrate to 2e-8 m per A/m; twice the dead zone is 4e-9 m.
        assert!((0.19..0.22).contains(&last.least_error_above_a_per_m), "{last:?}");
        assert_eq!(last.least_error_below_a_per_m, f64::INFINITY);
        let mut ising = monitor();
        for tick in 0..400 {
            last = ising.observe(point(-2e-9, if tick < 200 { 1e-12 } else { -1e-12 }), true);
        }
        assert!(last.least_error_above_a_per_m < 0.25 && last.least_error_below_a_per_m < 0.25);
    }
}
