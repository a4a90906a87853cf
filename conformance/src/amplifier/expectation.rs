//! What the process that is plugged in must do: the scenario's amplifier, and how exact the answers must be.

use anhyst_ipc::number_between;
use anhyst_model::AmplifierConstants;
use serde::Serialize;

/// What is expected. Fields are A/m, times s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expectation {
    /// Time between two ticks.
    pub tick_s: f64,
    /// Bandwidth, limits and delay; a part that is not stated is not judged, but the bandwidth: none stated means no lag.
    pub amplifier: AmplifierConstants,
    /// Scale of all commands: the amplifier's limit, else the guard's.
    pub range_a_per_m: f64,
    /// Middle of what is commanded, A/m: not 0 where the field may go further one way than the other.
    pub centre_a_per_m: f64,
    /// Where the field must go when nobody commands.
    pub safe_field_a_per_m: f64,
    /// How long the way to the safe field may take.
    pub ramp_time_s: f64,
    /// Silence after which the process must take nobody for alive.
    pub silence_s: f64,
    /// Commands come by the wall clock: how long answers take is the amplifier's then, and judged.
    pub paced: bool,
    /// How exact.
    pub tolerances: Tolerances,
}

/// How exact the answers must be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, clap::Args)]
pub struct Tolerances {
    /// Largest deviation of the gain from 1.
    #[arg(long, default_value_t = 0.02, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub gain_tolerance: f64,
    /// Largest deviation of the -3 dB frequency, as a share of what is expected.
    #[arg(long, default_value_t = 0.2, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub bandwidth_tolerance: f64,
    /// Largest overshoot of a small step, as a share of the step.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub overshoot_tolerance: f64,
    /// By how much field and slew may exceed their limits, as a share of the limit.
    #[arg(long, default_value_t = 0.01, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub limit_tolerance: f64,
    /// Largest mean field at a command of zero, as a share of the range.
    #[arg(long, default_value_t = 0.005, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub offset_tolerance: f64,
    /// Largest rms of the field at a constant command, as a share of the range.
    #[arg(long, default_value_t = 0.001, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub noise_tolerance: f64,
    /// By how many ticks the answer may be early or late.
    #[arg(long, default_value_t = 0, value_name = "TICKS")]
    pub delay_tolerance_ticks: u32,
    /// How near the safe field counts as there, and how near the command counts as back, as a share of the range.
    #[arg(long, default_value_t = 0.01, value_name = "SHARE", value_parser = number_between(0.0..=1.0, ""))]
    pub return_tolerance: f64,
    /// Longest median from command to answer, in seconds; 99 of 100 answers may take 20 times as long (default: one tick, and only a warning
    /// without --paced).
    #[arg(long, value_name = "S", value_parser = number_between(1e-6..=600.0, "s"))]
    pub latency_limit_s: Option<f64>,
}

/// 99 of 100 answers may take so many times the median's limit: rare waits are the machine's, not the amplifier's.
const RARE: f64 = 20.0;
/// After so many time constants a lag has settled, even one that is five times slower than stated.
const SETTLING_LAGS: f64 = 50.0;
/// Ticks that are waited at least until something counts as settled.
const MIN_SETTLING_TICKS: f64 = 64.0;

impl Expectation {
    /// Longest median from sending to the answer.
    pub fn latency_median_limit_s(&self) -> f64 {
        self.tolerances.latency_limit_s.unwrap_or(self.tick_s)
    }

    /// Whether it is judged how long half of all answers, and 99 of 100, take: else it is this machine's business.
    pub fn judges_latency(&self) -> bool {
        self.paced || self.tolerances.latency_limit_s.is_some()
    }

    /// Longest time from sending to the answer that 99 of 100 keep.
    pub fn latency_p99_limit_s(&self) -> f64 {
        RARE * self.latency_median_limit_s()
    }

    /// Longest time from sending to any answer: half the silence, so that waiting for an answer is never itself a silence.
    pub fn answer_limit_s(&self) -> f64 {
        0.5 * self.silence_s
    }

    /// Ticks until the largest change of a command has settled.
    pub fn settling_ticks(&self) -> usize {
        let slewing_s = self
            .amplifier
            .slew_limit_a_per_m_s
            .map_or(0.0, |slew| 6.0 * self.range_a_per_m / slew);
        let ticks = (SETTLING_LAGS * self.amplifier.lag_s() + slewing_s) / self.tick_s;
        (ticks + MIN_SETTLING_TICKS).ceil() as usize + self.amplifier.delay_ticks as usize
    }

    /// Ticks in which the field must be back after commands that were no numbers: time to notice, to go to the safe field, to
    /// trust again, and to come back.
    pub fn return_ticks(&self) -> usize {
        (3.0 * self.ramp_time_s / self.tick_s).ceil() as usize + self.settling_ticks()
    }

    /// A share of the range, A/m.
    pub fn share_a_per_m(&self, share: f64) -> f64 {
        share * self.range_a_per_m
    }
}
