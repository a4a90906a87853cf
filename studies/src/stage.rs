//! A piezo stage in a loop: what an inverse of another law than the stage's own is worth, and what it learns.
//!
//! The stage is a Preisach plane with creep behind an amplifier's lag and before a resonance, integrated ten times a tick; its sensor
//! is noisy. The controller believes in plays (Prandtl-Ishlinskii), whose weights are up to 40 % wrong, a resonance and a lag 2 % wrong,
//! and no creep. It integrates the error; the demand goes through the inverse, which stands still, or follows [`WeightEstimator`]; the learner
//! of the controller takes what repeats.

use anhyst_controller::{Learner, LearningSettings, LoopShape, PidSettings, Turns};
use anhyst_estimator::{WeightEstimator, WeightSettings};
use anhyst_model::{
    Density, HysteresisLaw, Law, LawModel, LawModelState, ModelError, Noise, PlaySum, Preisach, SlowLag, TwoPole,
};
use serde::Serialize;
use std::f64::consts::TAU;

const TICK_S: f64 = 5e-5;
const SUBSTEPS: u32 = 10;
/// What the controller believes of lag and resonance, over what is so.
const BELIEVED: f64 = 1.02;
const RESONANCE_HZ: f64 = 500.0;
const DAMPING_RATIO: f64 = 0.03;
const AMPLIFIER_S: f64 = 1e-4;
const NOISE_M: f64 = 1e-9;
const FULL_V: f64 = 100.0;
/// Of the feedback, 1/s: a third of what the resonance bears.
const INTEGRAL_PER_S: f64 = 60.0;
/// The motion swells from nothing in this time.
const SWELL_S: f64 = 1.0;
/// Judged over the end of the run.
const JUDGED_S: f64 = 2.0;
const PLAYS: usize = 12;
/// Of the stage's plane.
const ROWS: usize = 60;
/// What the plane adds from one end to the other.
const HYSTERESIS_M: f64 = 15e-6;

/// Reference of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// 40 µm at 10 Hz.
    Sine,
    /// The first four odd harmonics of a triangle, 40 µm at 5 Hz: lines of a raster with rounded turns.
    Raster,
}

impl Motion {
    pub const ALL: [Motion; 2] = [Motion::Sine, Motion::Raster];

    /// As tables say it.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Sine => "sine, 10 Hz",
            Motion::Raster => "raster, 5 lines a second",
        }
    }

    fn hertz(self) -> f64 {
        match self {
            Motion::Sine => 10.0,
            Motion::Raster => 5.0,
        }
    }

    /// Position, velocity and acceleration, m and s.
    fn at(self, time_s: f64) -> [f64; 3] {
        let hertz = self.hertz();
        let harmonics: &[(f64, f64)] = match self {
            Motion::Sine => &[(1.0, 1.0)],
            // 1/n², damped as Fejér does it.
            Motion::Raster => &[(1.0, 0.9), (3.0, -0.075), (5.0, 0.018), (7.0, -0.004)],
        };
        let swell = 1.0 - (-time_s / (0.2 * SWELL_S)).exp();
        let mut motion = [25e-6 * swell, 25e-6 * (1.0 - swell) / (0.2 * SWELL_S), 0.0];
        for (order, share) in harmonics {
            let (rate, size) = (TAU * hertz * order, 20e-6 * share * swell);
            motion[0] += size * (rate * time_s).sin();
            motion[1] += size * rate * (rate * time_s).cos();
            motion[2] -= size * rate * rate * (rate * time_s).sin();
        }
        motion
    }
}

/// What turns the demand into a voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Compensation {
    /// Feedback alone, on a line.
    Feedback,
    /// The reference through a line, and feedback.
    Line,
    /// The inverse with the weights that it began with, and feedback.
    Fixed,
    /// The inverse with the weights that the stage teaches, and feedback.
    Adaptive,
    /// The same, and what repeats is learned.
    Learning,
}

impl Compensation {
    pub const ALL: [Compensation; 5] = [
        Compensation::Feedback,
        Compensation::Line,
        Compensation::Fixed,
        Compensation::Adaptive,
        Compensation::Learning,
    ];

    /// As tables say it.
    pub fn name(self) -> &'static str {
        match self {
            Compensation::Feedback => "feedback alone",
            Compensation::Line => "line and feedback",
            Compensation::Fixed => "fixed inverse and feedback",
            Compensation::Adaptive => "adaptive inverse and feedback",
            Compensation::Learning => "adaptive inverse, feedback, learner",
        }
    }
}

/// How well a motion was followed.
#[derive(Clone, Debug, Serialize)]
pub struct StageRun {
    pub motion: Motion,
    pub compensation: Compensation,
    /// Over the last two seconds; of the true position.
    pub rms_m: f64,
    pub max_m: f64,
    /// rms over the motion's span.
    pub rms_of_stroke: f64,
    /// Of each tenth of a second, rms error, m.
    pub course_m: Vec<f64>,
}

