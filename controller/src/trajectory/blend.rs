//! S(s) = s⁵(126 − 420s + 540s² − 315s³ + 70s⁴): from 0 at s = 0 to 1 at s = 1, with S⁽¹⁾ to S⁽⁴⁾ zero at both ends.
//!
//! It is the integral of 630·q⁴ with q = s(1 − s), which gives its derivatives in closed form. Steepest at s = 1/2, S' = 630/256;
//! most curved at s = (1 ± 1/√7)/2, |S″| = 9.372.

use super::jet::Jet;

/// Largest S' and |S″|.
pub(super) const STEEPEST: f64 = 630.0 / 256.0;
pub(super) const MOST_CURVED: f64 = 9.372_023;

/// S and its derivatives with respect to s; constant outside [0, 1].
fn unit(s: f64) -> [f64; 5] {
    if s <= 0.0 {
        return [0.0; 5];
    }
    if s >= 1.0 {
        return [1.0, 0.0, 0.0, 0.0, 0.0];
    }
    let (q, slope) = (s * (1.0 - s), 1.0 - 2.0 * s);
    let s5 = s * s * s * s * s;
    [
        s5 * (126.0 + s * (-420.0 + s * (540.0 + s * (-315.0 + s * 70.0)))),
        630.0 * q * q * q * q,
        2520.0 * q * q * q * slope,
        2520.0 * q * q * (3.0 * slope * slope - 2.0 * q),
        15120.0 * q * slope * (slope * slope - 3.0 * q),
    ]
}

/// ∫ S from 0 to s: s⁶(21 − 60s + 67.5s² − 35s³ + 7s⁴), and s − 1/2 from 1 on.
pub(super) fn area(s: f64) -> f64 {
    if s <= 0.0 {
        0.0
    } else if s >= 1.0 {
        s - 0.5
    } else {
        let s3 = s * s * s;
        s3 * s3 * (21.0 + s * (-60.0 + s * (67.5 + s * (-35.0 + s * 7.0))))
    }
}

/// S alone; 1 where there is no length to blend over.
pub(crate) fn blend(time_s: f64, length_s: f64) -> f64 {
    if length_s > 0.0 {
        unit(time_s / length_s)[0]
    } else {
        1.0
    }
}

/// A blend from 0 to 1 over a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Blend {
    pub from_s: f64,
    /// Above 0.
    pub length_s: f64,
}

impl Blend {
    pub fn at(&self, time_s: f64) -> Jet {
        Jet::from_scaled(unit((time_s - self.from_s) / self.length_s), self.length_s)
    }

    /// Its integral: 0 before, time since its middle after; a corner of a straight line, rounded.
    pub fn integral_at(&self, time_s: f64) -> Jet {
        let Jet([value, first, second, third, _]) = self.at(time_s);
        let own = self.length_s * area((time_s - self.from_s) / self.length_s);
        Jet([own, value, first, second, third])
    }
}
