//! Tail probabilities: the normal, χ² and F distributions, as far as decisions need them.
//!
//! χ² upper tail by the regularised incomplete gamma function Q(k/2, x/2): series below k/2 + 1, continued fraction above
//! (Abramowitz and Stegun 6.5.29, 6.5.31). Everything here is for decisions, not for stepping.

/// P(X > x) for χ² with `degrees` of freedom.
pub(crate) fn chi_square_tail(x: f64, degrees: usize) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let (shape, x) = (0.5 * degrees as f64, 0.5 * x);
    let prefactor = (shape * x.ln() - x - libm::lgamma(shape)).exp();
    if x < shape + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / shape, 1.0 / shape, shape);
        while term > 1e-15 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - prefactor * sum).max(0.0)
    } else {
        // Lentz's rule for the continued fraction.
        let mut b = x + 1.0 - shape;
        let mut c = 1e300;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..10_000 {
            let a = -f64::from(i) * (f64::from(i) - shape);
            b += 2.0;
            d = 1.0 / (a * d + b);
            c = b + a / c;
            let factor = c * d;
            h *= factor;
            if (factor - 1.0).abs() < 1e-13 {
                break;
            }
        }
        prefactor * h
    }
}

/// Root of the mean square; 0 of nothing.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

/// The value below which a share of the numbers lies; 0 of nothing.
pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    if sorted.is_empty() {
        return 0.0;
    }
    let place = share.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Sorted copy.
pub(crate) fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards every threshold: textbook values of χ².
    #[test]
    fn tails_of_chi_square() {
        for (x, degrees, tail) in [
            (3.841_459, 1, 0.05),
            (6.634_897, 1, 0.01),
            (23.209_251, 10, 0.01),
            (140.169_5, 100, 0.005),
            (15.136_71, 1, 1e-4),
        ] {
            assert!(
                (chi_square_tail(x, degrees) / tail - 1.0).abs() < 1e-4,
                "{x}, {degrees}"
            );
        }
    }
}