/// The stage as it is.
struct Stage {
    law: LawModel,
    state: LawModelState,
    volts: f64,
    position_m: f64,
    velocity_m_per_s: f64,
    noise: Noise,
}

/// Switching thinned out exponentially with the distance of its two voltages, and 30 % denser at the upper end than in the middle:
/// plays would have it even.
fn plane() -> Preisach {
    let levels = Density::even_levels([0.0, 1.1 * FULL_V], ROWS);
    let middle = |level: usize| 0.5 * (levels[level] + levels[level + 1]) / FULL_V;
    let cells = (0..ROWS).flat_map(|row| (0..=row).map(move |column| (row, column)));
    let density = |(row, column): (usize, usize)| {
        let (up, down) = (middle(row), middle(column));
        ((down - up) / 0.3).exp() * (0.7 + 0.3 * (up + down))
    };
    let mut weights: Vec<f64> = cells.map(density).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight *= HYSTERESIS_M / sum);
    Preisach::from(Density::Cells { levels, weights })
}

impl Stage {
    fn new(seed: u64) -> Self {
        let law = LawModel {
            offset: 0.0,
            slope: 4e-7,
            laws: vec![Law::Preisach(plane())],
            creep: [0.2, 2.0, 20.0]
                .map(|time_constant_s| SlowLag {
                    time_constant_s,
                    weight: 4e-9,
                })
                .to_vec(),
        };
        let state = law.rest();
        let position_m = law.output(&state);
        Stage {
            state,
            law,
            volts: 0.0,
            position_m,
            velocity_m_per_s: 0.0,
            noise: Noise::new(seed, 0),
        }
    }

    /// One tick at a command; what the sensor then says.
    fn step(&mut self, command_v: f64) -> f64 {
        let step_s = TICK_S / f64::from(SUBSTEPS);
        let rate = TAU * RESONANCE_HZ;
        for _ in 0..SUBSTEPS {
            self.volts += step_s / AMPLIFIER_S * (command_v.clamp(0.0, 1.5 * FULL_V) - self.volts);
            self.law.pass(&mut self.state, step_s);
            self.law.advance(&mut self.state, self.volts);
            let pull_m = self.law.output(&self.state) - self.position_m;
            self.velocity_m_per_s +=
                step_s * (rate * rate * pull_m - 2.0 * DAMPING_RATIO * rate * self.velocity_m_per_s);
            self.position_m += step_s * self.velocity_m_per_s;
        }
        self.position_m + NOISE_M * self.noise.normal()
    }
}

/// Plays as a fit to a sine of the stage would give them, wrong by a draw.
fn believed(seed: u64) -> LawModel {
    let mut draws = Noise::new(seed, 1);
    let radii: Vec<f64> = (0..PLAYS)
        .map(|play| 0.5 * FULL_V * play as f64 / PLAYS as f64)
        .collect();
    let weights = radii.iter().map(|radius| {
        let sure = if *radius == 0.0 {
            3.6e-7
        } else {
            3e-8 * (-radius / 25.0).exp()
        };
        sure * (1.0 + 0.4 * (0.7 * draws.normal()).clamp(-1.0, 1.0))
    });
    LawModel {
        offset: 0.0,
        slope: 0.0,
        laws: vec![Law::Plays(PlaySum::prandtl_ishlinskii(
            radii.clone(),
            weights.collect(),
        ))],
        creep: Vec::new(),
    }
}

/// It knows the loop as the controller believes it.
fn learner() -> Learner {
    let rate = BELIEVED * TAU * RESONANCE_HZ;
    let mode = TwoPole {
        gain: 1.0,
        damping_per_s: 2.0 * DAMPING_RATIO * rate,
        stiffness_per_s2: rate * rate,
        force_gain_per_kg: 0.0,
    };
    let feedback = PidSettings {
        ki_per_s: INTEGRAL_PER_S,
        ..PidSettings::default()
    };
    let settings = LearningSettings {
        harmonics: 12,
        ..LearningSettings::default()
    };
    Learner::new(&settings, LoopShape::new(&mode, Some(&feedback), TICK_S), TICK_S, 20e-6)
}

/// The controller.
struct Follower {
    compensation: Compensation,
    law: LawModel,
    state: LawModelState,
    estimator: WeightEstimator,
    /// What the amplifier and the resonance make of the command, as believed: two lags and the mode.
    seen_v: [f64; 3],
    integral_m: f64,
    learner: Option<Learner>,
}

impl Follower {
    fn new(compensation: Compensation, seed: u64) -> Result<Self, ModelError> {
        let law = believed(seed);
        let memory = WeightSettings {
            memory_samples: 3.0 / TICK_S,
            ..WeightSettings::default()
        };
        Ok(Follower {
            compensation,
            state: law.rest(),
            estimator: WeightEstimator::new(law.clone(), &memory, 0.5 * FULL_V)?,
            law,
            seen_v: [0.0; 3],
            integral_m: 0.0,
            learner: (compensation == Compensation::Learning).then(learner),
        })
    }

