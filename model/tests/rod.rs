//! Guards the recovered rod constants against every digit the paper prints of (13), the two errata that change them,
//! and the exactness of the propagation.

use anhyst_model::{
    Magnetostriction, Material, RodConstants, RodElements, RodElementsPropagator, RodState, TwoPole, TwoPolePropagator,
};
use nalgebra::{Complex, DMatrix};

const PRINTED_GAIN: f64 = 1.3724e-2;
const PRINTED_DAMPING: f64 = 7.8899e3;
const PRINTED_STIFFNESS: f64 = 6.4251e7;

fn paper(elements: usize) -> RodElements {
    RodElements::assemble(&RodConstants::paper(), elements).expect("the paper's rod")
}

fn linearised() -> f64 {
    Material::terfenol_d().strain_per_magnetization()
}

#[test]
fn two_elements_give_the_printed_poles() {
    let two_pole = paper(2).two_pole(linearised());
    println!(
        "2 elements: k̂ {:.2} 1/s, ĉ {:.5e} 1/s²",
        two_pole.damping_per_s, two_pole.stiffness_per_s2
    );
    assert!((two_pole.damping_per_s - PRINTED_DAMPING).abs() < 0.05);
    assert!((two_pole.stiffness_per_s2 - PRINTED_STIFFNESS).abs() < 0.00005e7 * 10.0);
    assert_eq!(format!("{:.4e}", two_pole.stiffness_per_s2), "6.4251e7");
    assert_eq!(format!("{:.4e}", two_pole.damping_per_s), "7.8899e3");
}

#[test]
fn gain_follows_from_the_rod_and_the_linearised_bias() {
    let two_pole = paper(8).two_pole(linearised());
    println!(
        "8 elements: w {:.5e}, DC {:.4e} m per A/m",
        two_pole.gain,
        two_pole.dc_gain()
    );
    println!(
        "  {:.1} Hz, damping ratio {:.4}",
        two_pole.natural_frequency_hz(),
        two_pole.damping_ratio()
    );
    assert!((two_pole.gain / PRINTED_GAIN - 1.0).abs() < 1e-3);
    assert!((two_pole.dc_gain() / 2.136e-10 - 1.0).abs() < 1e-3);
    let two_pole = paper(2).two_pole(linearised());
    assert!((two_pole.natural_frequency_hz() - 1275.7).abs() < 0.1);
    assert!((two_pole.damping_ratio() - 0.492).abs() < 5e-4);
}

/// (9) prints M² + 2·Ms·M; its tangent at zero doubles the gain.
#[test]
fn printed_bias_term_doubles_the_gain() {
    let material = Material::terfenol_d();
    let saturation = material.hysteresis.saturation_magnetization_a_per_m;
    let printed_tangent = 1.5 * 1.005e-3 / (saturation * saturation) * 2.0 * saturation;
    let biased = Magnetostriction::Biased {
        saturation_magnetostriction: 1.005e-3,
        bias_fraction: 0.5,
    };
    let derived_tangent = biased.slope(0.0, saturation);
    let (printed, derived) = (paper(8).two_pole(printed_tangent), paper(8).two_pole(derived_tangent));
    assert!((printed.gain / derived.gain - 2.0).abs() < 1e-12);
    assert!((derived.gain / PRINTED_GAIN - 1.0).abs() < 1e-3);
    assert!((printed.gain / PRINTED_GAIN - 2.0).abs() < 2e-3);
}

/// All poles of M s² + C s + K, as eigenvalues of the first-order form.
fn poles(mass: &DMatrix<f64>, damping: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let count = mass.nrows();
    let inverse = mass.clone().try_inverse().expect("mass matrix");
    let mut system = DMatrix::zeros(2 * count, 2 * count);
    // Time in units of 0.1 ms keeps the entries comparable, which the eigenvalue routine needs.
    let unit = 1e-4;
    system.view_mut((0, count), (count, count)).fill_with_identity();
    system
        .view_mut((count, 0), (count, count))
        .copy_from(&(-&inverse * stiffness * (unit * unit)));
    system
        .view_mut((count, count), (count, count))
        .copy_from(&(-&inverse * damping * unit));
    let mut poles: Vec<_> = system.complex_eigenvalues().iter().map(|pole| pole / unit).collect();
    poles.sort_by(|left, right| left.norm().total_cmp(&right.norm()));
    poles
}

fn dense(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |row, column| rows[row][column])
}

/// The reduction's Newton finds the slowest of all poles, for the paper's rod with any number of elements.
#[test]
fn reduction_takes_the_slowest_pole_pair() {
    for count in [1, 2, 3, 4, 8, 16] {
        let elements = paper(count);
        let [mass, damping, stiffness] = elements.matrices().map(|rows| dense(&rows));
        let slowest = poles(&mass, &damping, &stiffness)[0];
        let two_pole = elements.two_pole(1.0);
        let pair = (-2.0 * slowest.re, slowest.norm_sqr());
        assert!(
            (two_pole.damping_per_s / pair.0 - 1.0).abs() < 1e-9,
            "{count} elements: {two_pole:?}, {pair:?}"
        );
        assert!(
            (two_pole.stiffness_per_s2 / pair.1 - 1.0).abs() < 1e-9,
            "{count} elements: {two_pole:?}, {pair:?}"
        );
    }
}

