//! Guards the exact propagation of the modes against other ways to it, and the passivity that the matrix law stands on.

use super::*;
use crate::Mode;
use anhyst_model::{RodState, TwoPole, TwoPolePropagator};
use proptest::prelude::*;

fn rod() -> TwoPole {
    TwoPole {
        gain: 1.3724e-2,
        damping_per_s: 7.8899e3,
        stiffness_per_s2: 6.4251e7,
        force_gain_per_kg: 0.0,
    }
}

fn real(eigenvalue_per_s: f64, input: f64) -> Mode {
    Mode {
        eigenvalue_per_s: eigenvalue_per_s.into(),
        input: input.into(),
    }
}

impl SampledModes {
    /// ξ, for the Lyapunov function of the law's tests.
    pub fn state(&self) -> &[Complex64] {
        &self.state
    }

    /// (Φ, B′) of every kept mode.
    pub fn blocks(&self) -> Vec<(Complex64, Complex64)> {
        self.modes.iter().map(|mode| (mode.transition, mode.input)).collect()
    }

    /// z for the inputs of all ticks, the first being that at rest.
    fn outputs(&mut self, inputs: &[f64]) -> Vec<f64> {
        inputs
            .windows(2)
            .map(|pair| self.advance(pair[0]) + self.feedthrough * pair[1])
            .collect()
    }
}

// Guards the modes against the matrix exponential of the model: y and y + ẏ/μ of the paper's rod, for short and long
// ticks.
#[test]
fn modes_are_the_matrix_exponential() {
    let inputs: Vec<f64> = (0..200)
        .map(|k| libm::sin(0.3 * f64::from(k)) + 0.2 * f64::from(k % 7))
        .collect();
    for (tick_s, zero_per_s) in [(1e-6, 1000.0), (5e-5, 3000.0), (1e-4, 7000.0), (1e-3, 100.0)] {
        let propagator = TwoPolePropagator::new(rod(), tick_s).unwrap();
        let mut state = RodState::default();
        let expected: Vec<(f64, f64)> = inputs
            .windows(2)
            .map(|pair| {
                let [from, to] = [pair[0], pair[1]].map(|input| rod().stiffness_per_s2 * input);
                state = propagator.advance(state, from, to);
                (state.displacement_m, state.velocity_m_per_s)
            })
            .collect();
        let displacement = Modes::of_rod_displacement(&rod()).unwrap();
        let both = Modes::of_rod(&rod(), zero_per_s).unwrap();
        let y = SampledModes::new(&displacement, tick_s).outputs(&inputs);
        let z = SampledModes::new(&both, tick_s).outputs(&inputs);
        let largest = z.iter().copied().fold(0.0, |most: f64, z| most.max(z.abs()));
        for ((y, z), (displacement, velocity)) in y.iter().zip(&z).zip(&expected) {
            assert!((y - displacement).abs() < 1e-11, "{y} {displacement}");
            let z_expected = displacement + velocity / zero_per_s;
            assert!((z - z_expected).abs() < 1e-11 * largest, "{z} {z_expected}");
        }
    }
}

// Guards a real mode against its closed form: the answer to a ramp, B/λ²(e^{λt} − 1 − λt), at any λT.
#[test]
fn a_real_mode_follows_a_ramp() {
    for eigenvalue in [-1e-6, -1e-3, -0.5, -0.999, -1.001, -30.0, -2000.0] {
        let modes = Modes::new(&[real(eigenvalue, 2.0)]).unwrap();
        let ramp: Vec<f64> = (0..20).map(f64::from).collect();
        let outputs = SampledModes::new(&modes, 1.0).outputs(&ramp);
        for (k, z) in outputs.iter().enumerate() {
            let x = eigenvalue * (k + 1) as f64;
            let time = (k + 1) as f64;
            let expected = 2.0 * time * time * second_phi(x.into()).re;
            assert!(
                (z / expected - 1.0).abs() < 1e-12,
                "{eigenvalue}: {z}, {expected} after {}",
                k + 1
            );
        }
    }
    // The series and the closed form meet.
    for x in [Complex64::new(-1.0, 0.0), Complex64::new(-0.6, 0.8)] {
        let difference = second_phi(x * 0.999_999) - (exponential(x) - 1.0 - x) / (x * x);
        assert!(magnitude(difference) < 1e-6);
    }
}

/// A real mode or a pair, with the input's angle up to half as far again as a positive real pair may have.
fn any_part() -> impl Strategy<Value = Vec<Mode>> {
    let size = -2.0..2.0_f64;
    (size.clone(), size.clone(), size, -1.5..1.5_f64, any::<bool>()).prop_map(|(decay, angle, input, turn, pair)| {
        let [decay, angle, input] = [decay, angle, input].map(|exponent| libm::pow(10.0, exponent));
        if !pair {
            return vec![real(-decay, input)];
        }
        let one = Mode {
            eigenvalue_per_s: Complex64::new(-decay, angle),
            input: Complex64::new(input, input * turn * decay / angle),
        };
        let other = Mode {
            eigenvalue_per_s: one.eigenvalue_per_s.conj(),
            input: one.input.conj(),
        };
        vec![one, other]
    })
}

