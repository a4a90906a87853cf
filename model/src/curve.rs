//! Kernels of the anhysteretic curves as fractions, so that a slope of the hysteresis needs one division.
//!
//! With x = He/a and s = x²:  curve(x) = x·P(s)/Q(s),  curve′(x) = B/Q².
//! Langevin: B = Q² − P(2Q + sP).  Ising (tanh): B = Q² − sP².
//! P and Q are near-minimax rationals with positive coefficients (relative error 2.2e-16 for |x| ≤ 8,
//! 3.9e-16 for |x| ≤ 20, tanh 5.6e-16 for |x| ≤ 20); beyond 20 the closed forms (|x| − 1)/s and 1/|x|
//! leave out 2e-18. No exponential is evaluated and nothing cancels near x = 0.
//! Source: the paper's (1) and (2); the coefficients come from a Remez fit of L(x)/x and tanh(x)/x.

use crate::kernel::{Curve, Fraction};
use crate::number::Number;
use crate::number::single::Single;

/// Beyond this |x| both curves equal ±1 to the last bit; the limit keeps products finite.
const MAX_ARGUMENT: f64 = 1e30;
/// |x| up to which the wide rationals hold, squared.
const WIDE_LIMIT_SQUARED: f64 = 400.0;

const LANGEVIN_4_NUMERATOR: [f64; 5] = [
    0.333333333333333,
    0.02525634325929519,
    0.0004913963723282908,
    2.966380028168031e-06,
    4.223309756550385e-09,
];
const LANGEVIN_4_DENOMINATOR: [f64; 6] = [
    1.0,
    0.1424356964445387,
    0.004620695864110649,
    4.7512537700242745e-05,
    1.4438629231644064e-07,
    6.17036844783086e-11,
];
const LANGEVIN_8_NUMERATOR: [f64; 7] = [
    0.33333333333333326,
    0.027366927413047314,
    0.0006515541611653891,
    6.103780377219734e-06,
    2.3867384210228735e-08,
    3.520475322957334e-11,
    1.316167876290533e-14,
];
const LANGEVIN_8_DENOMINATOR: [f64; 8] = [
    1.0,
    0.1487674489058077,
    0.0055232860613447015,
    7.68958156601107e-05,
    4.516325823462105e-07,
    1.0862565863088027e-09,
    8.621556216979732e-13,
    9.883684808076948e-17,
];
const LANGEVIN_20_NUMERATOR: [f64; 11] = [
    0.3333333333333332,
    0.029238014985418507,
    0.0008075734558670224,
    9.959900109848046e-06,
    6.295124834782384e-08,
    2.1596616381181834e-10,
    4.05847322155287e-13,
    4.0406620360540423e-16,
    1.9536408102564443e-19,
    3.817625696567929e-23,
    1.924900295585416e-27,
];
const LANGEVIN_20_DENOMINATOR: [f64; 12] = [
    1.0,
    0.1543807116229211,
    0.006365561459923372,
    0.00010897610481367622,
    9.237661380986995e-07,
    4.200157570468647e-09,
    1.0524444700787881e-11,
    1.4332561875755086e-14,
    1.0004156847971257e-17,
    3.1521426346638924e-21,
    3.400298203294582e-25,
    5.2893073993700585e-30,
];
const TANH_20_NUMERATOR: [f64; 12] = [
    0.9999999999999994,
    0.15493876494387537,
    0.006451272597304012,
    0.00011246103303273836,
    9.818869704358002e-07,
    4.6721717882418656e-09,
    1.253346302350238e-11,
    1.889351979864403e-14,
    1.5371178330117765e-17,
    6.161019481846633e-21,
    1.0100872390975406e-24,
    4.3185529709823343e-29,
];
const TANH_20_DENOMINATOR: [f64; 13] = [
    1.0,
    0.48827209827720675,
    0.03587530535637467,
    0.0009362036831164293,
    1.1379803107719227e-05,
    7.284689120140833e-08,
    2.598016639614174e-10,
    5.237990603430893e-13,
    5.845526155376343e-16,
    3.3908197630446703e-19,
    8.981477918329607e-23,
    8.227015973567086e-27,
    1.0967931603971808e-31,
];

/// By blocks of four (Estrin) and Horner's rule between them, half as long a chain of dependent operations as Horner's alone; in lanes by
/// that, which has two operations less.
#[inline(always)]
fn polynomial<N: Number, const TERMS: usize>(coefficients: &[f64; TERMS], s: N) -> N {
    if N::SIDE_BY_SIDE {
        let mut sum = N::splat(coefficients[TERMS - 1]);
        let mut index = TERMS - 1;
        while index > 0 {
            index -= 1;
            sum = sum * s + N::splat(coefficients[index]);
        }
        return sum;
    }
    let square = s * s;
    let fourth = square * square;
    let pair = |first: usize| {
        let constant = N::splat(coefficients[first]);
        if first + 1 < TERMS {
            (constant + N::splat(coefficients[first + 1]) * s).alone()
        } else {
            constant
        }
    };
    let block = |first: usize| {
        if first + 2 < TERMS {
            (pair(first) + pair(first + 2) * square).alone()
        } else {
            pair(first)
        }
    };
    let mut first = (TERMS - 1) / 4 * 4;
    let mut sum = block(first);
    while first > 0 {
        first -= 4;
        sum = (block(first) + sum * fourth).alone();
    }
    sum
}

#[inline(always)]
fn langevin<N: Number>(x: N, s: N, numerator: N, denominator: N) -> Fraction<N> {
    let derivative = denominator * denominator - numerator * (N::splat(2.0) * denominator + s * numerator).alone();
    Fraction {
        x,
        numerator,
        denominator,
        derivative,
    }
}

