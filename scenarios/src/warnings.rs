//! What is allowed and still likely to disappoint: said by `check` and `run`, refused by nobody.

use super::Scenario;

/// Of a rod's resonance: with n samples in a period a ringing is up to 1/cos(π/n) times as large between them as at them, 1.08 at 8.
const SAMPLES_PER_RESONANCE: f64 = 8.0;

impl Scenario {
    /// Samples in a period of the rod's resonance, of the faster rod where plant and belief differ; none where there is no such rod.
    pub fn samples_per_resonance(&self) -> Option<f64> {
        let believed = self.two_pole().ok();
        let rods = believed.iter().chain(&self.plant.two_pole);
        let fastest_hz = rods.map(|rod| rod.natural_frequency_hz()).reduce(f64::max)?;
        Some(1.0 / (fastest_hz * self.tick_s))
    }

    /// As sentences, each with what to do.
    pub fn warnings(&self) -> Vec<String> {
        let few = self
            .samples_per_resonance()
            .filter(|samples| *samples < SAMPLES_PER_RESONANCE);
        let of_rod = few.map(|samples| {
            let resonance_hz = 1.0 / (samples * self.tick_s);
            format!(
                "the tick of {} µs is long for the rod, {samples:.1} samples in a period of its resonance at {resonance_hz:.0} Hz: with fewer than \
                 {SAMPLES_PER_RESONANCE:.0} it rings between them by more than at them; a tick_s of at most {:.1e} s is short enough",
                1e6 * self.tick_s,
                1.0 / (SAMPLES_PER_RESONANCE * resonance_hz)
            )
        });
        of_rod.into_iter().collect()
    }
}