/// Systems of one to six modes, most of them positive real.
pub fn any_modes() -> impl Strategy<Value = Vec<Mode>> {
    prop::collection::vec(any_part(), 1..4).prop_map(|parts| parts.concat())
}

/// Re G(jω) of the continuous system.
fn real_part(modes: &[Mode], omega: f64) -> f64 {
    let one = |mode: &Mode| (mode.input / (Complex64::new(0.0, omega) - mode.eigenvalue_per_s)).re;
    modes.iter().map(one).sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    // Guards the sum over the aliases: what is positive real stays so at every tick, however long.
    #[test]
    fn every_tick_keeps_an_output_positive_real(all in any_modes(), tick in -4.0..1.0_f64) {
        let Ok(modes) = Modes::new(&all) else { return Ok(()) };
        let least = (-4000..4000)
            .map(|i| real_part(&all, libm::pow(10.0, f64::from(i) / 500.0)))
            .chain([real_part(&all, 0.0)])
            .fold(f64::INFINITY, f64::min);
        let tick_s = libm::pow(10.0, tick);
        let passivity = SampledModes::new(&modes, tick_s).passivity(&modes, tick_s);
        // At 1e8 rad/s the real part of a positive real system is some 1e-16; what is negative there is negative
        // before.
        if least > 0.0 {
            prop_assert!(matches!(passivity, Ok(eta) if eta > 0.0), "{least:e} {passivity:?}");
        }
    }
}

// Guards the formula of the file's head with numbers: 200 000 aliases of the rod, added up.
#[test]
fn the_sampled_transfer_function_is_the_sum_of_its_aliases() {
    let tick_s = 5e-5;
    let zero_per_s = 3000.0;
    let modes = Modes::of_rod(&rod(), zero_per_s).unwrap();
    let sampled = SampledModes::new(&modes, tick_s);
    for angle in [0.01, 0.3, 1.0, 2.0, 3.0, PI] {
        let alias = |m: i32| {
            let whole = angle + 2.0 * PI * f64::from(m);
            let sinc = libm::sin(0.5 * whole) / (0.5 * whole);
            let s = Complex64::new(0.0, whole / tick_s);
            let transfer = (s / zero_per_s + 1.0) * rod().stiffness_per_s2
                / (s * s + s * rod().damping_per_s + rod().stiffness_per_s2);
            transfer * sinc * sinc
        };
        let sum: Complex64 = (-100_000..=100_000).map(alias).sum();
        assert!(
            magnitude(sum - sampled.transfer(angle)) < 1e-9,
            "{sum} {}",
            sampled.transfer(angle)
        );
    }
}

// Guards the refusal and its sentence: a zero beyond the damping is not positive real, at no tick that resolves the
// rod.
#[test]
fn a_zero_beyond_the_damping_is_refused_with_its_frequency() {
    for tick_s in [1e-6, 5e-6, 5e-5] {
        let passivity = |zero_per_s| {
            let modes = Modes::of_rod(&rod(), zero_per_s).unwrap();
            SampledModes::new(&modes, tick_s).passivity(&modes, tick_s)
        };
        assert!(passivity(7800.0).is_ok_and(|eta| eta > 0.0));
        let refused = passivity(20_000.0).unwrap_err();
        let EstimatorError::NotPositiveReal {
            frequency_hz,
            real_part,
            ..
        } = refused
        else {
            panic!("{refused}")
        };
        assert!(frequency_hz > 1000.0 && real_part <= 0.0, "{refused}");
        println!("{tick_s} s: {refused}");
    }
    let negative = Modes::new(&[real(-5.0, -1.0)]).unwrap();
    let refused = SampledModes::new(&negative, 0.01)
        .passivity(&negative, 0.01)
        .unwrap_err();
    assert!(refused.to_string().starts_with("at 0.0 Hz"), "{refused}");
}

// Guards η: for one real mode 1/G = (s − λ)/B loses |λ|/B at rest and, sampled, nowhere less.
#[test]
fn one_mode_loses_what_it_decays() {
    for tick_s in [1e-4, 1e-2, 1.0] {
        let modes = Modes::new(&[real(-5.0, 2.0)]).unwrap();
        let eta = SampledModes::new(&modes, tick_s).passivity(&modes, tick_s).unwrap();
        assert!((eta / 2.5 - 1.0).abs() < 1e-9, "{eta} at {tick_s} s");
    }
}
