//! Guards the step of the folded and the scalar law: its closed form, its Lyapunov function for any step, and what the
//! printed covers would cost.

use super::*;
use crate::{Folded, Law, MinMaxSettings, Prediction};
use proptest::prelude::*;

const LOWER: f64 = 6300.0;
const UPPER: f64 = 7300.0;

/// A law with any constants, at any state: the proof asks for nothing more.
#[derive(Debug, Clone, Copy)]
struct Any {
    form: Form,
    decay: f64,
    h: f64,
    curvature: f64,
    dead_zone: f64,
    start: f64,
    first_error: f64,
}

/// Outputs in these tests are of the order of 1, and so are errors; only ratios matter.
const SENSITIVITY: f64 = 1.0 / (UPPER - LOWER);

/// A law beside the plant that it observes.
struct Pair {
    plant: ScalarPlant,
    law: Scalar,
}

impl Any {
    fn pair(&self, members: usize) -> Pair {
        let law = Scalar {
            form: self.form,
            window_a_per_m: None,
            h: self.h,
            weight: self.h / self.decay,
            gain: self.curvature * self.decay / (SENSITIVITY * SENSITIVITY),
            half_gain: 0.5 * self.curvature / (SENSITIVITY * SENSITIVITY),
            dead_zone: self.dead_zone,
            covers: Covers::with_members(members),
            shape_a_per_m: self.start,
            predicted: self.first_error,
        };
        let plant = ScalarPlant::new(self.decay);
        Pair { plant, law }
    }
}

impl Any {
    /// The same as a law of the loop, at rest.
    fn folded(&self, members: usize) -> Folded {
        let settings = MinMaxSettings {
            range_a_per_m: (LOWER, UPPER),
            start_a_per_m: self.start,
            members,
            filter_per_s: self.h,
            dead_zone_m: self.dead_zone,
            window_a_per_m: None,
            adaptation_rate_per_s: self.curvature,
            sensitivity_m_per_a_per_m: SENSITIVITY,
            ..MinMaxSettings::folded()
        };
        Folded::new(self.form, &settings, 1.0)
    }
}

impl Pair {
    fn correct(&mut self, grid: &Grid, outputs: &[f64], truth: f64, pairing: Pairing) {
        let observed = self.plant.advance(grid.linear(outputs, truth), self.law.weight);
        self.law.correct_paired(grid, outputs, observed, pairing);
    }

    /// V of the file's head, times what makes it a number of the order of 1.
    fn lyapunov(&self, truth: f64) -> f64 {
        let law = &self.law;
        let error = law.predicted - self.plant.state();
        let outside = error - error.clamp(-law.dead_zone, law.dead_zone);
        let shape = law.shape_a_per_m - truth;
        outside * outside + law.weight / law.gain * shape * shape
    }
}

fn any_law() -> impl Strategy<Value = Any> {
    // From far slower to far faster than the tick, from hardly any adaptation to 1000 times what γ dt φ² ≤ 2 allows.
    let form = prop_oneof![3 => Just((Form::Folded, 0.0)), 1 => (Just(Form::Scalar), -2.0..3.0_f64)];
    (
        form,
        -4.0..3.0_f64,
        -4.0..3.0_f64,
        -4.0..0.0_f64,
        LOWER..UPPER,
        -2.0..2.0_f64,
    )
        .prop_map(|((form, decay), h, curvature, zone, start, first_error)| Any {
            form,
            decay: 10_f64.powf(decay),
            h: 10_f64.powf(h),
            curvature: 10_f64.powf(curvature),
            dead_zone: 10_f64.powf(zone),
            start,
            first_error,
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    // Guards the closed form against the equation it solves.
    #[test]
    fn the_output_error_solves_its_equation(
        drive in 0.0..10.0_f64, h in 1e-4..100.0_f64, gap in 0.0..2.0_f64, damping in 0.0..50.0_f64, zone in 1e-4..1.0_f64,
    ) {
        let z = output_error(drive, h, h * gap, damping, zone);
        let left = (1.0 + h) * z + h * gap * (z / zone).min(1.0) + h * damping * (z - zone).max(0.0);
        prop_assert!(z >= 0.0);
        prop_assert!((left - drive).abs() <= 1e-12 * drive.max(1.0) * (1.0 + h * (1.0 + gap / zone)));
    }

    // Guards the theorem: any functions of θ, tick by tick anew, neither convex nor concave nor small steps.
    #[test]
    fn the_lyapunov_function_never_grows(
        any in any_law(),
        truth in LOWER..=UPPER,
        histories in prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, 9), 1..40),
    ) {
        let grid = Grid::new(LOWER, UPPER, 9);
        let mut pair = any.pair(9);
        for outputs in &histories {
            let before = pair.lyapunov(truth);
            pair.correct(&grid, outputs, truth, Pairing::Derived);
            let after = pair.lyapunov(truth);
            prop_assert!(after <= before + 1e-11 * (1.0 + before), "{before} -> {after}");
        }
    }

    // Guards the theorem with a window: V cannot grow in a step whose window contains the truth.
    #[test]
    fn within_its_window_the_lyapunov_function_never_grows(
        any in any_law(),
        truth in LOWER..=UPPER,
        window in 50.0..500.0_f64,
        histories in prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, 9), 1..40),
    ) {
        let grid = Grid::new(LOWER, UPPER, 9);
        let mut pair = any.pair(9);
        pair.law.window_a_per_m = Some(window);
        for outputs in &histories {
            let (before, inside) = (pair.lyapunov(truth), (pair.law.shape_a_per_m - truth).abs() <= window);
            pair.correct(&grid, outputs, truth, Pairing::Derived);
            prop_assert!(!inside || pair.lyapunov(truth) <= before + 1e-11 * (1.0 + before));
        }
    }

    // Guards the loop from a broken sensor: any bit pattern leaves the estimate in its range and every number finite.
    #[test]
    fn any_measurement_leaves_the_estimate_in_its_range(any in any_law(), words in prop::collection::vec(any::<u64>(), 1..20)) {
        let grid = Grid::new(LOWER, UPPER, 5);
        let mut law = any.folded(5);
        let outputs = [0.1, 0.5, 0.2, 0.4, 0.3];
        for word in words {
            let prediction = Prediction { grid: &grid, strains: &outputs, displacements_m: &outputs };
            let found = law.correct(prediction, f64::from_bits(word));
            prop_assert!((LOWER..=UPPER).contains(&found.shape_a_per_m));
            prop_assert!(found.output_error_m.is_finite() && found.slope_m_per_a_per_m.is_finite());
        }
    }
}

