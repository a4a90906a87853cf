//! u = Re Σ Cₙ·e^{jnθ(t_{k+2})}, n = 1…N: learning what repeats with the reference.
//!
//! θ is the reference's own angle (rad), so a spindle may change its speed; Cₙ (m, complex) is constant between updates. A cycle
//! is M whole turns, at least two and at least 30 ms. It begins with the way from the old Cₙ to the new (an eighth of it) and is heard
//! through a Hann window w, which leaves that and what it shakes out, and in which neither the other harmonics nor an end between two ticks are seen:
//! Eₙ = 2 Σ w·e_k·e^{−jnθ_k} / Σ w. How u comes to y, Tₙ with the loop closed, is identified from the learner's own steps (`way.rs`); a step is
//! ΔCₙ = g·T̄ₙ·eₙ/(|Tₙ|² + Pₙ), P the variance of Tₙ: what is not known is stepped with caution.
//!
//! Condition: the error at n falls if |1 − g·T/T̂| < 1, Re(T̂/T) > g/2; all of them together if the spectral radius of I − 𝐓·diag(g/T̂) is below 1, 𝐓 with what one
//! harmonic does to another. Assumptions: the loop without learner is stable; transients die within an eighth of a cycle; the plant is the
//! same for some cycles. Not proved: that identification and step together converge for every plant. So |Cₙ| is bounded, and where the error of a
//! cycle is above 1.3 times the largest without learner, the Cₙ of the best cycle come back, the next time none, and the step is halved.
//! Where after twelve cycles the error is still what it was before, and not the noise, nothing of it is to be learned: the Cₙ go, and it rests for 50 cycles, then 100, …
//! A cycle with a missing measurement, a limited demand or a change of speed (above 0.1 %) says nothing: all is held.
//! At another speed Cₙ stays, and Tₙ/model is read at the new frequency among those at the old ones; a speed within 1 % of an earlier one
//! brings back what was learnt at it, in an earlier run, too (`memory.rs`). A hum within 1/(cycle) of a harmonic is learned as if it were an error.
//!
//! Ports: in error e at t_k (m), turns at t_k and t_{k+2}; out u for t_{k+2} (m of quasi-static displacement). Source: higher harmonic control, with
//! local identification (Johnson, NASA TP-1996, 1982).

mod harmonic;
mod kept;
mod memory;
mod settings;
mod speeds;
mod way;

pub(crate) use kept::HIGHEST;
pub use settings::LearningSettings;

use crate::complex::Complex;
use crate::loop_shape::LoopShape;
use crate::trajectory::blend;
use harmonic::Harmonic;
use kept::{KEPT_SPEEDS, Kept};
use serde::{Deserialize, Serialize};
use std::f64::consts::{SQRT_2, TAU};

/// Two turns at least, so that the window tells neighbours apart, and this long, so that the loop's transients die in an eighth of it.
const MIN_CYCLE: (f64, f64) = (2.0, 0.03);
/// Part of a cycle in which the old amplitudes give way to the new.
const BLEND: f64 = 0.125;
/// A spindle whose speed changes by less than this part does not change it.
const SAME_SPEED: f64 = 1e-3;
/// Cycles that are heard before the first step.
const BEFORE: u32 = 2;
/// Hann's: Σ w²·n/(Σ w)².
const HANN: f64 = 1.5;
/// σ of Eₙ as it scatters is believed between these parts of what white noise alone would give.
const SCATTER: (f64, f64) = (0.3, 7.0);
/// Growth of the error at which what was learnt is taken back: this factor, and this many times the noise.
const GROWN: (f64, f64) = (1.3, 2.0);
/// The best cycle's error grows by this part a cycle, so that an old best does not rule for ever.
const AGED: f64 = 1.02;
/// Of the mean error of the last cycles: memory, and cycles until it is held against that without learner; it must be below this part of that,
/// or below this multiple of the noise.
const MEAN: f64 = 8.0;
const TRIED: u32 = 12;
const HELPS: (f64, f64) = (0.9, 3.0);
/// Cycles of the first rest, and of the longest.
const RESTS: (u32, u32) = (50, 800);
/// Least gain, and how it comes back.
const LEAST_GAIN: f64 = 0.1;
const RECOVERS: f64 = 1.1;
/// Largest step: this multiple of what the model's way would need.
const LONGEST_STEP: f64 = 2.5;