/// The printed boundary condition M_l·∂²u/∂x∂t puts the mass into the damping matrix of the last element
/// (u_x at the tip is the last element's strain). The printed poles are then out of reach.
#[test]
fn printed_boundary_condition_misses_the_poles() {
    let constants = RodConstants {
        end_mass_kg: 0.0,
        ..RodConstants::paper()
    };
    for count in [2, 8] {
        let elements = RodElements::assemble(&constants, count).expect("massless end");
        let [mass, mut damping, stiffness] = elements.matrices().map(|rows| dense(&rows));
        let per_length = RodConstants::paper().end_mass_kg * count as f64 / constants.length_m;
        damping[(count - 1, count - 1)] += per_length;
        damping[(count - 1, count - 2)] -= per_length;
        let slowest = poles(&mass, &damping, &stiffness)[0];
        let (rate, square) = (-2.0 * slowest.re, slowest.norm_sqr());
        println!("printed boundary, {count} elements: k̂ {rate:.4e}, ĉ {square:.4e}");
        assert!((rate / PRINTED_DAMPING - 1.0).abs() > 0.5 || (square / PRINTED_STIFFNESS - 1.0).abs() > 0.5);
    }
}

/// How far the two-pole rod is from sixteen elements at the tip, in amplitude and phase together.
#[test]
fn two_pole_follows_the_elements() {
    let elements = paper(16);
    let two_pole = elements.two_pole(1.0);
    let mut previous = 0.0;
    for frequency in [0.0, 50.0, 150.0, 300.0, 500.0, 1000.0] {
        let omega = 2.0 * std::f64::consts::PI * frequency;
        let (re, im) = elements.tip_compliance(frequency);
        let denominator = Complex::new(
            two_pole.stiffness_per_s2 - omega * omega,
            two_pole.damping_per_s * omega,
        );
        let reduced = Complex::from(two_pole.force_gain_per_kg) / denominator;
        let error = (reduced - Complex::new(re, im)).norm() / Complex::new(re, im).norm();
        println!("{frequency:6.0} Hz: two-pole off by {:.3} %", 100.0 * error);
        assert!(error >= previous || error < 1e-9);
        assert!(frequency > 300.0 || error < 0.02, "{frequency} Hz: {error}");
        previous = error;
    }
}

#[test]
fn static_compliance_and_gain_agree_with_the_springs() {
    let constants = RodConstants::paper();
    for count in [1, 2, 5, 20] {
        let two_pole = paper(count).two_pole(linearised());
        let compliance = two_pole.force_gain_per_kg / two_pole.stiffness_per_s2;
        assert!((compliance / constants.static_compliance_m_per_n() - 1.0).abs() < 1e-12);
        let (re, im) = paper(count).tip_compliance(0.0);
        assert!((re / compliance - 1.0).abs() < 1e-9 && im == 0.0);
    }
}

/// Closed form: step response of an underdamped oscillator, sampled at any tick.
#[test]
fn two_pole_propagation_is_exact_for_a_step() {
    let two_pole = paper(8).two_pole(linearised());
    let (wn2, half) = (two_pole.stiffness_per_s2, 0.5 * two_pole.damping_per_s);
    let ringing = (wn2 - half * half).sqrt();
    for tick in [1e-6, 5e-5, 1e-3] {
        let propagator = TwoPolePropagator::new(two_pole, tick).expect("valid");
        let mut state = RodState::default();
        for step in 1..=200 {
            state = propagator.advance(state, 1.0, 1.0);
            let time = tick * f64::from(step);
            let decay = (-half * time).exp();
            let expected = (1.0 - decay * ((ringing * time).cos() + half / ringing * (ringing * time).sin())) / wn2;
            assert!(
                (state.displacement_m - expected).abs() < 1e-12 / wn2,
                "tick {tick}, step {step}"
            );
        }
    }
}

/// Closed form: the particular solution of a ramp is a ramp, from its own initial state.
#[test]
fn two_pole_propagation_is_exact_for_a_ramp() {
    let two_pole = paper(8).two_pole(linearised());
    let (stiffness, damping) = (two_pole.stiffness_per_s2, two_pole.damping_per_s);
    let rate = 1e5;
    let ramp = |time: f64| RodState {
        displacement_m: rate / stiffness * (time - damping / stiffness),
        velocity_m_per_s: rate / stiffness,
    };
    let tick = 1e-4;
    let propagator = TwoPolePropagator::new(two_pole, tick).expect("valid");
    let mut state = ramp(0.0);
    for step in 0..100 {
        let time = tick * f64::from(step);
        state = propagator.advance(state, rate * time, rate * (time + tick));
        let expected = ramp(time + tick);
        assert!((state.displacement_m / expected.displacement_m - 1.0).abs() < 1e-11 || step == 0);
        assert!((state.velocity_m_per_s / expected.velocity_m_per_s - 1.0).abs() < 1e-11);
    }
}

