//! Guards the rational kernels: against the textbook formulas evaluated another way, over the whole range.

use anhyst_model::Anhysteretic;

/// L(x) from the continued fraction x/(3 + x²/(5 + x²/(7 + …))): no exponential, no cancellation.
fn langevin_by_continued_fraction(x: f64) -> f64 {
    let s = x * x;
    let mut tail = 0.0;
    for level in (1..=200).rev() {
        tail = s / (2.0 * f64::from(level) + 1.0 + tail);
    }
    tail / x
}

/// 1/x² − 1/sinh²x, as the square's difference (1/x − 1/sinh x)(1/x + 1/sinh x).
fn langevin_derivative(x: f64) -> f64 {
    let sinh = x.sinh();
    (1.0 / x - 1.0 / sinh) * (1.0 / x + 1.0 / sinh)
}

fn arguments() -> impl Iterator<Item = f64> {
    (-120..=40).map(|power| 10.0_f64.powf(f64::from(power) / 20.0))
}

#[test]
fn langevin_matches_its_continued_fraction() {
    for x in arguments().chain([7.999, 8.001, 19.999, 20.001]) {
        let expected = langevin_by_continued_fraction(x);
        for x in [x, -x] {
            let error = (Anhysteretic::Langevin.value(x).abs() - expected).abs() / expected;
            assert!(error < 2e-15, "L({x}): relative error {error:.1e}");
        }
    }
}

#[test]
fn derivatives_match_closed_forms() {
    for x in arguments().filter(|&x| x > 1e-2) {
        let error = Anhysteretic::Langevin.derivative(x) - langevin_derivative(x);
        assert!(error.abs() < 4e-12, "L'({x}) off by {error:.1e}");
        let error = Anhysteretic::Ising.derivative(x) - 1.0 / (x.cosh() * x.cosh());
        assert!(error.abs() < 2e-15, "tanh'({x}) off by {error:.1e}");
    }
    assert!((Anhysteretic::Langevin.derivative(0.0) - 1.0 / 3.0).abs() < 1e-15);
    assert!((Anhysteretic::Ising.derivative(0.0) - 1.0).abs() < 2e-15);
}

#[test]
fn ising_is_tanh() {
    for x in arguments() {
        let error = (Anhysteretic::Ising.value(x) - x.tanh()).abs() / x.tanh();
        assert!(error < 2e-15, "tanh({x}): relative error {error:.1e}");
    }
}

#[test]
fn far_out_both_saturate_without_nan() {
    for curve in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        for x in [1e3, 1e10, 1e40, 1e300, f64::MAX, f64::INFINITY] {
            let (value, derivative) = curve.value_and_derivative(x);
            assert!((value - 1.0).abs() <= 1.1 / x.min(1e30), "{curve:?}({x}) = {value}");
            assert!((0.0..1e-5).contains(&derivative), "{curve:?}'({x}) = {derivative}");
            assert_eq!(curve.value(-x), -value);
        }
        assert!(curve.value(f64::NAN).is_nan());
        assert_eq!(curve.value(0.0), 0.0);
    }
}

#[test]
fn inverse_returns_the_argument() {
    for curve in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        for y in (1..1000)
            .map(|part| f64::from(part) / 1000.0)
            .chain([1e-9, 1e-3, 0.9999, 0.999999])
        {
            for y in [y, -y] {
                let error = curve.value(curve.inverse(y)) - y;
                assert!(error.abs() < 5e-16 + 4e-16 * y.abs(), "{curve:?} at {y}: {error:.1e}");
            }
        }
        assert_eq!(curve.inverse(1.0), f64::INFINITY);
        assert_eq!(curve.inverse(-1.5), f64::NEG_INFINITY);
        assert_eq!(curve.inverse(0.0), 0.0);
        assert!(curve.inverse(f64::NAN).is_nan());
    }
}
