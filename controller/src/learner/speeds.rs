//! From one speed to another: what was learnt at it, or as near as can be told from what was learnt at the one before.

use super::Learner;
use super::kept::HIGHEST;
use super::way::Way;
use crate::complex::Complex;
use crate::loop_shape::LoopShape;

impl Learner {
    /// Makes the harmonics those of a speed; true if it was there before and has its amplitudes again.
    pub(super) fn arrive(&mut self, turns_per_s: f64) -> bool {
        let frequency_hz = |index: usize| (index + 1) as f64 * turns_per_s;
        let (leaving, last) = (self.turns_per_s, self.used.max(1) - 1);
        let most = libm::floor(HIGHEST / (self.tick_s * turns_per_s)) as usize;
        self.used = self.harmonics.len().min(most);
        self.turns_per_s = turns_per_s;
        let model = |shape: &LoopShape, index: usize| shape.demand_to_displacement(frequency_hz(index));
        if leaving == 0.0 {
            for (index, own) in self.harmonics[..self.used].iter_mut().enumerate() {
                own.way = Way::believed(model(&self.shape, index));
            }
            self.recall(turns_per_s);
            return false;
        }
        let left = self.kept.iter().position(|kept| kept.is_near(leaving)).unwrap_or(0);
        self.kept[left].turns_per_s = leaving;
        self.kept[left].harmonics.copy_from_slice(&self.harmonics);
        // The one that was left longest ago stands first.
        self.kept[left..].rotate_left(1);
        let known = self.kept.iter().find(|kept| kept.is_near(turns_per_s));
        let old = self.kept.last().map_or(&[][..], |kept| &kept.harmonics);
        for (index, own) in self.harmonics[..self.used].iter_mut().enumerate() {
            if let Some(known) = known {
                let known = &known.harmonics[index];
                (own.way, own.amplitude_m, own.gain) = (known.way, known.amplitude_m, known.gain);
            } else {
                let place = (frequency_hz(index) / leaving - 1.0).clamp(0.0, last as f64);
                let (low, high) = (libm::floor(place) as usize, libm::ceil(place) as usize);
                own.way = Way::between(&old[low].way, &old[high].way, place.fract(), model(&self.shape, index));
            }
        }
        for own in &mut self.harmonics[self.used..] {
            own.amplitude_m = Complex::ZERO;
        }
        self.best_m = f64::MAX;
        self.grown = 0;
        known.is_some()
    }
}