    fn step(&mut self, tick: u64, motion: Motion, measured_m: f64) -> f64 {
        let time_s = tick as f64 * TICK_S;
        let [position, velocity, acceleration] = motion.at(time_s);
        self.integral_m += TICK_S * INTEGRAL_PER_S * (motion.at(time_s)[0] - measured_m);
        // What has to be demanded so that lag and mode let the reference through.
        let (lag, rate) = (BELIEVED * AMPLIFIER_S + 0.5 * TICK_S, BELIEVED * TAU * RESONANCE_HZ);
        let slow = 2.0 * DAMPING_RATIO / rate;
        let ahead_m = position + (lag + slow) * velocity + (1.0 / (rate * rate) + slow * lag) * acceleration;
        let line_v_per_m = FULL_V / 55e-6;
        let hertz = motion.hertz();
        let turns = Turns {
            now: hertz * (time_s - TICK_S),
            then: hertz * (time_s + TICK_S),
            per_s: hertz,
        };
        let error_m = (time_s > SWELL_S).then(|| motion.at(time_s)[0] - measured_m);
        let learned_m = self
            .learner
            .as_mut()
            .map_or(0.0, |learner| learner.step(turns, error_m));
        let ahead_m = ahead_m + learned_m;
        let volts = match self.compensation {
            Compensation::Feedback => self.integral_m * line_v_per_m,
            Compensation::Line => (ahead_m + self.integral_m) * line_v_per_m,
            _ => {
                self.law
                    .advance_to_output(&mut self.state, ahead_m + self.integral_m, 1.5 * FULL_V);
                LawModel::input(&self.state)
            }
        };
        if matches!(self.compensation, Compensation::Adaptive | Compensation::Learning) {
            self.learn(tick, measured_m, volts);
        }
        volts
    }

    /// The measurement belongs to what was commanded before.
    fn learn(&mut self, tick: u64, measured_m: f64, volts: f64) {
        let rate = BELIEVED * TAU * RESONANCE_HZ;
        self.estimator.step(TICK_S, self.seen_v[1], measured_m);
        let step_s = TICK_S / f64::from(SUBSTEPS);
        for _ in 0..SUBSTEPS {
            self.seen_v[0] += step_s / (BELIEVED * AMPLIFIER_S) * (volts - self.seen_v[0]);
            self.seen_v[2] += step_s
                * (rate * rate * (self.seen_v[0] - self.seen_v[1]) - 2.0 * DAMPING_RATIO * rate * self.seen_v[2]);
            self.seen_v[1] += step_s * self.seen_v[2];
        }
        // New weights move the demand: what the integral holds must not jump with them.
        if tick % 1000 == 999 {
            let before = self.law.output(&self.state);
            self.law.set_weights(self.estimator.weights());
            self.integral_m += self.law.output(&self.state) - before;
        }
    }
}

/// Follows one motion for `seconds`.
///
/// # Errors
/// A law that is none; ours are.
pub fn follow(motion: Motion, compensation: Compensation, seconds: f64, seed: u64) -> Result<StageRun, ModelError> {
    let mut stage = Stage::new(seed);
    let mut follower = Follower::new(compensation, seed)?;
    let ticks = (seconds / TICK_S) as u64;
    let judged_from = ticks.saturating_sub((JUDGED_S / TICK_S) as u64);
    let per_tenth = (0.1 / TICK_S) as u64;
    let (mut squares, mut tenth, mut max_m): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut course_m = Vec::new();
    let mut measured_m = stage.position_m;
    let zero_m = stage.position_m;
    for tick in 0..ticks {
        let command_v = follower.step(tick, motion, measured_m - zero_m);
        measured_m = stage.step(command_v);
        let wanted_m = motion.at((tick + 1) as f64 * TICK_S)[0];
        let error_m = stage.position_m - zero_m - wanted_m;
        tenth += error_m * error_m;
        if (tick + 1) % per_tenth == 0 {
            course_m.push((tenth / per_tenth as f64).sqrt());
            tenth = 0.0;
        }
        if tick >= judged_from {
            squares += error_m * error_m;
            max_m = max_m.max(error_m.abs());
            (low, high) = (low.min(wanted_m), high.max(wanted_m));
        }
    }
    let rms_m = (squares / (ticks - judged_from) as f64).sqrt();
    Ok(StageRun {
        motion,
        compensation,
        rms_m,
        max_m,
        rms_of_stroke: rms_m / (high - low),
        course_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what a learned inverse of the wrong law reaches on a stage of another, beside one that stands still.
    #[test]
    fn the_stage_teaches_its_inverse() {
        for motion in Motion::ALL {
            let of = |compensation| follow(motion, compensation, 15.0, 1).unwrap().rms_of_stroke;
            let (line, fixed, learned) = (
                of(Compensation::Line),
                of(Compensation::Fixed),
                of(Compensation::Learning),
            );
            assert!(learned < 5e-4, "{learned}");
            assert!(learned < 0.25 * fixed && fixed < 0.5 * line, "{line} {fixed}");
        }
    }
}
