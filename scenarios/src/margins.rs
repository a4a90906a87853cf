//! Gains from margins: |1 + L| ≥ ½ at all frequencies, that is Ms ≤ 2, with the loop as it is believed now, or as it was measured.

use super::Scenario;
use anhyst_controller::{LoopShape, MeasuredResponse, PidSettings};
use anhyst_ipc::Invalid;

/// Of the loop: the least distance of L from −1, Ms = 2.
pub(crate) const LEAST_MODULUS_MARGIN: f64 = 0.5;
/// Halvings until the factor is known.
const HALVINGS: u32 = 20;

impl Scenario {
    /// The loop with these gains.
    pub(crate) fn loop_with(&self, gains: &PidSettings) -> Result<LoopShape, Invalid> {
        self.loop_shape_of(Some(gains))
    }

    /// The least |1 + L| with these gains; 0 where the loop is unstable.
    pub(crate) fn modulus_margin(&self, gains: &PidSettings) -> Result<f64, Invalid> {
        let shape = self.loop_with(gains)?;
        Ok(if shape.is_stable() { shape.modulus_margin() } else { 0.0 })
    }

    /// Makes the feedback's gains smaller by one factor, until Ms ≤ 2; none where that is so already, or nothing is fed back. Nothing measured: with
    /// what is believed.
    ///
    /// # Errors
    /// A loop that cannot be told.
    pub fn soften_feedback(&mut self, measured: &[MeasuredResponse]) -> Result<Option<f64>, Invalid> {
        let Some(stated) = self.controller.feedback.clone() else {
            return Ok(None);
        };
        let scaled = |factor: f64| PidSettings {
            kp: factor * stated.kp,
            ki_per_s: factor * stated.ki_per_s,
            kd_s: factor * stated.kd_s,
            ..stated.clone()
        };
        let has_margin = |gains: &PidSettings| -> Result<bool, Invalid> {
            let shape = self.loop_with(gains)?.with_measured(measured);
            Ok(shape.is_stable() && shape.modulus_margin() >= LEAST_MODULUS_MARGIN)
        };
        if has_margin(&stated)? {
            return Ok(None);
        }
        let (mut good, mut bad) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if has_margin(&scaled(middle))? {
                good = middle;
            } else {
                bad = middle;
            }
        }
        self.controller.feedback = Some(scaled(good));
        Ok(Some(good))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_model::{Effect, EffectKind};
    use std::path::Path;

    fn milling() -> Scenario {
        crate::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/milling.ron")), &[]).unwrap()
    }

    #[test]
    fn gains_are_made_smaller_only_where_they_must_be() {
        let mut good = milling();
        assert_eq!(good.soften_feedback(&[]), Ok(None));
        assert_eq!(good, milling());
        let mut late = milling();
        late.effects = vec![Effect::new(EffectKind::LoopDelay, &[5e-4]).unwrap()];
        let factor = late.soften_feedback(&[]).unwrap().unwrap();
        let gains = late.controller.feedback.clone().unwrap();
        assert!((gains.kp / 0.3 - factor).abs() < 1e-12 && (gains.ki_per_s / 2000.0 - factor).abs() < 1e-12);
        let margin = late.modulus_margin(&gains).unwrap();
        assert!(
            (LEAST_MODULUS_MARGIN..1.001 * LEAST_MODULUS_MARGIN).contains(&margin),
            "{margin}"
        );
        let mut hot = milling();
        hot.controller.feedback.as_mut().unwrap().kp = 3.0;
        assert!(hot.soften_feedback(&[]).unwrap().unwrap() < 0.5, "an unstable loop");
    }
}