/// What is gathered over a cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Cycle {
    from_turns: f64,
    turns: f64,
    turns_per_s: f64,
    weights: f64,
    squares_m2: f64,
    ticks: u32,
    spoiled: bool,
}

/// The bank of harmonics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Learner {
    settings: LearningSettings,
    shape: LoopShape,
    tick_s: f64,
    limit_m: f64,
    harmonics: Vec<Harmonic>,
    /// Those in use: the others are too fast at this speed.
    used: usize,
    scratch: Vec<f64>,
    /// The speed that `harmonics` are for; 0: none yet.
    turns_per_s: f64,
    kept: Vec<Kept>,
    cycle: Option<Cycle>,
    heard: u32,
    /// Of the noise; of Eₙ; and largest error of a cycle without learner, all rms.
    noise_m: f64,
    scatter_m: f64,
    base_m: f64,
    best_m: f64,
    /// Of the last cycle, rms.
    error_m: f64,
    /// Cycles in succession whose error had grown.
    grown: u32,
    /// Mean error of the last cycles, rms, and how many were learned in.
    mean_m: f64,
    tried: u32,
    /// Cycles of rest to come, and of the next rest.
    resting: u32,
    rest: u32,
}

/// Where the reference is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turns {
    /// At the measurement.
    pub now: f64,
    /// At t_{k+2}.
    pub then: f64,
    /// At t_k.
    pub per_s: f64,
}

impl Learner {
    /// For a loop whose shape is known and a reference that moves by `reach_m` either way; settings are taken as validated.
    pub fn new(settings: &LearningSettings, shape: LoopShape, tick_s: f64, reach_m: f64) -> Self {
        let count = settings.harmonics as usize;
        let harmonics = vec![
            Harmonic {
                gain: settings.gain,
                ..Harmonic::default()
            };
            count
        ];
        Self {
            shape,
            tick_s,
            limit_m: settings.limit_m.unwrap_or(0.5 * reach_m),
            used: 0,
            scratch: vec![0.0; count],
            turns_per_s: 0.0,
            kept: vec![
                Kept {
                    turns_per_s: 0.0,
                    harmonics: harmonics.clone(),
                };
                KEPT_SPEEDS
            ],
            cycle: None,
            heard: 0,
            noise_m: 0.0,
            scatter_m: 0.0,
            base_m: 0.0,
            best_m: f64::MAX,
            error_m: f64::MAX,
            grown: 0,
            mean_m: 0.0,
            tried: 0,
            resting: 0,
            rest: RESTS.0,
            settings: settings.clone(),
            harmonics,
        }
    }

    /// What was learnt was taken back in this cycle or the one before.
    pub fn is_back(&self) -> bool {
        self.grown > 0 || self.resting > 0
    }

    /// Something is added to the demand.
    pub fn is_learning(&self) -> bool {
        self.heard >= BEFORE
    }

    /// Another gain from now on, at most.
    pub fn set_gain(&mut self, gain: f64) {
        if gain != self.settings.gain {
            self.settings.gain = gain;
            let kept = self.kept.iter_mut().flat_map(|kept| &mut kept.harmonics);
            kept.chain(&mut self.harmonics).for_each(|own| own.gain = gain);
        }
    }

