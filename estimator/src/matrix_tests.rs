//! Guards the matrix law: its closed form, its Lyapunov function for any positive real system, what a dead zone costs,
//! and bad data.

use super::*;
use crate::Mode;
use crate::sampled_modes::tests::any_modes;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use proptest::prelude::*;

const LOWER: f64 = 6300.0;
const UPPER: f64 = 7300.0;

/// ξᵀPξ with ξ in real coordinates, two for a pair of modes: the storage function of the sampled system.
struct Storage {
    matrix: DMatrix<f64>,
}

/// The real form (A, B, C) of the blocks.
fn real_form(blocks: &[(Complex64, Complex64)]) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let size = 2 * blocks.len();
    let mut a = DMatrix::zeros(size, size);
    let (mut b, mut c) = (DVector::zeros(size), DVector::zeros(size));
    for (i, (transition, input)) in blocks.iter().enumerate() {
        let (re, im) = (2 * i, 2 * i + 1);
        a[(re, re)] = transition.re;
        a[(re, im)] = -transition.im;
        a[(im, re)] = transition.im;
        a[(im, im)] = transition.re;
        (b[re], b[im], c[re]) = (input.re, input.im, 1.0);
    }
    (a, b, c)
}

impl Storage {
    /// The least P with Δ(ξᵀPξ) ≤ 2 z v − 2 η z² for all ξ and v: the available storage, where the positive real
    /// Riccati iteration P ← AᵀPA + 2η CᵀC + KᵀK/(m − BᵀPB), K = (1 − 2ηg) C − BᵀPA, m = 2g − 2ηg², comes to from 0.
    /// By structure-preserving doubling, a pass of which does the work of all passes before it: a slow mode near the
    /// limit needs millions of steps.
    fn of(law: &Matrix) -> Storage {
        let (mut a, b, c) = real_form(&law.system.blocks());
        let (g, eta, size) = (law.feedthrough, law.passivity, b.len());
        let margin = 2.0 * g - 2.0 * eta * g * g;
        let cross = 1.0 - 2.0 * eta * g;
        // The form without a cross term: P = AᵀP(I − GP)⁻¹A + H.
        let mut gain = &b * b.transpose() / margin;
        let mut storage = &c * c.transpose() * (2.0 * eta + cross * cross / margin);
        a -= &b * c.transpose() * (cross / margin);
        for _ in 0..60 {
            let inverse = (DMatrix::identity(size, size) - &gain * &storage)
                .try_inverse()
                .unwrap();
            let onwards = &a * &inverse;
            let grown = a.transpose() * &storage * &inverse * &a;
            gain += &onwards * &gain * a.transpose();
            a = onwards * a;
            storage += &grown;
            storage = 0.5 * (&storage + storage.transpose());
            if grown.amax() <= 1e-17 * storage.amax() {
                assert!(margin > b.dot(&(&storage * &b)), "not passive");
                return Storage { matrix: storage };
            }
        }
        panic!("the Riccati iteration does not settle");
    }

    fn value(&self, state: &[Complex64], other: &[Complex64]) -> f64 {
        let both = state.iter().zip(other);
        let difference: Vec<f64> = both
            .flat_map(|(one, other)| [one.re - other.re, one.im - other.im])
            .collect();
        let difference = DVector::from_vec(difference);
        difference.dot(&(&self.matrix * &difference))
    }
}

/// Any system that passes the check, any gain and any start.
#[derive(Debug, Clone)]
struct Any {
    law: Matrix,
    truth: f64,
    first: f64,
}