/// Runs a law on `outputs(shape, tick)` with a true shape of 7012 A/m; the largest growth of V in a tick and the bias left.
fn run(pairing: Pairing, outputs: impl Fn(f64, u32) -> f64) -> (f64, f64) {
    let grid = Grid::new(LOWER, UPPER, 33);
    let any = Any {
        form: Form::Folded,
        decay: 1.0,
        h: 0.1,
        curvature: 0.1,
        dead_zone: 1e-4,
        start: 6800.0,
        first_error: 0.0,
    };
    let truth = 7012.0;
    let mut pair = any.pair(33);
    let mut largest_growth = f64::NEG_INFINITY;
    for tick in 0..20_000 {
        let outputs: Vec<f64> = grid
            .shapes_a_per_m()
            .iter()
            .map(|&shape| outputs(shape, tick))
            .collect();
        let before = pair.lyapunov(truth);
        pair.correct(&grid, &outputs, truth, pairing);
        largest_growth = f64::max(largest_growth, pair.lyapunov(truth) - before);
    }
    (largest_growth, (pair.law.shape_a_per_m - truth).abs())
}

// Guards the erratum of (18), first half: f is convex in θ while the input is positive and concave while it is negative, as
// the hysteresis is. Same drive, same start; only the pairing of covers and signs differs.
#[test]
fn the_printed_pairing_leaves_a_bias() {
    let swinging = |shape: f64, tick: u32| {
        let input = (2.0 * std::f64::consts::PI * f64::from(tick) / 400.0).sin();
        input * (LOWER / shape) * (LOWER / shape)
    };
    let (growth, bias) = run(Pairing::Derived, swinging);
    assert!(
        growth <= 1e-15 && bias < 1.0,
        "derived: V grows by {growth:e}, bias {bias} A/m"
    );
    let (_, bias) = run(Pairing::Printed, swinging);
    assert!(bias > 3.0, "printed: bias {bias} A/m");
}

// Second half: f concave with its top at the start. The concave cover is f itself, so a* = 0 and φ* is nearly 0: the output
// error builds up and θ̂ does not answer.
#[test]
fn the_printed_pairing_lets_the_lyapunov_function_grow() {
    let peaked = |shape: f64, _: u32| {
        let x = (shape - 6800.0) / 500.0;
        -x * x
    };
    let (growth, _) = run(Pairing::Derived, peaked);
    assert!(growth <= 1e-15, "derived: V grows by {growth:e}");
    let (growth, _) = run(Pairing::Printed, peaked);
    assert!(growth > 1e-6, "printed: V grows by {growth:e}");
}

// Guards what is told about a tick without a measurement, and that it changes nothing.
#[test]
fn a_missing_measurement_holds_everything() {
    let grid = Grid::new(LOWER, UPPER, 5);
    let any = Any {
        form: Form::Folded,
        decay: 1.0,
        h: 0.1,
        curvature: 0.1,
        dead_zone: 1e-3,
        start: 6800.0,
        first_error: 0.5,
    };
    let mut law = any.folded(5);
    let outputs = [5.0, 4.0, 3.0, 2.5, 2.0];
    let prediction = Prediction {
        grid: &grid,
        strains: &outputs,
        displacements_m: &outputs,
    };
    law.correct(prediction, 0.5);
    let before = law.clone();
    let found = law.correct(prediction, f64::NAN);
    assert!(found.held && !found.adapting);
    assert_eq!(law, before);
}