    /// Advances by one tick. `error_m` is none where it says nothing: missing, or the demand was not applied.
    pub fn step(&mut self, turns: Turns, error_m: Option<f64>) -> f64 {
        let over = |cycle: &Cycle| turns.now >= cycle.from_turns + cycle.turns;
        match self.cycle {
            None => self.begin(turns.now.ceil(), turns.per_s),
            Some(cycle) if over(&cycle) => {
                self.end(&cycle, turns.per_s);
                // A cycle that was slept through is not begun.
                let next = cycle.from_turns + cycle.turns;
                self.begin(
                    if turns.now < next + 1.0 { next } else { turns.now.ceil() },
                    turns.per_s,
                );
            }
            Some(_) => {}
        }
        let is_learning = self.is_learning();
        let Some(cycle) = &mut self.cycle else { return 0.0 };
        let place = (turns.now - cycle.from_turns) / cycle.turns;
        if place >= 0.0 {
            cycle.spoiled |= error_m.is_none();
            let weight = 1.0 - libm::cos(TAU * place);
            let error_m = error_m.unwrap_or_default();
            cycle.weights += weight;
            cycle.squares_m2 += weight * error_m * error_m;
            cycle.ticks += 1;
            let unit = Complex::unit(-TAU * turns.now.fract());
            let mut turned = Complex::real(weight * error_m);
            for harmonic in &mut self.harmonics[..self.used] {
                turned = turned.times(unit);
                harmonic.sum_m = harmonic.sum_m.plus(turned);
            }
        }
        if !is_learning {
            return 0.0;
        }
        let share = blend((turns.then - cycle.from_turns) / cycle.turns, BLEND);
        let unit = Complex::unit(TAU * turns.then.fract());
        let mut turned = Complex::real(1.0);
        let mut sum_m = 0.0;
        for own in &self.harmonics {
            turned = turned.times(unit);
            let amplitude_m = own.before_m.plus(own.amplitude_m.minus(own.before_m).scaled(share));
            sum_m += amplitude_m.times(turned).re;
        }
        sum_m
    }

    fn begin(&mut self, from_turns: f64, turns_per_s: f64) {
        if self.turns_per_s == 0.0 {
            self.arrive(turns_per_s);
        }
        let (turns, seconds) = MIN_CYCLE;
        self.cycle = Some(Cycle {
            from_turns,
            turns: turns.max(libm::ceil(seconds * turns_per_s)),
            turns_per_s,
            ..Cycle::default()
        });
        self.harmonics.iter_mut().for_each(|own| own.sum_m = Complex::ZERO);
    }

    fn end(&mut self, cycle: &Cycle, turns_per_s: f64) {
        for own in &mut self.harmonics {
            own.before_m = own.amplitude_m;
        }
        let same = |one: f64, other: f64| (one / other - 1.0).abs() < SAME_SPEED;
        if cycle.spoiled || cycle.weights <= 0.0 || !same(turns_per_s, cycle.turns_per_s) {
            return;
        }
        let is_new = !same(turns_per_s, self.turns_per_s);
        let is_known = is_new && self.arrive(turns_per_s);
        let error_m = (cycle.squares_m2 / cycle.weights).sqrt();
        for own in &mut self.harmonics[..self.used] {
            own.sum_m = own.sum_m.scaled(2.0 / cycle.weights);
        }
        if !self.is_learning() {
            self.listen(cycle, error_m);
            if !self.is_learning() {
                return;
            }
        } else if is_new {
            self.base_m = self.base_m.max(error_m);
            let variance = self.scatter_m * self.scatter_m;
            for own in &mut self.harmonics[..self.used] {
                own.way.hear_anew(own.sum_m, variance);
                own.way.changed(own.amplitude_m.minus(own.before_m));
            }
            if is_known {
                return;
            }
        } else {
            let moved_m: f64 = self.harmonics[..self.used].iter().map(|own| own.way.moved_m()).sum();
            for own in &mut self.harmonics[..self.used] {
                own.way.hear(own.sum_m, moved_m, self.scatter_m);
            }
        }
        // By what no step of its own can have done, the load has grown.
        let squares = self.harmonics[..self.used].iter().map(|own| 0.5 * own.way.most_m2());
        let before_m = self.base_m;
        let sudden_m = error_m - self.error_m - squares.sum::<f64>().sqrt();
        self.base_m += if is_new { 0.0 } else { sudden_m.max(0.0) };
        self.error_m = error_m;
        if self.rests(error_m, before_m) {
            return;
        }
        if error_m > GROWN.0 * self.base_m + GROWN.1 * self.noise_m {
            self.take_back(error_m);
            return;
        }
        self.grown = 0;
        if error_m < self.best_m {
            self.best_m = error_m;
            for own in &mut self.harmonics {
                own.best_m = own.amplitude_m;
            }
        } else {
            self.best_m *= AGED;
        }
        for own in &mut self.harmonics[..self.used] {
            own.gain = (RECOVERS * own.gain).min(self.settings.gain);
            let wanted = own.amplitude_m.plus(own.way.step(own.gain, LONGEST_STEP));
            own.move_to(wanted, self.limit_m);
        }
    }