/// f is of the order of 1 in these tests and θ of 1000 A/m; gains reach from hardly any adaptation to 1000 times what
/// needs no damping.
fn any_law(dead_zone: impl Strategy<Value = f64>) -> impl Strategy<Value = Any> {
    let shape = LOWER..=UPPER;
    (
        any_modes(),
        -1.5..0.5_f64,
        -4.0..3.0_f64,
        shape.clone(),
        shape,
        dead_zone,
        -1.0..1.0_f64,
    )
        .prop_filter_map(
            "not positive real",
            |(modes, tick, gain, start, truth, dead_zone, first)| {
                let modes = Modes::new(&modes).ok()?;
                let tick_s = libm::pow(10.0, tick);
                let mut constants = MatrixConstants {
                    start_a_per_m: start,
                    dead_zone: 0.0,
                    gain: 0.0,
                    window_a_per_m: None,
                };
                let unit = Matrix::new(&modes, constants, 9, tick_s).ok()?;
                let slope = 1.0 / (UPPER - LOWER);
                constants.gain = libm::pow(10.0, gain) * unit.passivity / (tick_s * slope * slope);
                constants.dead_zone = dead_zone * unit.feedthrough;
                let law = Matrix::new(&modes, constants, 9, tick_s).ok()?;
                Some(Any { law, truth, first })
            },
        )
}

/// Runs a law beside its plant; `seen` gets the storage's part and the shape's part of V, before and after each tick.
fn run(any: &Any, histories: &[Vec<f64>], mut seen: impl FnMut(&Matrix, &Correction, f64, f64)) {
    let grid = Grid::new(LOWER, UPPER, 9);
    let (mut law, mut plant, truth) = (any.law.clone(), any.law.system.clone(), any.truth);
    // Any first error of the state, and an input before it.
    let mut last = any.first;
    plant.advance(any.first);
    let storage = Storage::of(&law);
    let lyapunov = |law: &Matrix, plant: &SampledModes| {
        let shape = law.shape_a_per_m - truth;
        storage.value(law.system.state(), plant.state()) + shape * shape / law.gain
    };
    // The law's state stands at t_k−1's ξ until the next tick; V is taken of ξ(t_k), so both are moved on first.
    let ahead = |law: &Matrix, plant: &SampledModes, last: f64| {
        let (mut law, mut plant) = (law.clone(), plant.clone());
        law.system.advance(law.applied);
        plant.advance(last);
        lyapunov(&law, &plant)
    };
    for outputs in histories {
        let before = ahead(&law, &plant, last);
        let input = grid.linear(outputs, truth);
        let output = plant.advance(last) + law.feedthrough * input;
        last = input;
        let standing = law.shape_a_per_m - truth;
        let found = law.correct(&grid, outputs, output);
        let after = ahead(&law, &plant, last);
        seen(&law, &found, after - before, standing);
    }
}

