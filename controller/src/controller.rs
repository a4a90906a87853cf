//! M_k = λ⁻¹((p_ff(t_{k+2}) + u_pid + u_learned)/G): feedforward, PID and learner, added where the plant is linear.
//!
//! Transfer function: the rod's inverse from the reference; K(z) of `pid.rs` from the error; both behind the strain law.
//! Ports: in measured displacement at t_k (m) and what became of the demand before; out the magnetization (A/m) for t_{k+2},
//! with its parts, its rate (A/(m s)), the error (m) and the state of the integrator (m).

use crate::anti_windup::Applied;
use crate::effects::KnownEffects;
use crate::learner::{self, Learner, Turns};
use crate::pid::is_measured;
use crate::tuning::{Tuned, Tuning, change_over_s};
use crate::{ControllerSettings, Feedforward, LoopShape, Motion, Pid, StrainLaw, Trajectory};
use anhyst_ipc::{Change, Invalid, Tunable};
use anhyst_model::{Effect, Material, TwoPole};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the controller hears of one tick and of the one before, freed from its messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    pub displacement_m: f64,
    /// The guard is on its way to, or at, the safe field, or holds the field.
    pub open: bool,
    /// Field asked for minus field permitted, where the guard limited it.
    pub field_cut_a_per_m: Option<f64>,
    /// Field that the guard permitted in the tick before.
    pub field_a_per_m: f64,
    /// Magnetization that the inverse expected to reach, where the demand needed more field than its limit.
    pub reached_a_per_m: Option<f64>,
}

/// What one tick gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decision {
    pub magnetization_a_per_m: f64,
    pub magnetization_rate_a_per_m_s: f64,
    pub feedforward_a_per_m: f64,
    pub reference_m: f64,
    pub error_m: f64,
    pub integral_m: f64,
    pub integration_stopped: bool,
    pub starting: bool,
    pub learning: bool,
    pub taken_back: bool,
    pub changing: bool,
}

/// The largest magnetization of a run's feedforward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Signed magnetization of largest magnitude.
    pub magnetization_a_per_m: f64,
    /// When.
    pub time_s: f64,
}

/// Displacements are not told apart below this, m.
const ROUNDING_M: f64 = 1e-12;

/// Of what the rod can reach: no error below it is one that runs away.
const LEAST_SIZE: f64 = 0.01;

/// Ticks of a run that are checked one by one.
const DENSE_TICKS: u64 = 50_000;

/// The controller: what it was told, and the memories of PID and learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Controller {
    trajectory: Trajectory,
    /// `None`: the feedback works alone.
    feedforward: Option<Feedforward>,
    law: StrainLaw,
    pid: Option<Pid>,
    learner: Option<Learner>,
    effects: Option<KnownEffects>,
    tuning: Tuning,
    tick_s: f64,
    /// The demand before: p asked for and p after the strain law's ends.
    wanted_m: f64,
    clipped_m: f64,
    /// The last error that could be had.
    error_m: f64,
    /// Of even and of odd ticks: what was looked at two ticks ahead, and its time; it is what is now two ticks later.
    coming: [Option<(f64, Motion)>; 2],
}

impl Controller {
    /// `rod.gain` is per free strain. Tables of trajectories are looked for in `base_dir`.
    ///
    /// # Errors
    /// If a setting is refused, the loop would be unstable, or a table cannot be read.
    pub fn new(
        settings: &ControllerSettings,
        rod: TwoPole,
        material: &Material,
        tick_s: f64,
        base_dir: &Path,
    ) -> Result<Self, Invalid> {
        Self::with_effects(settings, rod, material, tick_s, base_dir, &[])
    }

