//! Over frequency, in thirds of an octave: the largest error, gain and phase of the response, and up to where the gain stays above −3 dB.

use super::instant::Instant;
use super::response::Response;
use crate::any_number;
use crate::any_number::exceeds;
use anhyst_controller::Sweep;
use anhyst_scenario::Expect;
use serde::{Deserialize, Serialize};

/// Bands to an octave.
const BANDS: f64 = 3.0;
/// −3 dB.
const HALF_POWER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What came of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepVerdict {
    /// From the lowest on, those that were seen.
    pub bands: Vec<Band>,
    /// Up to here the displacement follows with at least −3 dB of the reference; none where it does to the end.
    pub bandwidth_hz: Option<f64>,
    /// Highest frequency that was seen.
    pub highest_hz: f64,
}

/// A third of an octave.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Its middle.
    pub frequency_hz: f64,
    /// Largest error.
    #[serde(with = "any_number")]
    pub error_max_m: f64,
    /// Displacement over reference; none where there was no motion.
    pub gain: Option<f64>,
    /// Its phase, degrees; negative: late.
    pub phase_deg: Option<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct SweepJudge {
    bands: Vec<Seen>,
    highest_hz: f64,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Seen {
    instants: u64,
    /// Sum of the frequencies' logarithms.
    logarithms: f64,
    #[serde(with = "any_number")]
    error_max_m: f64,
    response: Response,
}

/// How many bands above the lowest frequency.
fn band(sweep: &Sweep, frequency_hz: f64) -> f64 {
    BANDS * (frequency_hz / sweep.from_hz.min(sweep.to_hz)).log2()
}

impl SweepJudge {
    pub fn new(sweep: &Sweep) -> Self {
        let bands = band(sweep, sweep.from_hz.max(sweep.to_hz)).ceil().max(1.0);
        Self {
            bands: vec![Seen::default(); bands as usize],
            highest_hz: 0.0,
        }
    }

    pub fn observe(&mut self, sweep: &Sweep, now: Instant) {
        let Some((angle, frequency_hz)) = sweep.angle_and_frequency_hz(now.time_s) else {
            return;
        };
        let place = (band(sweep, frequency_hz).max(0.0) as usize).min(self.bands.len() - 1);
        let band = &mut self.bands[place];
        let error_m = (now.reference_m - now.displacement_m).abs();
        if exceeds(error_m, band.error_max_m) {
            band.error_max_m = error_m;
        }
        band.instants += 1;
        band.logarithms += frequency_hz.ln();
        let [reference_m, displacement_m] = [now.reference_m, now.displacement_m].map(|own| own - sweep.mean_m);
        band.response.observe(angle, reference_m, displacement_m);
        self.highest_hz = self.highest_hz.max(frequency_hz);
    }

    pub fn verdict(&self) -> SweepVerdict {
        let seen = self.bands.iter().filter(|band| band.instants > 0);
        let bands: Vec<Band> = seen
            .map(|band| {
                let response = band.response.gain_and_phase();
                Band {
                    frequency_hz: (band.logarithms / band.instants as f64).exp(),
                    error_max_m: band.error_max_m,
                    gain: response.map(|(gain, _)| gain),
                    phase_deg: response.map(|(_, phase)| phase.to_degrees()),
                }
            })
            .collect();
        SweepVerdict {
            bandwidth_hz: bandwidth_hz(&bands),
            bands,
            highest_hz: self.highest_hz,
        }
    }
}

/// Where the gain falls below −3 dB first, between the middles of two bands along the logarithm.
fn bandwidth_hz(bands: &[Band]) -> Option<f64> {
    let gains: Vec<(f64, f64)> = bands
        .iter()
        .filter_map(|band| Some((band.frequency_hz, band.gain?)))
        .collect();
    let below = gains.iter().position(|(_, gain)| *gain < HALF_POWER)?;
    let (to_hz, to) = gains[below];
    let Some((from_hz, from)) = below.checked_sub(1).map(|before| gains[before]) else {
        return Some(to_hz);
    };
    let part = (from - HALF_POWER) / (from - to);
    Some(from_hz * (to_hz / from_hz).powf(part))
}

impl SweepVerdict {
    pub(super) fn refuse(&self, expect: &Expect, failures: &mut Vec<String>) {
        if self.bands.is_empty() {
            failures.push("nothing of the sweep came after the settling time".to_owned());
        }
        let Some(least) = expect.bandwidth_hz else { return };
        let reached_hz = self.bandwidth_hz.unwrap_or(self.highest_hz);
        if exceeds(least, reached_hz) {
            failures.push(match self.bandwidth_hz {
                Some(own) => format!("the tracking bandwidth (-3 dB) is {own:.1} Hz, less than {least} Hz"),
                None => format!("the sweep was seen up to {reached_hz:.1} Hz, less than the bandwidth of {least} Hz that is expected"),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CourseJudge, CourseVerdict};
    use super::*;
    use anhyst_controller::{Spacing, Trajectory, TrajectorySettings};
    use std::f64::consts::TAU;

    /// Guards gain, phase and bandwidth: a first-order lag of 200 Hz has 1/√(1 + (f/200)²), −atan(f/200), and −3 dB at 200 Hz. Its answer
    /// is integrated exactly for a straight reference in each tick.
    #[test]
    fn a_first_order_lag_has_its_bandwidth() {
        let tick_s = 2e-5;
        let sweep = Sweep {
            mean_m: 5e-6,
            amplitude_m: 10e-6,
            from_hz: 10.0,
            to_hz: 1000.0,
            over_s: 20.0,
            spacing: Spacing::Logarithmic,
            taper_s: Some(0.5),
        };
        let trajectory = Trajectory::load(
            &TrajectorySettings::Sweep(sweep),
            0.0,
            tick_s,
            std::path::Path::new("."),
        )
        .unwrap();
        let mut judge = CourseJudge::new(&trajectory, &Expect::NONE, tick_s).unwrap();
        let corner = TAU * 200.0;
        let decay = (-corner * tick_s).exp();
        let (mut displacement_m, mut before_m) = (5e-6, 5e-6);
        for tick in 0..1_000_000 {
            let time_s = f64::from(tick) * tick_s;
            let reference_m = trajectory.at(time_s).position_m;
            let lag_m = (reference_m - before_m) / (corner * tick_s);
            displacement_m = reference_m - lag_m + decay * (displacement_m - before_m + lag_m);
            before_m = reference_m;
            judge.observe(
                &trajectory,
                Instant {
                    time_s,
                    reference_m,
                    displacement_m,
                },
            );
        }
        let CourseVerdict::Sweep(own) = judge.verdict() else {
            panic!("no sweep")
        };
        assert!((19..=21).contains(&own.bands.len()), "{}", own.bands.len());
        for band in &own.bands[1..own.bands.len() - 2] {
            let ratio = band.frequency_hz / 200.0;
            let (gain, phase_deg) = ((1.0 + ratio * ratio).sqrt().recip(), -ratio.atan().to_degrees());
            assert!((band.gain.unwrap() - gain).abs() < 0.01, "{band:?}, not {gain}");
            assert!(
                (band.phase_deg.unwrap() - phase_deg).abs() < 1.0,
                "{band:?}, not {phase_deg}"
            );
        }
        let bandwidth_hz = own.bandwidth_hz.unwrap();
        assert!((bandwidth_hz / 200.0 - 1.0).abs() < 0.01, "{bandwidth_hz} Hz");
        let failures = |least: f64| {
            let expect = Expect {
                bandwidth_hz: Some(least),
                ..Expect::NONE
            };
            judge.verdict().failures(&expect, "m").len()
        };
        assert_eq!((failures(195.0), failures(205.0)), (0, 1));
    }
}
