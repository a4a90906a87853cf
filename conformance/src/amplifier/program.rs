//! What is commanded, tick by tick: rest, constants, small steps, a stepped sine, more than the limits, commands that are no
//! numbers. The same program is run on the model with the scenario's constants: what it gives is what is expected.

use super::expectation::Expectation;
use anhyst_ipc::Invalid;
use anhyst_model::{Amplifier, AmplifierOutput, ModelError};
use core::f64::consts::PI;
use std::ops::Range;

/// What a stretch of the program is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Part {
    /// Zero: offset.
    Rest,
    /// Half the range: gain.
    Positive,
    /// Minus half the range: gain.
    Negative,
    /// Zero before a small step.
    BeforeStep,
    /// A small step: dead time, overshoot.
    Step,
    /// A constant command: noise.
    Noise,
    /// A sine of so many periods: bandwidth.
    Sine {
        /// Periods within the stretch.
        periods: usize,
    },
    /// Beyond the limit, either way.
    Limit,
    /// All that a rig needs, either way.
    Reach,
    /// On the way from one to the next.
    Way,
    /// From one end of the range to the other: slew.
    Slew,
    /// A command that no amplifier can follow.
    Nonsense,
    /// A constant command after it: is the amplifier back?
    Back,
    /// A constant field, before the commands end.
    Last,
}

/// A stretch of the program.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// What it is for.
    pub part: Part,
    /// Its ticks.
    pub ticks: Range<usize>,
    /// Those of them that are judged: what went before has died away.
    pub judged: Range<usize>,
}

/// All commands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Program {
    /// A/m, one a tick.
    pub commands: Vec<f64>,
    /// In their order, without gaps.
    pub segments: Vec<Segment>,
}

/// Small steps that are averaged.
pub const STEPS: usize = 8;
/// Height of a small step, share of the range.
pub const STEP_SHARE: f64 = 0.1;
/// Level before, between and after commands that are no numbers, share of the range.
pub const LEVEL_SHARE: f64 = 0.2;
/// How far beyond the limit is commanded.
const BEYOND: f64 = 1.5;
/// So long a command is no number, ticks.
const NONSENSE_TICKS: usize = 5;
const CONSTANT_TICKS: usize = 200;
const NOISE_TICKS: usize = 1000;
pub(super) const FREQUENCIES: usize = 16;
const MIN_SINE_TICKS: usize = 1000;
/// A program that takes longer is refused: 5 million ticks are four minutes at 20 kHz.
const MAX_TICKS: usize = 5_000_000;

impl Program {
    /// The program for an amplifier.
    ///
    /// # Errors
    /// If the bandwidth is so low that its sweep would take millions of ticks.
    pub fn new(expected: &Expectation) -> Result<Self, Invalid> {
        let settling = expected.settling_ticks();
        let range = expected.range_a_per_m;
        let sweep = Sweep::new(expected);
        let length = 40 * settling + FREQUENCIES * (sweep.ticks + settling) + 6 * expected.return_ticks();
        if length > MAX_TICKS {
            return Err(Invalid::new(
                "amplifier",
                format!(
                    "the test of an amplifier with these constants would take {length} ticks; at most {MAX_TICKS} are run"
                ),
            ));
        }
        let mut program = Program::default();
        program.push(Part::Rest, settling, CONSTANT_TICKS, |_| 0.0);
        program.push(Part::Positive, settling, CONSTANT_TICKS, |_| 0.5 * range);
        program.push(Part::Negative, settling, CONSTANT_TICKS, |_| -0.5 * range);
        for _ in 0..STEPS {
            program.push(Part::BeforeStep, settling, 16, |_| 0.0);
            program.push(Part::Step, 0, settling, |_| STEP_SHARE * range);
        }
        program.push(Part::Noise, settling, NOISE_TICKS, |_| 0.3 * range);
        for periods in &sweep.periods {
            let angle = 2.0 * PI * *periods as f64 / sweep.ticks as f64;
            program.push(Part::Sine { periods: *periods }, settling, sweep.ticks, |tick| {
                sweep.amplitude_a_per_m * (angle * tick as f64).sin()
            });
        }
        for side in [1.0, -1.0] {
            program.push(Part::Limit, settling, CONSTANT_TICKS, |_| side * BEYOND * range);
        }
        program.push(Part::Slew, 0, settling, |_| -0.9 * range);
        program.push(Part::Slew, 0, settling, |_| 0.9 * range);
        program.push_nonsense(expected);
        program.push(Part::Last, settling, CONSTANT_TICKS, |_| LEVEL_SHARE * range);
        Ok(program)
    }

