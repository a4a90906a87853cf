//! F = K·Σⱼ sin²φⱼ·max(f + x(t) − s(t − T), 0),  s(t) = max(x(t), s(t − T) − f): the cut as it happens, with its face.
//!
//! F force against the rod (N), x displacement of the tip towards the workpiece (m), s face that a tooth leaves, relative to
//! the feed (m), T tooth period (s); K, f, φⱼ, assumptions and source: [`Milling`]'s file. The face of one tooth period is
//! a delay line, linear between ticks.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

use crate::{Contact, Milling};

/// A tooth period shorter than this many ticks would not be resolved.
const MIN_TOOTH_PERIOD_TICKS: f64 = 8.0;
/// Bounds the delay line: 65536 ticks are 3.3 s at 20 kHz.
const MAX_TOOTH_PERIOD_TICKS: f64 = 65536.0;

/// A cut in progress: the numbers and the face that the last teeth left.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CuttingProcess {
    milling: Milling,
    contact: Contact,
    tick_s: f64,
    /// T in ticks is `whole_ticks` + `part_of_tick`.
    whole_ticks: usize,
    part_of_tick: f64,
    /// s of the last ticks; `oldest` is overwritten next.
    face_m: Vec<f64>,
    oldest: usize,
}

impl CuttingProcess {
    /// Before the first contact. Allocates its delay line here and never again.
    ///
    /// # Errors
    /// Invalid numbers, or a tooth period that the ticks cannot resolve.
    pub fn new(milling: Milling, contact: Contact, tick_s: f64) -> Result<Self, Invalid> {
        milling.validate()?;
        contact.validate()?;
        let period_ticks = milling.tooth_period_s() / tick_s;
        if !(MIN_TOOTH_PERIOD_TICKS..=MAX_TOOTH_PERIOD_TICKS).contains(&period_ticks) {
            let sentence = format!(
                "{} 1/min with {} teeth make a tooth period of {period_ticks:.1} ticks, outside \
                 [{MIN_TOOTH_PERIOD_TICKS}, {MAX_TOOTH_PERIOD_TICKS}]: the pulses would not be resolved",
                milling.spindle_rpm, milling.teeth
            );
            return Err(Invalid::new("spindle_rpm", sentence));
        }
        let whole = period_ticks.floor();
        let whole_ticks = whole as usize;
        Ok(CuttingProcess {
            milling,
            contact,
            tick_s,
            whole_ticks,
            part_of_tick: period_ticks - whole,
            face_m: vec![0.0; whole_ticks + 1],
            oldest: 0,
        })
    }

    /// Heat into the rod at a time, W.
    pub fn heat_w(&self, time_s: f64) -> f64 {
        if self.contact.holds_at(time_s) {
            self.milling.heat_w
        } else {
            0.0
        }
    }

    /// Force against the rod (N) at the tick that comes next, with the tip at `displacement_m`.
    pub fn force_n(&self, time_s: f64, displacement_m: f64) -> f64 {
        if !self.contact.holds_at(time_s) {
            return 0.0;
        }
        let advance_m = self.milling.feed_per_tooth_m + displacement_m - self.face_before_m();
        self.milling.cutting_stiffness_n_per_m() * self.milling.engagement(time_s) * advance_m.max(0.0)
    }

    /// Notes the face left at that tick: where the tip went, or what it did not reach.
    pub fn leave_face(&mut self, time_s: f64, displacement_m: f64) {
        let left_m = if self.contact.holds_at(time_s) {
            displacement_m.max(self.face_before_m() - self.milling.feed_per_tooth_m)
        } else {
            0.0
        };
        let length = self.face_m.len();
        self.face_m[self.oldest % length] = left_m;
        self.oldest = (self.oldest + 1) % length;
    }

