//! Line by line: gain and phase of the response, over whole periods, in which the lines do not see each other.

use super::instant::Instant;
use super::response::Response;
use anhyst_controller::Multisine;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What came of a multisine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultisineVerdict {
    /// Whole periods that were taken; 0: less than one, or lines that have none, and all was taken.
    pub periods: u64,
    /// In the order in which they are stated.
    pub lines: Vec<LineResponse>,
}

/// Response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LineResponse {
    /// Where.
    pub frequency_hz: f64,
    /// Displacement over reference; none where there was no motion.
    pub gain: Option<f64>,
    /// Its phase, degrees; negative: late.
    pub phase_deg: Option<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct MultisineJudge {
    lines_hz: Vec<f64>,
    from_s: Option<f64>,
    periods: u64,
    /// Until now, and until the last whole period.
    now: Vec<Response>,
    whole: Vec<Response>,
}

impl MultisineJudge {
    pub fn new(multisine: &Multisine) -> Self {
        let none = vec![Response::default(); multisine.lines_hz().len()];
        Self {
            lines_hz: multisine.lines_hz().to_vec(),
            from_s: None,
            periods: 0,
            now: none.clone(),
            whole: none,
        }
    }

    pub fn observe(&mut self, multisine: &Multisine, now: Instant) {
        let from_s = *self.from_s.get_or_insert(now.time_s);
        if let Some(period_s) = multisine.period_s() {
            // What begins with this instant is not part of what ended before it.
            let periods = ((now.time_s - from_s) / period_s + 1e-9) as u64;
            if periods > self.periods {
                self.periods = periods;
                self.whole.copy_from_slice(&self.now);
            }
        }
        for (sums, line_hz) in self.now.iter_mut().zip(&self.lines_hz) {
            sums.observe(TAU * line_hz * now.time_s, now.reference_m, now.displacement_m);
        }
    }

    pub fn verdict(&self) -> MultisineVerdict {
        let taken = if self.periods > 0 { &self.whole } else { &self.now };
        let lines = self.lines_hz.iter().zip(taken).map(|(line_hz, sums)| {
            let response = sums.gain_and_phase();
            LineResponse {
                frequency_hz: *line_hz,
                gain: response.map(|(gain, _)| gain),
                phase_deg: response.map(|(_, phase)| phase.to_degrees()),
            }
        });
        MultisineVerdict {
            periods: self.periods,
            lines: lines.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CourseJudge, CourseVerdict};
    use super::*;
    use anhyst_controller::{Lines, MultisineSettings, Trajectory, TrajectorySettings};
    use anhyst_scenario::Expect;

    /// Guards gain and phase: what comes 0.3 ms late and a tenth smaller is that at every line, 360°·f·0.3 ms, though the end is in the
    /// middle of a period and an offset is on it.
    #[test]
    fn a_delay_has_its_phase_at_every_line() {
        let tick_s = 5e-5;
        let settings = TrajectorySettings::Multisine(MultisineSettings {
            mean_m: 2e-6,
            amplitude_m: 1e-6,
            lines: Lines::Grid {
                from_hz: 20.0,
                to_hz: 400.0,
                step_hz: 20.0,
            },
        });
        let trajectory = Trajectory::load(&settings, 0.0, tick_s, std::path::Path::new(".")).unwrap();
        let mut judge = CourseJudge::new(&trajectory, &Expect::NONE, tick_s).unwrap();
        for tick in 700..8333 {
            let time_s = f64::from(tick) * tick_s;
            judge.observe(
                &trajectory,
                Instant {
                    time_s,
                    reference_m: trajectory.at(time_s).position_m,
                    displacement_m: 0.9 * trajectory.at(time_s - 3e-4).position_m + 1e-6,
                },
            );
        }
        let CourseVerdict::Multisine(own) = judge.verdict() else {
            panic!("no multisine")
        };
        assert_eq!((own.periods, own.lines.len()), (7, 20));
        for line in &own.lines {
            let phase_deg = -360.0 * line.frequency_hz * 3e-4;
            assert!((line.gain.unwrap() - 0.9).abs() < 1e-9, "{line:?}");
            assert!(
                (line.phase_deg.unwrap() - phase_deg).abs() < 1e-6,
                "{line:?}, not {phase_deg}"
            );
        }
    }
}
