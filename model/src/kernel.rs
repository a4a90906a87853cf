//! What a kernel of an anhysteretic curve gives, and for which numbers.

use crate::number::Number;
use crate::number::dual::Dual;

/// One curve at one x: the argument as used, numerator, denominator, and B (see the file's head).
#[derive(Clone, Copy)]
pub(crate) struct Fraction<N> {
    pub x: N,
    pub numerator: N,
    pub denominator: N,
    pub derivative: N,
}

/// A rational kernel of an anhysteretic curve.
pub(crate) trait Curve<N: Number> {
    fn fraction(x: N) -> Fraction<N>;
    /// The x with curve(x) = y; |y| is held just below 1, so that the answer stays finite.
    fn inverse(y: N) -> N;
}

/// A kernel for one number, with or without derivatives.
pub(crate) trait Kernel: Curve<f64> + Curve<Dual<1>> {}
impl<C: Curve<f64> + Curve<Dual<1>>> Kernel for C {}