/// One long tick equals many short ones for an input that is linear over all of them, in the finite-element rod too.
#[test]
fn elements_propagation_does_not_depend_on_the_tick() {
    for count in [1, 2, 8, 16] {
        let elements = paper(count);
        let mut coarse = RodElementsPropagator::new(&elements, 1e-3).expect("valid");
        let mut fine = RodElementsPropagator::new(&elements, 1e-6).expect("valid");
        let (strain, force) = ((1e-4, 9e-4), (0.0, -200.0));
        let per_strain = elements.constants().force_per_strain_n();
        let at = |pair: (f64, f64), part: u32| pair.0 + (pair.1 - pair.0) * f64::from(part) / 1000.0;
        // From rest without a load to the first end of the pairs, then to the second.
        let input = |part: u32| per_strain * at(strain, part) + at(force, part);
        coarse.advance(input(0), 0.0);
        for part in 1..=1000 {
            fine.advance(input(0) * f64::from(part) / 1000.0, 0.0);
        }
        coarse.advance(input(1000), 0.0);
        for part in 1..=1000 {
            fine.advance(input(part), 0.0);
        }
        let error = (coarse.tip().displacement_m / fine.tip().displacement_m - 1.0).abs();
        let speed = (coarse.tip().velocity_m_per_s / fine.tip().velocity_m_per_s - 1.0).abs();
        println!("{count} elements: 1 ms tick against 1000 of 1 µs: {error:.1e}, velocity {speed:.1e}");
        assert!(
            error < 1e-9 && speed < 1e-8,
            "{count} elements: {error:.1e}, {speed:.1e}"
        );
    }
}

#[test]
fn one_element_is_the_two_pole_rod() {
    let elements = paper(1);
    let two_pole: TwoPole = elements.two_pole(1.0);
    let tick = 5e-5;
    let propagator = TwoPolePropagator::new(two_pole, tick).expect("valid");
    let mut rod = RodElementsPropagator::new(&elements, tick).expect("valid");
    let mut state = RodState::default();
    let strain = |step: i32| 1e-3 * (f64::from(step) * 0.1).sin();
    for step in 0..500 {
        let (from, to) = (strain(step), strain(step + 1));
        state = propagator.advance(state, two_pole.acceleration(from, 0.0), two_pole.acceleration(to, 0.0));
        let tip_m = rod.advance(elements.constants().force_per_strain_n() * to, 0.0);
        assert!((state.displacement_m - tip_m).abs() < 1e-16);
    }
}

/// A parabola is felt as it is: many short straight ticks along 6s(1 − s) come to the same as one with that mean.
#[test]
fn a_mean_excess_is_felt_in_full() {
    let elements = paper(3);
    let mut coarse = RodElementsPropagator::new(&elements, 1e-4).expect("valid");
    let mut fine = RodElementsPropagator::new(&elements, 1e-7).expect("valid");
    coarse.advance(0.0, 50.0);
    for part in 1..=1000 {
        let share = f64::from(part) / 1000.0;
        fine.advance(50.0 * 6.0 * share * (1.0 - share), 0.0);
    }
    let error = (coarse.tip().displacement_m / fine.tip().displacement_m - 1.0).abs();
    assert!(error < 1e-5, "{error:.1e}");
}

#[test]
fn overdamped_rods_reduce_to_two_real_poles() {
    let constants = RodConstants {
        end_damping_n_s_per_m: 5e4,
        ..RodConstants::paper()
    };
    let elements = RodElements::assemble(&constants, 4).expect("valid");
    let two_pole = elements.two_pole(1.0);
    assert!(two_pole.damping_ratio() > 1.0);
    let [mass, damping, stiffness] = elements.matrices().map(|rows| dense(&rows));
    let slowest = poles(&mass, &damping, &stiffness)[0].re;
    let square = slowest * slowest + two_pole.damping_per_s * slowest + two_pole.stiffness_per_s2;
    assert!(
        square.abs() < 1e-6 * two_pole.stiffness_per_s2,
        "{slowest} is no pole of {two_pole:?}"
    );
}

#[test]
fn refusals() {
    assert!(RodElements::assemble(&RodConstants::paper(), 0).is_err());
    let hollow = RodConstants {
        density_kg_per_m3: f64::NAN,
        ..RodConstants::paper()
    };
    let message = RodElements::assemble(&hollow, 2).expect_err("NaN density").to_string();
    assert_eq!(message, "density is NaN kg/m^3, but must be finite and above 0");
    assert!(TwoPolePropagator::new(paper(2).two_pole(1.0), 0.0).is_err());
    assert!(RodElementsPropagator::new(&paper(2), -1.0).is_err());
}
