//! The checks of an amplifier with a rig behind it: no more than the rig needs, no steps but small ones, no nonsense, under the guard.
//!
//! What was commanded is what the guard let through, what came of it what the probe in the coil says; both are held against the model with the
//! scenario's constants, as `verify-amplifier` does. Nothing is said of limits beyond the need, of broken commands and of the end.

use super::expectation::Expectation;
use super::findings::Findings;
use super::judge::{Evidence, judge_gentle};
use super::pictures::{Picture, pictures};
use super::program::{FREQUENCIES, Part, Program, STEP_SHARE, STEPS, Segment, Sweep};
use super::transcript::{Answer, Transcript};
use anhyst_model::{DriveSignal, ModelError};

/// Ticks of a level.
const LEVEL_TICKS: usize = 400;
const NOISE_TICKS: usize = 1000;
/// A way from level to level takes so many settling times.
const WAY: usize = 4;

/// A stretch: what is sent, and which of its ticks are judged.
struct Stretch {
    part: Part,
    signal: DriveSignal,
    settling: usize,
    judged: usize,
}

/// A program for a rig.
pub struct Gentle {
    stretches: Vec<Stretch>,
    tick_s: f64,
}

fn line(from_a_per_m: f64, to_a_per_m: f64, ticks: usize, tick_s: f64) -> DriveSignal {
    DriveSignal::Ramp {
        from_a_per_m,
        to_a_per_m,
        duration_s: ticks as f64 * tick_s,
    }
}

impl Gentle {
    /// Levels, small steps and sines up to the expectation's range.
    pub fn new(expected: &Expectation) -> Self {
        let (settling, range, tick_s) = (expected.settling_ticks(), expected.range_a_per_m, expected.tick_s);
        let way = WAY * settling;
        let centre = expected.centre_a_per_m;
        let line = |from: f64, to: f64, ticks: usize, tick_s: f64| line(centre + from, centre + to, ticks, tick_s);
        let mut own = Self {
            stretches: Vec::new(),
            tick_s,
        };
        if centre != 0.0 {
            own.push(Part::Way, line(-centre, 0.0, way, tick_s), way, settling);
        }
        own.push(Part::Rest, line(0.0, 0.0, 1, tick_s), settling, LEVEL_TICKS);
        let levels = [
            (Part::Positive, 0.5),
            (Part::Negative, -0.5),
            (Part::Reach, 1.0),
            (Part::Reach, -1.0),
        ];
        let mut before = 0.0;
        for (part, share) in levels {
            let to = share * range;
            own.push(part, line(before, to, way, tick_s), way + settling, LEVEL_TICKS);
            before = to;
        }
        own.push(Part::Way, line(before, 0.0, way, tick_s), way, settling);
        let small = STEP_SHARE * range;
        for _ in 0..STEPS {
            own.push(Part::BeforeStep, line(0.0, 0.0, 1, tick_s), settling, 16);
            own.push(Part::Step, line(small, small, 1, tick_s), 0, settling);
        }
        own.push(Part::Noise, line(0.0, 0.0, 1, tick_s), settling, NOISE_TICKS);
        let sweep = Sweep::new(expected);
        for periods in &sweep.periods {
            let frequency_hz = *periods as f64 / (sweep.ticks as f64 * tick_s);
            let sine = DriveSignal::Sine {
                amplitude_a_per_m: sweep.amplitude_a_per_m,
                frequency_hz,
                offset_a_per_m: centre,
                rise_s: 0.0,
            };
            own.push(Part::Sine { periods: *periods }, sine, settling, sweep.ticks);
        }
        debug_assert!(own.stretches.len() >= FREQUENCIES / 2);
        own
    }

    fn push(&mut self, part: Part, signal: DriveSignal, settling: usize, judged: usize) {
        self.stretches.push(Stretch {
            part,
            signal,
            settling,
            judged,
        });
    }

    /// For an open-loop run: each signal and how long it lasts, s.
    pub fn drives(&self) -> Vec<(DriveSignal, f64)> {
        let of = |own: &Stretch| (own.signal, (own.settling + own.judged) as f64 * self.tick_s);
        self.stretches.iter().map(of).collect()
    }

    /// All of it.
    pub fn ticks(&self) -> usize {
        self.stretches.iter().map(|own| own.settling + own.judged).sum()
    }

    /// The program as it was run: the commands that went out, and where its stretches lie when they begin `ahead` ticks before their time.
    fn as_run(&self, commands: &[f64], ahead: usize) -> Program {
        let mut start = 0;
        let segments = self.stretches.iter().map(|own| {
            let judged = start + own.settling;
            let (from, end) = (start, judged + own.judged);
            start = end;
            let [from, judged, end] = [from, judged, end].map(|tick: usize| tick.saturating_sub(ahead));
            Segment {
                part: own.part,
                ticks: from..end,
                judged: judged..end,
            }
        });
        Program {
            segments: segments.collect(),
            commands: commands.to_vec(),
        }
    }

    /// What the guard let through, tick by tick, and the coil's field at the end of the next tick, A/m; commands were given `ahead` ticks before the
    /// signals' time.
    ///
    /// # Errors
    /// Constants of which there is no model.
    pub fn judge(
        &self,
        expected: &Expectation,
        commands: &[f64],
        fields: &[f64],
        ahead: usize,
    ) -> Result<(Findings, Vec<Picture>), ModelError> {
        let program = self.as_run(commands, ahead);
        let model = program.expected(expected)?;
        let mut transcript = Transcript::with_capacity(fields.len());
        transcript.answers.extend(fields.iter().map(|field| Answer {
            field_a_per_m: *field,
            status: 0,
        }));
        let evidence = Evidence {
            expected,
            program: &program,
            model: &model,
            transcript: &transcript,
            aftermath: None,
        };
        let (findings, curves) = judge_gentle(&evidence);
        Ok((findings, pictures(&evidence, &curves)))
    }
}
