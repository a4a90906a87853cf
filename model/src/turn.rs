//! sin 2πx and cos 2πx of a number of turns x (no unit), to 1.5e-16: what a course over time needs in every tick.
//!
//! 4x = q + r with q whole and |r| ≤ ½, both exact, however many turns were made; sin(πr/2) = r(π/2 + r²P(r²)) and
//! cos(πr/2) = 1 + r²Q(r²), P and Q the polynomials through Chebyshev's points of r² in [0, ¼]; q says which of them it is, and its sign.
//! An angle in radians would be rounded before it is reduced, and reducing it takes longer than everything here.

/// Adding it leaves no room behind the binary point.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// Turns beyond which a quarter is no longer seen in the last bits of that sum.
const MANY: f64 = 1e12;
const SINE: [f64; 6] = [
    -0.645_964_097_506_246_2,
    0.079_692_626_246_144_23,
    -0.004_681_754_134_254_207,
    0.000_160_441_166_614_094_23,
    -3.598_702_950_973_510_5e-6,
    5.642_225_369_163_528e-8,
];
const COSINE: [f64; 7] = [
    -1.233_700_550_136_169_7,
    0.253_669_507_901_047_8,
    -0.020_863_480_763_340_773,
    0.000_919_260_274_546_844_7,
    -2.520_203_902_802_917_8e-5,
    4.710_678_405_505_227e-7,
    -6.329_396_344_967_424e-9,
];
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;
/// What `QUARTER` lacks.
const QUARTER_REST: f64 = 6.123_233_995_736_766e-17;

/// r, its square and the two lowest bits of q.
#[inline(always)]
fn reduced(turns: f64) -> (f64, f64, u64) {
    let turns = if turns.abs() < MANY { turns } else { turns % 1.0 };
    let quarters = 4.0 * turns;
    let sum = quarters + WHOLE;
    let rest = quarters - (sum - WHOLE);
    (rest, rest * rest, sum.to_bits() & 3)
}

#[inline(always)]
fn own_sine(rest: f64, square: f64) -> f64 {
    let [a, b, c, d, e, f] = SINE;
    let fourth = square * square;
    let tail = (a + b * square) + fourth * ((c + d * square) + fourth * (e + f * square));
    rest * QUARTER + rest * (QUARTER_REST + square * tail)
}

#[inline(always)]
fn own_cosine(square: f64) -> f64 {
    let [a, b, c, d, e, f, g] = COSINE;
    let fourth = square * square;
    let tail = (b + c * square) + fourth * ((d + e * square) + fourth * (f + g * square));
    1.0 + (a * square + fourth * tail)
}

/// The value, negative where bit 1 of `quarter` is set.
#[inline(always)]
fn signed(value: f64, quarter: u64) -> f64 {
    f64::from_bits(value.to_bits() ^ ((quarter & 2) << 62))
}

/// sin 2πx and cos 2πx; neither is a number where x is not finite.
#[inline]
pub fn sine_and_cosine(turns: f64) -> (f64, f64) {
    let (rest, square, quarter) = reduced(turns);
    let (sine, cosine) = (own_sine(rest, square), own_cosine(square));
    let (sine, cosine) = if quarter & 1 == 0 {
        (sine, cosine)
    } else {
        (cosine, sine)
    };
    (signed(sine, quarter), signed(cosine, quarter + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const TAU_REST: f64 = 4.0 * QUARTER_REST;

    /// Against the library, which shares nothing with it, over all quarters; half of the bound is the library's own.
    #[test]
    fn they_are_those_of_the_library() {
        for step in -40_000..40_000 {
            // No power of two: the angle is rounded, and so are the points.
            let turns = f64::from(step) / 23_456.7;
            let (sine, cosine) = sine_and_cosine(turns);
            let rest = turns - libm::rint(turns);
            // The angle in two parts: rounding it to one would cost more than both functions.
            let angle = TAU * rest;
            let lacks = TAU.mul_add(rest, -angle) + TAU_REST * rest;
            let (own_sine, own_cosine) = libm::sincos(angle);
            let wanted = (own_sine + lacks * own_cosine, own_cosine - lacks * own_sine);
            assert!((sine - wanted.0).abs() < 2.5e-16, "{turns}: {sine} {wanted:?}");
            assert!((cosine - wanted.1).abs() < 2.5e-16, "{turns}: {cosine} {wanted:?}");
        }
    }

    /// Quarters are exact, however many turns were made before; what has no turn has no sine.
    #[test]
    fn quarters_are_exact() {
        for before in [0.0, 1.0, -3.0, 1e9, -1e11, 1e12, 1e14] {
            assert_eq!(sine_and_cosine(before), (0.0, 1.0));
            assert_eq!(sine_and_cosine(before + 0.25), (1.0, 0.0));
            assert_eq!(sine_and_cosine(before + 0.5), (0.0, -1.0));
            assert_eq!(sine_and_cosine(before - 0.25), (-1.0, 0.0));
        }
        for none in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (sine, cosine) = sine_and_cosine(none);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }
}
