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
        let (sine, cosine) = angle.sin_cos();
        let add = |sums: &mut [f64], values: &[f64]| sums.iter_mut().zip(values).for_each(|(sum, own)| *sum += own);
        add(&mut self.squares, &[sine * sine, sine * cosine, cosine * cosine]);
        add(&mut self.reference, &[reference_m * sine, reference_m * cosine]);
        add(
            &mut self.displacement,
            &[displacement_m * sine, displacement_m * cosine],
        );
    }

    /// Gain, and phase in rad (negative: late); none where there was nothing to respond to.
    pub fn gain_and_phase(&self) -> Option<(f64, f64)> {
        let [ss, sc, cc] = self.squares;
        // Times the determinant, which the quotient does not need.
        let phasor = |[s, c]: [f64; 2]| (s * cc - c * sc, c * ss - s * sc);
        let ((ra, rb), (ya, yb)) = (phasor(self.reference), phasor(self.displacement));
        let power = ra * ra + rb * rb;
        let (real, imaginary) = ((ya * ra + yb * rb) / power, (yb * ra - ya * rb) / power);
        let gain = real.hypot(imaginary);
        gain.is_finite().then(|| (gain, imaginary.atan2(real)))
    }
}