#[inline(always)]
fn tanh<N: Number>(x: N, s: N, numerator: N, denominator: N) -> Fraction<N> {
    // Near saturation tanh rounds to 1 + 1e-16; the slope must not turn negative for that.
    let derivative = (denominator * denominator - s * (numerator * numerator)).max(N::splat(0.0));
    Fraction {
        x,
        numerator,
        denominator,
        derivative,
    }
}

#[inline(always)]
fn within<N: Number>(x: N) -> N {
    // Selects, not min and max: not-a-number has to come out as it went in.
    let limit = N::splat(MAX_ARGUMENT);
    let below = x.where_greater(limit, limit, x);
    let mirrored = N::splat(0.0) - below;
    mirrored.where_greater(limit, N::splat(0.0) - limit, below)
}

/// Langevin for |x| ≤ 4.
pub(crate) struct LangevinToFour;
impl<N: Number> Curve<N> for LangevinToFour {
    #[inline(always)]
    fn fraction(x: N) -> Fraction<N> {
        let s = x * x;
        langevin(
            x,
            s,
            polynomial(&LANGEVIN_4_NUMERATOR, s),
            polynomial(&LANGEVIN_4_DENOMINATOR, s),
        )
    }
    #[inline(always)]
    fn inverse(y: N) -> N {
        inverse_langevin(y)
    }
}

/// Langevin for |x| ≤ 8.
pub(crate) struct LangevinToEight;
impl<N: Number> Curve<N> for LangevinToEight {
    #[inline(always)]
    fn fraction(x: N) -> Fraction<N> {
        let s = x * x;
        langevin(
            x,
            s,
            polynomial(&LANGEVIN_8_NUMERATOR, s),
            polynomial(&LANGEVIN_8_DENOMINATOR, s),
        )
    }
    #[inline(always)]
    fn inverse(y: N) -> N {
        inverse_langevin(y)
    }
}

/// Langevin for every x, without branches.
pub(crate) struct LangevinEverywhere;
impl<N: Number> Curve<N> for LangevinEverywhere {
    #[inline(always)]
    fn fraction(x: N) -> Fraction<N> {
        let x = within(x);
        let s = x * x;
        let limit = N::splat(WIDE_LIMIT_SQUARED);
        let inner = s.min(limit);
        let near = langevin(
            x,
            s,
            polynomial(&LANGEVIN_20_NUMERATOR, inner),
            polynomial(&LANGEVIN_20_DENOMINATOR, inner),
        );
        Fraction {
            x,
            numerator: s.where_greater(limit, x.abs() - N::splat(1.0), near.numerator),
            denominator: s.where_greater(limit, s, near.denominator),
            // L' = 1/s there, and B = L'·Q² = s.
            derivative: s.where_greater(limit, s, near.derivative),
        }
    }
    #[inline(always)]
    fn inverse(y: N) -> N {
        inverse_langevin(y)
    }
}

/// Langevin for every x, by a branch on the range: the form for a single model.
pub(crate) struct LangevinByRange;
impl<N: Single> Curve<N> for LangevinByRange {
    #[inline(always)]
    fn fraction(x: N) -> Fraction<N> {
        let square = x.value() * x.value();
        if square <= 16.0 {
            LangevinToFour::fraction(x)
        } else if square <= 64.0 {
            LangevinToEight::fraction(x)
        } else {
            LangevinEverywhere::fraction(x)
        }
    }
    #[inline(always)]
    fn inverse(y: N) -> N {
        inverse_langevin(y)
    }
}

/// Ising (tanh) for every x, without branches.
pub(crate) struct IsingEverywhere;
impl<N: Number> Curve<N> for IsingEverywhere {
    #[inline(always)]
    fn fraction(x: N) -> Fraction<N> {
        let x = within(x);
        let s = x * x;
        let limit = N::splat(WIDE_LIMIT_SQUARED);
        let inner = s.min(limit);
        let near = tanh(
            x,
            inner,
            polynomial(&TANH_20_NUMERATOR, inner),
            polynomial(&TANH_20_DENOMINATOR, inner),
        );
        Fraction {
            x,
            numerator: s.where_greater(limit, x.abs(), near.numerator),
            denominator: s.where_greater(limit, s, near.denominator),
            derivative: s.where_greater(limit, N::splat(0.0), near.derivative),
        }
    }
    #[inline(always)]
    fn inverse(y: N) -> N {
        inverse_tanh(y)
    }
}

/// The largest f64 below 1: keeps a fully saturated material invertible.
const MAX_VALUE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Kröger's rational start (relative error below 3e-3), then Newton on the kernel itself.
#[inline(always)]
fn inverse_langevin<N: Number>(y: N) -> N {
    let one = N::splat(1.0);
    let magnitude = y.abs().min(N::splat(MAX_VALUE));
    // From x = 20 on coth x is 1 to the last bit, and L = 1 − 1/x inverts by itself.
    let last = N::splat(0.95);
    let far = one / (one - magnitude);
    let near = magnitude.min(last);
    let square = near * near;
    let start = polynomial(&[3.0, -1.00651, -0.962251, 1.47353, -0.48953], square);
    let mut x = near * start / ((one - near) * (one + N::splat(1.01524) * near));
    let mut iteration = 0;
    while iteration < 3 {
        let fraction = LangevinEverywhere::fraction(x);
        let (p, q) = (fraction.numerator, fraction.denominator);
        x = x - (x * p - near * q) * q / fraction.derivative;
        iteration += 1;
    }
    let positive = magnitude.where_greater(last, far, x);
    y.where_greater(N::splat(0.0), positive, N::splat(0.0) - positive)
}

#[inline(always)]
fn inverse_tanh<N: Number>(y: N) -> N {
    y.min(N::splat(MAX_VALUE)).max(N::splat(-MAX_VALUE)).atanh()
}
