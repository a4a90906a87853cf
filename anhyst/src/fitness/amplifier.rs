//! Amplifier and coil as they stand in the rig: the checks of `verify-amplifier` that a rig can be asked for, on the field that the probe in the
//! coil says.

use super::{Step, open_loop};
use anhyst_conformance::amplifier::{Expectation, Gentle, Tolerances};
use anhyst_ipc::{Invalid, Measurement, SafeField};
use anhyst_scenario::Scenario;
use std::f64::consts::TAU;

/// Of what the rig needs: so little first, so much of it then.
pub const FIRST: f64 = 0.02;
pub const ALL: f64 = 1.1;
/// The guard speaks in a tick of the field two ticks later.
const TICKS_AHEAD: usize = 2;
/// As the guard's monitor of the coil.
const GAIN: f64 = 0.05;
/// These say that nothing may be put through it.
const FATAL: [&str; 6] = ["finite", "stuck", "sign", "unit", "gain", "reach"];

/// A program up to a part of what the scenario's profile needs.
pub struct Excitation {
    expected: Expectation,
    program: Gentle,
}

impl Excitation {
    /// # Errors
    /// A scenario that cannot be foreseen.
    pub fn new(of: &Scenario, share: f64) -> Result<Self, Invalid> {
        let foreseen = of.foresight()?;
        let limit = of.inverse.field_limit_a_per_m.unwrap_or(foreseen.field_limit_a_per_m);
        let limit = limit.min(foreseen.field_limit_a_per_m);
        let needed = foreseen.field_a_per_m.map_or(limit, f64::abs);
        let needed = if needed > 0.0 { needed.min(limit) } else { limit };
        let most = (share * needed).min(limit);
        let least = (-most).max(of.guard.field_ends_a_per_m()[0]);
        let coil = of.believed_coil();
        let mut amplifier = of.amplifier;
        amplifier.delay_ticks = coil.delay_ticks;
        amplifier.bandwidth_hz = (coil.lag_s > 0.0).then(|| 1.0 / (TAU * coil.lag_s));
        let expected = Expectation {
            tick_s: of.tick_s,
            amplifier,
            range_a_per_m: 0.5 * (most - least),
            centre_a_per_m: 0.5 * (most + least),
            safe_field_a_per_m: of.guard.safe_field_a_per_m,
            ramp_time_s: of.guard.ramp_time_s,
            silence_s: of.clock.receive_limit_s(),
            paced: false,
            tolerances: Tolerances {
                gain_tolerance: GAIN,
                bandwidth_tolerance: 0.2,
                overshoot_tolerance: 0.1,
                limit_tolerance: 0.01,
                offset_tolerance: 0.005,
                noise_tolerance: 0.001,
                delay_tolerance_ticks: 0,
                return_tolerance: 0.01,
                latency_limit_s: None,
            },
        };
        Ok(Self {
            program: Gentle::new(&expected),
            expected,
        })
    }

    /// The run: the program in the inverse's place.
    pub fn probe(&self, of: &Scenario) -> Scenario {
        let mut own = open_loop(of, (self.program.ticks() + TICKS_AHEAD) as f64 * of.tick_s);
        own.inverse.drive = None;
        own.inverse.drives = self.program.drives();
        own
    }

    /// What it shows; of the first, small one, only what forbids a larger one.
    ///
    /// # Errors
    /// Constants of the amplifier of which there is no model.
    pub fn judge(
        &self,
        scenario: &Scenario,
        (measured, asked): (&[Measurement], &[SafeField]),
        first: bool,
    ) -> Result<Step, anhyst_model::ModelError> {
        let commands: Vec<f64> = asked.iter().map(|own| own.field_a_per_m).collect();
        // What is in the coil at the end of a tick is measured in the next.
        let fields: Vec<f64> = measured.iter().skip(1).map(|own| own.coil_field_a_per_m).collect();
        let commands = &commands[..commands.len().min(fields.len())];
        let (mut found, pictures) = self.program.judge(&self.expected, commands, &fields, TICKS_AHEAD)?;
        for check in &mut found.checks {
            check.sentence = scenario.units().reworded(&check.sentence);
        }
        if first {
            found.checks.retain(|check| FATAL.contains(&check.name));
            return Ok(Step::new("amplifier, a little", found.checks, &FATAL));
        }
        let mut step = Step::new("amplifier", found.checks, &FATAL);
        for picture in pictures {
            step.section = step.section.figure(picture.figure, picture.caption);
        }
        Ok(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards a rig whose field may go further one way than the other: what the guard holds back is taken for a gain.
    #[test]
    fn nothing_is_asked_for_that_the_guard_holds_back() {
        let mut scenario = anhyst_scenario::load(std::path::Path::new("built-in/milling.ron"), &[]).unwrap();
        for lowest in [None, Some(-2e3), Some(0.0)] {
            scenario.guard.lowest_field_a_per_m = lowest;
            let [least, most] = scenario.guard.field_ends_a_per_m();
            for share in [FIRST, ALL] {
                let own = Excitation::new(&scenario, share).unwrap();
                let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
                for (signal, duration_s) in own.program.drives() {
                    for place in 0..1000 {
                        let field = signal.field_a_per_m(f64::from(place) * 1e-3 * duration_s);
                        ends = [ends[0].min(field), ends[1].max(field)];
                    }
                }
                assert!(ends[0] >= least && ends[1] <= most, "{lowest:?} {share}: {ends:?}");
                let all = own.expected.range_a_per_m;
                assert!((ends[1] - ends[0] - 2.0 * all).abs() < 1e-2 * all, "{ends:?} of {all}");
            }
        }
    }
}
