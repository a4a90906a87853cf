//! r = a·sin θ + b·cos θ by least squares, and y alike: the response y/r at the frequency of θ is their quotient as phasors.

use serde::{Deserialize, Serialize};

/// Sums over instants of known angle.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Response {
    /// Σ sin², Σ sin·cos, Σ cos².
    squares: [f64; 3],
    /// Σ r·sin, Σ r·cos.
    reference: [f64; 2],
    /// Σ y·sin, Σ y·cos.
    displacement: [f64; 2],
}

impl Response {
    pub fn observe(&mut self, angle: f64, reference_m: f64, displacement_m: f64) {
        let (sine, cosine) = libm::sincos(angle);
        for (sum, own) in [
            (&mut self.squares[0], sine * sine),
            (&mut self.squares[1], sine * cosine),
            (&mut self.squares[2], cosine * cosine),
            (&mut self.reference[0], reference_m * sine),
            (&mut self.reference[1], reference_m * cosine),
            (&mut self.displacement[0], displacement_m * sine),
            (&mut self.displacement[1], displacement_m * cosine),
        ] {
            *sum += own;
        }
    }

    /// Gain, and phase in rad (negative: late); none where there was nothing to respond to.
    pub fn gain_and_phase(&self) -> Option<(f64, f64)> {
        let [ss, sc, cc] = self.squares;
        // Times the determinant, which the quotient does not need.
        let phasor = |[s, c]: [f64; 2]| (s * cc - c * sc, c * ss - s * sc);
        let ((ra, rb), (ya, yb)) = (phasor(self.reference), phasor(self.displacement));
        let power = ra * ra + rb * rb;
        let (real, imaginary) = ((ya * ra + yb * rb) / power, (yb * ra - ya * rb) / power);
        let gain = libm::hypot(real, imaginary);
        gain.is_finite().then(|| (gain, libm::atan2(imaginary, real)))
    }
}