    /// The same for an actuator that has these effects. Those that change nothing but numbers of material and rod must be in
    /// them already ([`anhyst_model::with_known_effects`]).
    ///
    /// # Errors
    /// As [`Controller::new`], and an effect that cannot be used.
    pub fn with_effects(
        settings: &ControllerSettings,
        rod: TwoPole,
        material: &Material,
        tick_s: f64,
        base_dir: &Path,
        effects: &[Effect],
    ) -> Result<Self, Invalid> {
        settings.validate_parts(tick_s)?;
        rod.validate()
            .map_err(|error| Invalid::new("", error.to_string()).within("rod"))?;
        material
            .validate()
            .map_err(|error| Invalid::new("", error.to_string()).within("material"))?;
        let trajectory = Trajectory::load(&settings.trajectory, settings.start_s, tick_s, base_dir)
            .map_err(|refusal| refusal.within("trajectory"))?;
        let known = KnownEffects::new(effects, &rod, material, tick_s)
            .map_err(|error| Invalid::new("", error.to_string()).within("effects"))?;
        let shape = LoopShape::new(&rod, settings.feedback.as_ref(), tick_s).with_effects(effects);
        shape.validate()?;
        let law = StrainLaw::new(&rod, material);
        let learner = match &settings.learning {
            None => None,
            Some(learning) => {
                let Some(reach_m) = trajectory.reach_m(tick_s) else {
                    let sentence = "this trajectory does not repeat, so there is nothing to learn from turn to turn";
                    return Err(Invalid::new("learning", sentence));
                };
                let turns_per_s = trajectory.turns_per_s(tick_s).unwrap_or_default();
                let fastest_per_s = learner::HIGHEST / tick_s;
                if turns_per_s > fastest_per_s {
                    let sentence = format!(
                        "this trajectory repeats {turns_per_s} times a second, and at a tick of {tick_s} s nothing above {fastest_per_s} Hz is learned"
                    );
                    return Err(Invalid::new("learning", sentence));
                }
                let own = Learner::new(learning, shape.clone(), tick_s, reach_m);
                Some(match &learning.from {
                    None => own,
                    Some(path) => own
                        .remembering(&base_dir.join(path))
                        .map_err(|refusal| refusal.within("learning"))?,
                })
            }
        };
        let ahead_s = known.as_ref().map_or(0.0, KnownEffects::ahead_s);
        let learning_gain = settings.learning.as_ref().map_or(0.0, |learning| learning.gain);
        Ok(Self {
            tuning: Tuning::new(settings.feedback.as_ref(), learning_gain, tick_s, ahead_s),
            trajectory,
            feedforward: settings
                .feedforward
                .then(|| Feedforward::new(&rod, tick_s, settings.hold_correction)),
            law,
            pid: settings.feedback.as_ref().map(|pid| Pid::new(pid, tick_s)),
            learner,
            effects: known,
            tick_s,
            wanted_m: 0.0,
            clipped_m: 0.0,
            error_m: 0.0,
            coming: [None; 2],
        })
    }

    /// Takes a change of one of its settings; false if it is none of them, or there is no room for more.
    pub fn change(&mut self, change: &Change) -> bool {
        let taken = match change.set {
            Tunable::Tolerance => false,
            Tunable::Kp | Tunable::KiPerS | Tunable::KdS => self.pid.is_some(),
            Tunable::Learning | Tunable::LearningGain => self.learner.is_some(),
            Tunable::Amplitude => true,
        };
        if !taken || !self.tuning.add(*change) {
            return false;
        }
        if change.set == Tunable::Amplitude {
            self.coming = [None; 2];
            let from_s = (change.tick as f64 + 2.0) * self.tick_s + self.ahead_s();
            self.trajectory
                .change_amplitude(from_s, change_over_s(self.tick_s), change.value);
        }
        true
    }

    /// By how much later than at t_{k+2} a command has its effect.
    fn ahead_s(&self) -> f64 {
        self.effects.as_ref().map_or(0.0, KnownEffects::ahead_s)
    }

    /// The trajectory, start included.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Largest magnetization of the trajectory, sampled along the run. Displacements beyond the strain law count
    /// as its ends.
    pub fn peak_magnetization(&self, duration_s: f64) -> Peak {
        self.ticks(duration_s).fold(
            Peak {
                magnetization_a_per_m: 0.0,
                time_s: 0.0,
            },
            |peak, time_s| {
                let magnetization_a_per_m = self.law.magnetization_a_per_m(self.needed_m(time_s));
                if magnetization_a_per_m.abs() > peak.magnetization_a_per_m.abs() {
                    Peak {
                        magnetization_a_per_m,
                        time_s,
                    }
                } else {
                    peak
                }
            },
        )
    }

    /// Ends of the quasi-static displacement that the trajectory asks for in a run, m.
    pub fn asks_m(&self, duration_s: f64) -> (f64, f64) {
        let needed = self.ticks(duration_s).map(|time_s| self.needed_m(time_s));
        needed.fold((0.0, 0.0), |(low, high): (f64, f64), own| (low.min(own), high.max(own)))
    }