    /// True while nothing is to be learned. `before_m`: the base before this cycle; an error that has grown beyond it ends a rest.
    fn rests(&mut self, error_m: f64, before_m: f64) -> bool {
        let used = self.used;
        if self.resting > 0 {
            let has_grown = error_m > GROWN.0 * before_m + GROWN.1 * self.noise_m;
            self.resting = if has_grown { 0 } else { self.resting - 1 };
            let variance = self.scatter_m * self.scatter_m;
            for own in &mut self.harmonics[..used] {
                own.way.hear_anew(own.sum_m, variance);
            }
            (self.mean_m, self.tried, self.grown) = (error_m, 0, 0);
            return true;
        }
        self.tried += 1;
        let memory = MEAN.min(f64::from(self.tried));
        self.mean_m += (error_m - self.mean_m) / memory;
        let helps = self.mean_m < HELPS.0 * self.base_m || self.mean_m < HELPS.1 * self.noise_m;
        if self.tried < TRIED || helps {
            return false;
        }
        (self.resting, self.rest) = (self.rest, (2 * self.rest).min(RESTS.1));
        self.best_m = f64::MAX;
        for own in &mut self.harmonics[..used] {
            own.gain = LEAST_GAIN;
            own.move_to(Complex::ZERO, self.limit_m);
        }
        true
    }

    /// Before the first step: how the error scatters, and how large it is without learner.
    fn listen(&mut self, cycle: &Cycle, error_m: f64) {
        let used = self.used;
        let harmonics = &mut self.harmonics[..used];
        let periodic: f64 = harmonics.iter().map(|own| 0.5 * own.sum_m.square()).sum();
        self.noise_m = (error_m * error_m - periodic).max(0.0).sqrt();
        self.base_m = self.base_m.max(error_m);
        self.heard += 1;
        let scratch = &mut self.scratch[..used];
        for (own, change) in harmonics.iter_mut().zip(scratch.iter_mut()) {
            *change = own.sum_m.minus(own.heard_m).magnitude() / SQRT_2;
            own.heard_m = own.sum_m;
        }
        scratch.sort_unstable_by(f64::total_cmp);
        let middle = scratch.get(used / 2).copied().unwrap_or_default();
        let white_m = 2.0 * self.noise_m * (HANN / f64::from(cycle.ticks.max(1))).sqrt();
        self.scatter_m = middle
            .clamp(SCATTER.0 * white_m, SCATTER.1 * white_m)
            .max(f64::MIN_POSITIVE);
        for own in harmonics {
            own.way.hear_anew(own.heard_m, self.scatter_m * self.scatter_m);
        }
    }

    /// The best amplitudes again; none where those are no better; and with a shorter step.
    fn take_back(&mut self, error_m: f64) {
        self.grown += 1;
        if self.grown > 2 {
            // It grows without learner, too.
            self.base_m = self.base_m.max(error_m);
        }
        let best = self.grown == 1 && self.best_m < f64::MAX;
        for own in &mut self.harmonics[..self.used] {
            own.gain = (0.5 * own.gain).max(LEAST_GAIN);
            own.way.doubt();
            let wanted = if best { own.best_m } else { Complex::ZERO };
            own.move_to(wanted, self.limit_m);
        }
    }
}