fn any_histories() -> impl Strategy<Value = Vec<Vec<f64>>> {
    prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, 9), 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    // Guards the closed form against the equation it solves.
    #[test]
    fn the_output_error_solves_its_equation(
        drive in 0.0..10.0_f64, threshold in 0.0..2.0_f64, damping in 0.0..50.0_f64, zone in 0.0..1.0_f64,
    ) {
        let z = output_error(drive, threshold, damping, zone);
        prop_assert!(z >= 0.0);
        let left = z + threshold * (z / zone).min(1.0) + damping * (z - zone).max(0.0);
        prop_assert!((left - drive).abs() <= 1e-11 * (1.0 + drive));
        // Without a dead zone sat() is a sign: any threshold up to the whole one holds the error at 0.
        let z = output_error(drive, threshold, damping, 0.0);
        prop_assert_eq!(z == 0.0, drive <= threshold);
        prop_assert!(z == 0.0 || ((1.0 + damping) * z + threshold - drive).abs() <= 1e-12 * (1.0 + drive));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    // Guards the theorem without a dead zone: any positive real system, any functions of θ, tick by tick anew, any
    // step.
    #[test]
    fn without_a_dead_zone_the_lyapunov_function_never_grows(any in any_law(Just(0.0)), histories in any_histories()) {
        let mut worst = f64::NEG_INFINITY;
        let mut scale = 0.0_f64;
        run(&any, &histories, |law, _, growth, standing| {
            worst = worst.max(growth);
            scale = scale.max(standing * standing / law.gain + law.feedthrough);
        });
        prop_assert!(worst <= 1e-9 * scale, "grows by {worst:e} of {scale:e}");
    }

    // Guards what follows for the user: from rest the estimate never stands further from the truth than it started.
    #[test]
    fn from_rest_the_estimate_never_moves_away(any in any_law(Just(0.0)), histories in any_histories()) {
        let any = Any { first: 0.0, ..any };
        let first = (any.law.shape_a_per_m - any.truth).abs();
        run(&any, &histories, |law, _, _, _| {
            let now = (law.shape_a_per_m - any.truth).abs();
            assert!(now <= first + 1e-6, "from {first} A/m to {now} A/m");
        });
    }

    // Guards the price of a dead zone: V grows by no more than the file's head says.
    #[test]
    fn with_a_dead_zone_it_grows_by_no_more_than_said(any in any_law(0.01..1.0_f64), histories in any_histories()) {
        run(&any, &histories, |law, found, growth, standing| {
            let (error, zone) = (found.output_error_m.abs(), law.dead_zone);
            let cover = if found.output_error_m > 0.0 { found.lower_cover_m } else { found.upper_cover_m };
            let gap = (found.predicted_output_m - cover).abs();
            let cross = (found.output_error_m.signum() * found.slope_m_per_a_per_m * standing).max(0.0);
            let bound = 2.0 * error.min(zone) * cross + 2.0 * error * gap * (1.0 - error / zone).max(0.0);
            let scale = standing * standing / law.gain + law.feedthrough + error * error / law.feedthrough;
            assert!(growth <= bound + 1e-9 * scale, "grows by {growth:e}, bound {bound:e} of {scale:e}");
        });
    }

    // Guards the window: without a dead zone V cannot grow in a tick whose window contains the truth.
    #[test]
    fn within_its_window_the_lyapunov_function_never_grows(
        any in any_law(Just(0.0)), window in 50.0..500.0_f64, histories in any_histories(),
    ) {
        let law = Matrix { window_a_per_m: Some(window), ..any.law.clone() };
        run(&Any { law, ..any }, &histories, |law, found, growth, standing| {
            let error = found.output_error_m;
            let scale = standing * standing / law.gain + law.feedthrough + error * error / law.feedthrough;
            assert!(standing.abs() > window || growth <= 1e-9 * scale, "grows by {growth:e} of {scale:e}");
        });
    }

    // Guards the loop from a broken sensor: any bit pattern leaves the estimate in its range and the correction's
    // numbers finite.
    #[test]
    fn any_measurement_leaves_the_estimate_in_its_range(
        any in any_law(0.0..1.0_f64), words in prop::collection::vec(any::<u64>(), 1..20),
    ) {
        let grid = Grid::new(LOWER, UPPER, 9);
        let mut law = any.law;
        let outputs = [0.1, 0.5, 0.2, 0.4, 0.3, 0.7, -0.2, 0.0, 0.1];
        for word in words {
            let word = f64::from_bits(word);
            let found = law.correct(&grid, &outputs, if word.abs() > 1e100 { f64::NAN } else { word });
            prop_assert!((LOWER..=UPPER).contains(&found.shape_a_per_m));
            prop_assert!(found.output_error_m.is_finite() && found.slope_m_per_a_per_m.is_finite());
        }
    }
}

// Guards a tick without a measurement: the estimate stays and the copy runs on with the prediction.
#[test]
fn a_missing_measurement_holds_the_estimate() {
    let modes = Modes::new(&[Mode {
        eigenvalue_per_s: (-1.0).into(),
        input: 1.0.into(),
    }])
    .unwrap();
    let constants = MatrixConstants {
        start_a_per_m: 6800.0,
        dead_zone: 1e-3,
        gain: 1e5,
        window_a_per_m: None,
    };
    let mut law = Matrix::new(&modes, constants, 5, 0.1).unwrap();
    let grid = Grid::new(LOWER, UPPER, 5);
    let outputs = [5.0, 4.0, 3.0, 2.5, 2.0];
    for _ in 0..1000 {
        let found = law.correct(&grid, &outputs, f64::NAN);
        assert!(found.held && !found.adapting && found.shape_a_per_m == 6800.0 && found.output_error_m == 0.0);
    }
    // At rest at f(6800) = 3; a measurement that agrees finds nothing to correct.
    assert!(law.correct(&grid, &outputs, 3.0).output_error_m.abs() < 1e-12);
}