    /// How far the reference goes from 0 in a run, and a hundredth of what the rod can reach, m; none where it stays at 0.
    pub fn size_m(&self, duration_s: f64) -> Option<f64> {
        let places = self
            .ticks(duration_s)
            .map(|time_s| self.trajectory.at(time_s).position_m.abs());
        let farthest_m = places.fold(0.0, f64::max);
        let (lowest_m, highest_m) = self.law.range_m();
        (farthest_m > 0.0).then_some(farthest_m + LEAST_SIZE * (highest_m - lowest_m))
    }

    /// What a loop that stands still where it is best misses in a run from here on, m: half of the way between the reference's ends. Of
    /// a reference that stands still itself, how far it is from 0; none where that is 0.
    pub fn stroke_m(&self, from_s: f64, duration_s: f64) -> Option<f64> {
        let places = self.ticks(duration_s).filter(|time_s| *time_s >= from_s);
        let ends = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high): (f64, f64), time_s| {
            let own_m = self.trajectory.at(time_s).position_m;
            (low.min(own_m), high.max(own_m))
        });
        let half_m = 0.5 * (ends.1 - ends.0);
        let stroke_m = if half_m > ROUNDING_M { half_m } else { ends.1.abs() };
        (stroke_m > 0.0).then_some(stroke_m)
    }

    /// Refuses a trajectory that asks for more than the saturated rod can give, or for what no magnetization gives.
    ///
    /// # Errors
    /// With the displacement farthest out of range, the range, and the time.
    pub fn validate_reach(&self, duration_s: f64) -> Result<(), Invalid> {
        let (lowest_m, highest_m) = self.law.range_m();
        let excess_m = |time_s: f64| {
            let needed_m = self.needed_m(time_s);
            (lowest_m - needed_m).max(needed_m - highest_m)
        };
        let worst = self
            .ticks(duration_s)
            .map(|time_s| (time_s, excess_m(time_s)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        // Rounding of a profile that touches an end is no excess.
        let Some((time_s, _)) = worst.filter(|(_, excess_m)| *excess_m > ROUNDING_M || excess_m.is_nan()) else {
            return Ok(());
        };
        let needed_m = self.needed_m(time_s);
        let remedy = if needed_m < lowest_m && lowest_m > -ROUNDING_M {
            ": this rod only lengthens, so give the trajectory a mean_m"
        } else {
            ""
        };
        let sentence = format!(
            "at {time_s:.4} s the rod needs a quasi-static displacement of {needed_m:.4e} m, but magnetizations up to saturation, {} A/m, \
             give only [{lowest_m:.4e}, {highest_m:.4e}] m{remedy}",
            self.law.saturation_a_per_m()
        );
        Err(Invalid::new("trajectory", sentence))
    }

    /// p of the trajectory: with feedforward the rod's inverse, without it what the feedback has to reach at least.
    fn needed_m(&self, time_s: f64) -> f64 {
        let motion = self.trajectory.at(time_s);
        let Some(forward) = self.feedforward else {
            return motion.position_m;
        };
        let own_m = self
            .effects
            .as_ref()
            .map_or(0.0, |effects| effects.own_forces_m(&motion));
        forward.displacement_m(&motion) + own_m
    }

    /// Times of the ticks: all of the first fifty thousand, and about as many spread over the rest of a longer run, so that
    /// checking an hour takes no longer than checking seconds.
    fn ticks(&self, duration_s: f64) -> impl Iterator<Item = f64> + '_ {
        let last = (duration_s / self.tick_s).ceil() as u64;
        let dense = last.min(DENSE_TICKS);
        // Odd, so that no period of an even number of ticks is met in the same few phases only.
        let stride = ((last - dense) / DENSE_TICKS) | 1;
        let spread = (dense + 1..=last).step_by(stride as usize);
        (0..=dense).chain(spread).map(|tick| tick as f64 * self.tick_s)
    }

    /// Advances to tick `tick`.
    pub(crate) fn decide(&mut self, tick: u64, observed: &Observation) -> Decision {
        let now_s = tick as f64 * self.tick_s;
        let then_s = (tick as f64 + 2.0) * self.tick_s + self.ahead_s();
        let tuned = self.tuned(tick);
        let then = self.trajectory.at(then_s);
        let coming = self.coming[(tick % 2) as usize].replace((then_s, then));
        let known = coming.filter(|(time_s, _)| *time_s == now_s);
        let now = known.map_or_else(|| self.trajectory.at(now_s), |(_, motion)| motion);
        let applied = self.applied(observed);
        let (mut forward_m, mut rate_m_per_s) = self.feedforward.map_or((0.0, 0.0), |forward| {
            (forward.displacement_m(&then), forward.rate_m_per_s(&then))
        });
        let mut expected_m = now.position_m;
        if let Some(effects) = &mut self.effects {
            expected_m = effects.expected_m(now.position_m);
            let warm_m = self.law.metres_per_strain() * effects.warm_strain(observed.field_a_per_m);
            if self.feedforward.is_some() {
                let before_a_per_m = self.law.magnetization_a_per_m(self.wanted_m);
                let (own_m, own_m_per_s) = effects.advance_own_forces(&then, before_a_per_m);
                forward_m += own_m - warm_m;
                rate_m_per_s += own_m_per_s;
            }
        }
        let feedback = self
            .pid
            .as_mut()
            .map(|pid| pid.step(expected_m, observed.displacement_m, applied));
        let measured = is_measured(observed.displacement_m);
        if measured {
            self.error_m = expected_m - observed.displacement_m;
        }
        let error_m = self.error_m;
        let weight = tuned.map_or(1.0, |tuned| tuned.learning);
        // What is heard while a setting moves is neither the loop of before nor the one to come.
        let changing = tuned.is_some_and(|tuned| tuned.changing);
        let adapt = measured && !applied.limited() && !changing && weight > 0.0;
        let starting = self.trajectory.starting(now_s) || feedback.is_some_and(|feedback| feedback.easing);
        let learned_m = weight * self.learned_m(now_s, then_s, starting, adapt.then_some(error_m));
        self.wanted_m = forward_m + feedback.map_or(0.0, |feedback| feedback.feedback_m) + learned_m;
        self.clipped_m = self.law.clipped_m(self.wanted_m);
        let feedforward_a_per_m = self.law.magnetization_a_per_m(forward_m);
        Decision {
            magnetization_a_per_m: self.law.magnetization_a_per_m(self.wanted_m),
            magnetization_rate_a_per_m_s: rate_m_per_s * self.law.slope_a_per_m2(feedforward_a_per_m),
            feedforward_a_per_m,
            reference_m: now.position_m,
            error_m,
            integral_m: feedback.map_or(0.0, |feedback| feedback.integral_m),
            integration_stopped: feedback.is_some_and(|feedback| feedback.integration_stopped),
            starting,
            learning: weight > 0.0 && self.learner.as_ref().is_some_and(Learner::is_learning),
            taken_back: self.learner.as_ref().is_some_and(Learner::is_back),
            changing,
        }
    }

    /// What the next run may begin with, as JSON.
    pub(crate) fn learned(&self) -> Option<String> {
        self.learner.as_ref().and_then(Learner::memory)
    }

    /// Gives PID and learner what is changed.
    fn tuned(&mut self, tick: u64) -> Option<Tuned> {
        let tuned = self.tuning.at(tick)?;
        if let Some(pid) = &mut self.pid {
            pid.set_gains(tuned.kp, tuned.ki_per_s, tuned.kd_s);
        }
        if let Some(learner) = &mut self.learner {
            learner.set_gain(tuned.learning_gain);
        }
        Some(tuned)
    }

    fn learned_m(&mut self, now_s: f64, then_s: f64, starting: bool, error_m: Option<f64>) -> f64 {
        let Some(learner) = self.learner.as_mut().filter(|_| !starting) else {
            return 0.0;
        };
        let turns = [now_s - self.tick_s, now_s, then_s].map(|time_s| self.trajectory.turns(time_s));
        let [Some(before), Some(now), Some(then)] = turns else {
            return 0.0;
        };
        let per_s = (now - before) / self.tick_s;
        learner.step(Turns { now, then, per_s }, error_m)
    }

    /// What became of the demand before: the guard knows a side, the inverse and the strain law know an amount.
    fn applied(&self, observed: &Observation) -> Applied {
        if observed.open {
            return Applied::Open;
        }
        if let Some(side) = observed.field_cut_a_per_m.filter(|cut| cut.is_finite() && *cut != 0.0) {
            return Applied::Cut {
                side: side * self.law.slope_a_per_m2(self.law.saturation_a_per_m()),
            };
        }
        let reached_m = observed
            .reached_a_per_m
            .filter(|reached| reached.is_finite())
            .map_or(self.clipped_m, |reached| self.law.displacement_m(reached));
        if reached_m == self.wanted_m {
            Applied::Fully
        } else {
            Applied::Short {
                excess_m: self.wanted_m - reached_m,
            }
        }
    }
}