    /// s(t − T), linear between ticks, seen from the tick that comes next.
    fn face_before_m(&self) -> f64 {
        let length = self.face_m.len();
        // The oldest entry is whole_ticks + 1 ticks before the coming tick.
        let [earlier, later] = [0, 1].map(|after| self.face_m[(self.oldest + after) % length]);
        later + self.part_of_tick * (earlier - later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const TICK_S: f64 = 5e-5;

    /// Guards the delay line: on a ramp x = v·t the advance is exactly f + v·T, also for a fractional period.
    #[test]
    fn a_steady_advance_gives_the_steady_force() {
        // Four teeth in a full slot: Σ sin² is 1 at any angle.
        let milling = Milling {
            teeth: 4,
            spindle_rpm: 7130.0,
            ..Milling::heavy()
        };
        let mut cutting = CuttingProcess::new(milling, Contact::default(), TICK_S).unwrap();
        let velocity = 0.01;
        for k in 0..500 {
            let time_s = f64::from(k) * TICK_S;
            let force = cutting.force_n(time_s, velocity * time_s);
            if time_s > 2.0 * milling.tooth_period_s() {
                let advance_m = milling.feed_per_tooth_m + velocity * milling.tooth_period_s();
                let expected = milling.cutting_stiffness_n_per_m() * advance_m;
                assert!(
                    (force / expected - 1.0).abs() < 1e-9,
                    "tick {k}: {force} N, not {expected} N"
                );
            }
            cutting.leave_face(time_s, velocity * time_s);
        }
    }

    /// Guards the loss of contact: a tip that withdraws faster than the feed cuts nothing, and the next tooth meets what was left.
    #[test]
    fn a_tooth_that_misses_leaves_its_chip_to_the_next() {
        let milling = Milling {
            teeth: 4,
            spindle_rpm: 3000.0,
            ..Milling::heavy()
        };
        let mut cutting = CuttingProcess::new(milling, Contact::default(), TICK_S).unwrap();
        let period_ticks = 100;
        let feed = milling.feed_per_tooth_m;
        // One and a half feeds back: the first pass misses, the second cuts half a chip, the third a whole one.
        let expected = [0.0, 0.5, 1.0, 1.0];
        for k in 0..4 * period_ticks {
            let time_s = f64::from(k) * TICK_S;
            let force = cutting.force_n(time_s, -1.5 * feed);
            let chip = force / (milling.cutting_stiffness_n_per_m() * feed);
            assert!(
                (chip - expected[(k / period_ticks) as usize]).abs() < 1e-9,
                "tick {k}: {chip} of a chip"
            );
            cutting.leave_face(time_s, -1.5 * feed);
        }
    }

    /// Guards the pulses: two teeth in a slot are sin² at the tooth-passing frequency; outside the contact there is no force.
    #[test]
    fn pulses_at_the_tooth_passing_frequency_while_in_contact() {
        let milling = Milling::heavy();
        let contact = Contact {
            from_s: 0.01,
            to_s: Some(0.02),
        };
        let mut cutting = CuttingProcess::new(milling, contact, TICK_S).unwrap();
        let mut largest: f64 = 0.0;
        for k in 0..600 {
            let time_s = f64::from(k) * TICK_S;
            let force = cutting.force_n(time_s, 0.0);
            let sine = libm::sin(PI * time_s / milling.tooth_period_s());
            let expected = if contact.holds_at(time_s) {
                42.0 * sine * sine
            } else {
                0.0
            };
            assert!((force - expected).abs() < 1e-9, "tick {k}: {force} N, not {expected} N");
            largest = largest.max(force);
            cutting.leave_face(time_s, 0.0);
        }
        assert!((largest - 42.0).abs() < 1e-9);
    }

    /// Guards the figures that the presets give: the highest pulse while the tip swings ±40 µm at 50 Hz and ±12 µm at 150 Hz.
    #[test]
    fn the_swinging_tip_meets_the_pulses_of_the_presets() {
        for (milling, expected_n) in [(Milling::light(), 3.6), (Milling::heavy(), 64.0)] {
            let mut cutting = CuttingProcess::new(milling, Contact::default(), TICK_S).unwrap();
            let highest_n = (0..2000).fold(0.0_f64, |highest_n, k| {
                let time_s = f64::from(k) * TICK_S;
                let angle = 2.0 * PI * 50.0 * time_s;
                let tip_m = 40e-6 * libm::sin(angle) + 12e-6 * libm::sin(3.0 * angle);
                let force_n = cutting.force_n(time_s, tip_m);
                cutting.leave_face(time_s, tip_m);
                highest_n.max(force_n)
            });
            assert!(
                (highest_n / expected_n - 1.0).abs() < 0.02,
                "{highest_n} N, not {expected_n} N"
            );
        }
    }

    /// Guards the loading of scenarios: what is refused is named.
    #[test]
    fn refuses_what_cannot_be_cut() {
        let heavy = Milling::heavy();
        let wrong = [
            ("teeth", Milling { teeth: 0, ..heavy }),
            (
                "exit_angle_deg",
                Milling {
                    entry_angle_deg: 90.0,
                    exit_angle_deg: 30.0,
                    ..heavy
                },
            ),
            (
                "axial_depth_m",
                Milling {
                    axial_depth_m: 0.0,
                    ..heavy
                },
            ),
            (
                "heat_w",
                Milling {
                    heat_w: f64::NAN,
                    ..heavy
                },
            ),
            (
                "spindle_rpm",
                Milling {
                    spindle_rpm: 1e6,
                    ..heavy
                },
            ),
            (
                "spindle_rpm",
                Milling {
                    spindle_rpm: 1e-3,
                    ..heavy
                },
            ),
        ];
        for (path, milling) in wrong {
            let refused = CuttingProcess::new(milling, Contact::default(), TICK_S).unwrap_err();
            assert_eq!(refused.path, path, "{refused}");
        }
        assert_eq!(
            Contact {
                from_s: 2.0,
                to_s: Some(1.0)
            }
            .validate()
            .unwrap_err()
            .path,
            "to_s"
        );
    }
}