    fn push_nonsense(&mut self, expected: &Expectation) {
        let level = LEVEL_SHARE * expected.range_a_per_m;
        // Without a limit the amplifier may follow any number: it is not asked to give more than ten times the range.
        let huge = match expected.amplifier.field_limit_a_per_m {
            Some(_) => 1e300,
            None => 10.0 * expected.range_a_per_m,
        };
        self.push(Part::Back, 0, expected.return_ticks(), |_| level);
        for command in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, huge] {
            self.push(Part::Nonsense, 0, NONSENSE_TICKS, |_| command);
            self.push(Part::Back, 0, expected.return_ticks(), |_| level);
        }
    }

    fn push(&mut self, part: Part, settling: usize, judged: usize, command: impl Fn(usize) -> f64) {
        let start = self.commands.len();
        self.commands.extend((0..settling + judged).map(command));
        let end = self.commands.len();
        self.segments.push(Segment {
            part,
            ticks: start..end,
            judged: start + settling..end,
        });
    }

    /// The stretches of a kind.
    pub fn of(&self, wanted: Part) -> impl Iterator<Item = &Segment> {
        self.segments.iter().filter(move |segment| segment.part == wanted)
    }

    /// What the model answers.
    ///
    /// # Errors
    /// Refused constants.
    pub fn expected(&self, expected: &Expectation) -> Result<Vec<AmplifierOutput>, ModelError> {
        let mut amplifier = Amplifier::new(expected.amplifier, expected.tick_s)?;
        Ok(self.commands.iter().map(|command| amplifier.step(*command)).collect())
    }
}

/// The stepped sine: whole periods within equally long stretches, so that sums over them separate the frequencies.
pub(super) struct Sweep {
    pub ticks: usize,
    pub periods: Vec<usize>,
    pub amplitude_a_per_m: f64,
}

impl Sweep {
    pub fn new(expected: &Expectation) -> Self {
        let rate_hz = 1.0 / expected.tick_s;
        // From a twentieth of the bandwidth to four times it, and never near half the rate, where samples say little.
        let highest_hz = 0.4 * rate_hz;
        let (low_hz, high_hz) = match expected.amplifier.bandwidth_hz {
            Some(bandwidth_hz) => (
                (bandwidth_hz / 20.0).min(rate_hz / 100.0),
                (4.0 * bandwidth_hz).min(highest_hz),
            ),
            None => (rate_hz / 200.0, highest_hz),
        };
        let ticks = MIN_SINE_TICKS.max((2.0 * rate_hz / low_hz).ceil() as usize);
        let ratio = high_hz / low_hz;
        let mut periods: Vec<usize> = (0..FREQUENCIES)
            .map(|index| {
                let share = index as f64 / (FREQUENCIES - 1) as f64;
                let frequency_hz = low_hz * ratio.powf(share);
                (frequency_hz * expected.tick_s * ticks as f64).round().max(1.0) as usize
            })
            .collect();
        periods.dedup();
        // Half of the slew limit at the highest frequency, so that the sweep sees the lag alone.
        let slew_amplitude = expected
            .amplifier
            .slew_limit_a_per_m_s
            .map_or(f64::INFINITY, |slew| 0.5 * slew / (2.0 * PI * high_hz));
        Sweep {
            ticks,
            periods,
            amplitude_a_per_m: slew_amplitude.min(STEP_SHARE * expected.range_a_per_m),
        }
    }
}
