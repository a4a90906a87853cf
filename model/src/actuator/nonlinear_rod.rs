//! ü + k̂ u̇ + ĉ u = A + B + N,  N = −(s(M) − 1)(ĉ u − A) − ĉ β u³ − ĉ d n: the rod with forces of its own.
//!
//! u displacement (m), A = w λ/λ′ and B = f F accelerations (m/s²) of strain and force, n what friction bears, N what delta_e, stiffening and friction add.
//! The linear part is propagated exactly; N is taken as a straight line within a substep, its end value solved for by
//! Newton inside a bracket. Where friction is stiff, z = −h ∂N/∂u̇ − h² ∂N/∂u large over the substep h, the line is bent so that its mean
//! leans to the end, by 1/2 + z²/2/(z₀² + z²) instead of 1/2: what sticks must not ring. So the rule is implicit, of second order,
//! L-stable in the friction, and with N ≡ 0 the linear rod. A substep turns the resonance by at most half a radian. Source: exponential integrators with an implicit corrector.

use serde::{Deserialize, Serialize};

use super::rod::Load;
use crate::effects::delta_e::DeltaE;
use crate::effects::friction::Friction;
use crate::effects::stiffening::Stiffening;
use crate::{ActuatorModel, EffectKind, ModelError, RodState, TwoPole, TwoPolePropagator};

/// Turn of the resonance in one substep, rad.
const MAX_TURN: f64 = 0.5;
/// z₀: much below, a straight line rings less than it decays.
const STIFF: f64 = 40.0;
/// More substeps than this are not taken: the tick is then longer than the resonance can show in it.
const MAX_SUBSTEPS: f64 = 64.0;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct NonlinearRod {
    /// Its gain is per strain.
    two_pole: TwoPole,
    delta_e: Option<DeltaE>,
    stiffening: Option<Stiffening>,
    friction: Option<Friction>,
    /// Of a substep; none for a rod that is always at rest.
    propagator: Option<TwoPolePropagator>,
    substeps: u32,
    /// What a unit of N at the end of a substep adds to the state there, and what a unit of mean mean excess does.
    response: RodState,
    mean_excess_response: RodState,
    substep_s: f64,
    /// z of the last substep.
    stiffness: f64,
    pub state: RodState,
    from: Moment,
    /// N at the state, and its change over the last substep.
    own: f64,
    trend: f64,
    /// Change of N, m/s², after which Newton's next one is below 4e-5 of the friction (tanh″ < 0.77), or a picometre.
    accepted: f64,
}

/// What acts on the rod at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Moment {
    by_strain: f64,
    by_force: f64,
    /// s − 1.
    growth: f64,
}

impl Moment {
    fn between(from: Moment, to: Moment, share: f64) -> Moment {
        let mix = |from: f64, to: f64| from + share * (to - from);
        Moment {
            by_strain: mix(from.by_strain, to.by_strain),
            by_force: mix(from.by_force, to.by_force),
            growth: mix(from.growth, to.growth),
        }
    }
}

impl NonlinearRod {
    /// A rod that is always in equilibrium.
    pub fn resting(model: &ActuatorModel, two_pole: TwoPole) -> Self {
        let values = |kind| model.effect(kind).map(|effect| effect.values());
        let saturation = model.material.hysteresis.saturation_magnetization_a_per_m;
        let [_, size] = model.material.decades();
        NonlinearRod {
            two_pole,
            delta_e: values(EffectKind::DeltaE).map(|values| DeltaE::new(values, saturation)),
            stiffening: values(EffectKind::Stiffening).map(Stiffening::new),
            friction: values(EffectKind::Friction).map(|values| Friction::new(values, two_pole.stiffness_per_s2, size)),
            propagator: None,
            substeps: 0,
            response: RodState::default(),
            mean_excess_response: RodState::default(),
            substep_s: 0.0,
            stiffness: 0.0,
            state: RodState::default(),
            from: Moment::default(),
            own: 0.0,
            trend: 0.0,
            accepted: 0.0,
        }
    }

    pub fn new(model: &ActuatorModel, two_pole: TwoPole, tick_s: f64) -> Result<Self, ModelError> {
        let turn = libm::sqrt(two_pole.stiffness_per_s2) * tick_s;
        let substeps = libm::ceil(turn / MAX_TURN).clamp(1.0, MAX_SUBSTEPS);
        let propagator = TwoPolePropagator::new(two_pole, tick_s / substeps)?;
        let response = propagator.advance(RodState::default(), 0.0, 1.0);
        let resting = Self::resting(model, two_pole);
        // Newton's error is the square of the move over the width of the bend: 1 μm of a spring, v₀ and z₀ of friction.
        let presliding_m = resting.friction.map_or(0.0, |friction| friction.presliding_m());
        let spring_m = 1e-7 * model.material.decades()[1];
        let bend_m = if presliding_m > 0.0 {
            presliding_m.min(spring_m)
        } else {
            spring_m
        };
        let by_displacement = 1e-2 * bend_m / response.displacement_m;
        let by_velocity = resting.friction.map_or(f64::INFINITY, |friction| {
            1e-2 * friction.speed_m_per_s() / response.velocity_m_per_s
        });
        Ok(NonlinearRod {
            propagator: Some(propagator),
            substeps: substeps as u32,
            response,
            mean_excess_response: propagator.advance_curved(RodState::default(), 0.0, 0.0, 1.0),
            substep_s: tick_s / substeps,
            accepted: by_displacement.min(by_velocity),
            ..resting
        })
    }

    /// Whether it is more than a linear rod.
    pub fn has_own_forces(&self) -> bool {
        self.delta_e.is_some() || self.stiffening.is_some() || self.friction.is_some()
    }

    /// ĉ, 1/s².
    pub fn stiffness_per_s2(&self) -> f64 {
        self.two_pole.stiffness_per_s2
    }

    /// N at the state, m/s².
    pub fn own_acceleration(&self) -> f64 {
        self.own
    }

    /// N (m/s²) of a motion that is given, with this acceleration (m/s²) and magnetization (A/m): A is not known then, but what it must be.
    pub fn own_along(&self, state: RodState, acceleration: f64, magnetization_a_per_m: f64) -> f64 {
        let (others, _, _) = self.own(state, Moment::default());
        let growth = self
            .delta_e
            .map_or(0.0, |delta_e| delta_e.growth(magnetization_a_per_m));
        let moved = acceleration + self.two_pole.damping_per_s * state.velocity_m_per_s;
        others - growth / (1.0 + growth) * (others - moved)
    }

    /// Stands there on a motion that is given.
    pub fn follow(&mut self, state: RodState) {
        if let Some(friction) = &mut self.friction {
            friction.slide(state.displacement_m - self.state.displacement_m, state.velocity_m_per_s);
        }
        self.state = state;
    }

    fn moment(&self, load: &Load, index: usize) -> Moment {
        let by_strain = self.two_pole.gain * load.strain[index];
        let by_force = self.two_pole.force_gain_per_kg * load.force_n(index);
        let growth = self
            .delta_e
            .map_or(0.0, |delta_e| delta_e.growth(load.magnetization[index]));
        Moment {
            by_strain,
            by_force,
            growth,
        }
    }

    /// N and its slopes in displacement and velocity.
    #[inline]
    fn own(&self, state: RodState, moment: Moment) -> (f64, f64, f64) {
        let stiffness = self.two_pole.stiffness_per_s2;
        let mut own = -moment.growth * (stiffness * state.displacement_m - moment.by_strain);
        let mut by_displacement = -moment.growth * stiffness;
        let mut by_velocity = 0.0;
        if let Some(stiffening) = &self.stiffening {
            let (excess, slope) = stiffening.excess(state.displacement_m);
            own -= stiffness * excess;
            by_displacement -= stiffness * slope;
        }
        if let Some(friction) = &self.friction {
            let way_m = state.displacement_m - self.state.displacement_m;
            let (acceleration, by_way, slope) = friction.acceleration(way_m, state.velocity_m_per_s);
            own += acceleration;
            by_displacement += by_way;
            by_velocity += slope;
        }
        (own, by_displacement, by_velocity)
    }

    /// Comes to rest under what acts now; displacement in m.
    pub fn steady_state(&mut self, load: &Load, index: usize) -> f64 {
        if let Some(friction) = &mut self.friction {
            friction.release();
        }
        let moment = self.moment(load, index);
        let stiffness = self.two_pole.stiffness_per_s2;
        let given = moment.by_strain + moment.by_force;
        let mut state = RodState {
            displacement_m: given / stiffness,
            velocity_m_per_s: 0.0,
        };
        for _ in 0..60 {
            let (own, slope, _) = self.own(state, moment);
            let excess = stiffness * state.displacement_m - given - own;
            // A softened spring may have no slope left; then it does not hold the load and stays where it is.
            let steepness = (stiffness - slope).max(1e-3 * stiffness);
            let correction = excess / steepness;
            state.displacement_m -= correction;
            if correction.abs() <= 1e-14 * state.displacement_m.abs() {
                break;
            }
        }
        let (own, _, by_velocity) = self.own(state, moment);
        (self.own, self.trend) = (own, 0.0);
        self.stiffness = -by_velocity * self.substep_s;
        (self.state, self.from) = (state, moment);
        state.displacement_m
    }

    /// One tick; displacement in m.
    pub fn step(&mut self, load: &Load, index: usize) -> f64 {
        let Some(propagator) = self.propagator else {
            return self.steady_state(load, index);
        };
        let to = self.moment(load, index);
        let mean_excess = self.two_pole.gain * load.mean_excess[index];
        let part = 1.0 / f64::from(self.substeps);
        let mut before = self.from;
        for substep in 1..=self.substeps {
            let share = f64::from(substep) * part;
            let mut after = Moment::between(self.from, to, share);
            // The parabola with this mean; a part of it has the same curvature.
            after.by_strain += 6.0 * mean_excess * share * (1.0 - share);
            let unchanged = propagator.advance_curved(
                self.state,
                before.by_strain + before.by_force + self.own,
                after.by_strain + after.by_force + self.own,
                mean_excess * part * part,
            );
            self.solve(unchanged, after);
            before = after;
        }
        self.from = to;
        self.state.displacement_m
    }

    /// Finds N at the end of the substep, from the state that would be reached with N as it was.
    fn solve(&mut self, unchanged: RodState, moment: Moment) {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let square = self.stiffness * self.stiffness;
        let lean = 0.5 * square / (STIFF * STIFF + square);
        let response = RodState {
            displacement_m: self.response.displacement_m + lean * self.mean_excess_response.displacement_m,
            velocity_m_per_s: self.response.velocity_m_per_s + lean * self.mean_excess_response.velocity_m_per_s,
        };
        let with = |change: f64| RodState {
            displacement_m: unchanged.displacement_m + response.displacement_m * change,
            velocity_m_per_s: unchanged.velocity_m_per_s + response.velocity_m_per_s * change,
        };
        let before = self.own;
        let mut guess = before + self.trend;
        for _ in 0..60 {
            let (own, by_displacement, by_velocity) = self.own(with(guess - before), moment);
            let excess = guess - own;
            if excess > 0.0 {
                high = guess;
            } else {
                low = guess;
            }
            let steepness = 1.0 - by_displacement * response.displacement_m - by_velocity * response.velocity_m_per_s;
            self.stiffness = -(by_velocity + by_displacement * self.substep_s) * self.substep_s;
            let mut next = guess - excess / steepness;
            let moved = (next - guess).abs();
            // An end of the bracket has been tried: between two flanks of a tanh, Newton would go to and fro for ever.
            if moved > self.accepted && !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            guess = next;
            if moved <= self.accepted {
                break;
            }
        }
        self.follow(with(guess - before));
        (self.own, self.trend) = (guess, guess - before);
    }
}

#[cfg(test)]
mod tests {
    use super::super::rod_stage::RodStage;
    use super::*;
    use crate::Effect;

    fn load<'a>(strain: &'a [f64], at_rest: &'a [f64]) -> Load<'a> {
        Load {
            first: true,
            strain,
            mean_excess: at_rest,
            magnetization: at_rest,
            force: None,
        }
    }

    fn started(model: &ActuatorModel, tick_s: f64, load: &Load) -> NonlinearRod {
        let RodStage::Nonlinear(mut rod) = RodStage::new(model, model.actuator_rod(), tick_s).unwrap() else {
            panic!("friction is a force of the rod's own");
        };
        rod.steady_state(load, 0);
        rod
    }

    /// Guards the search for N: where the tip turned within a substep, Newton once went to and fro between the flanks of the
    /// tanh, stopped with the friction pushing, and left the tip 166 nm off.
    #[test]
    fn every_tick_ends_with_the_friction_of_its_velocity() {
        let (friction_m, speed_m_per_s) = (1e-5, 1e-4);
        let effect = Effect::new(EffectKind::Friction, &[friction_m, speed_m_per_s, 1e-9]).unwrap();
        let model = ActuatorModel::terfenol_d().with_effect(effect);
        let angle = |tick: usize| 0.0565 * tick as f64;
        let strain: Vec<f64> = (0..3000)
            .map(|tick| 4e-4 * libm::sin(angle(tick)) + 2e-4 * libm::sin(2.7 * angle(tick)))
            .collect();
        let at_rest = vec![0.0; strain.len()];
        let load = load(&strain, &at_rest);
        let mut rod = started(&model, 1e-4, &load);
        let level = model.rod.unwrap().stiffness_per_s2 * friction_m;
        for tick in 1..strain.len() {
            rod.step(&load, tick);
            let (own, _, _) = rod.own(rod.state, rod.from);
            let off = (own - rod.own).abs() / level;
            assert!(off < 1e-3, "tick {tick}: off by {off:e} of the friction");
        }
    }

    /// Guards what sticks: however short the way over which friction turns round, ticks half as long give the same motion.
    #[test]
    fn what_sticks_neither_rings_nor_runs_away() {
        let course = |presliding_m: f64, ticks: usize| {
            let effect = Effect::new(EffectKind::Friction, &[1e-6, 1e-3, presliding_m]).unwrap();
            let model = ActuatorModel::terfenol_d().with_effect(effect);
            let tick_s = 1e-4 / ticks as f64;
            let strain: Vec<f64> = (0..4000 * ticks)
                .map(|index| {
                    let time_s = index as f64 * tick_s;
                    3e-4 * libm::sin(200.0 * time_s) + 1e-4 * libm::sin(1300.0 * time_s)
                })
                .collect();
            let at_rest = vec![0.0; strain.len()];
            let load = load(&strain, &at_rest);
            let mut rod = started(&model, tick_s, &load);
            let course = (1..strain.len()).map(|index| (index, rod.step(&load, index)));
            course
                .filter(|(index, _)| index % ticks == 0)
                .map(|(_, tip_m)| tip_m)
                .collect::<Vec<f64>>()
        };
        for presliding_m in [1e-9, 1.1e-9, 3e-9, 1e-8, 5e-8, 5e-7] {
            let (coarse, fine) = (course(presliding_m, 1), course(presliding_m, 8));
            let squares = coarse.iter().zip(&fine).map(|(one, other)| (one - other).powi(2));
            let off_m = (squares.sum::<f64>() / coarse.len() as f64).sqrt();
            // Without any such way the straight lines of the load between ticks put it off by 11 nm of 20 μm.
            assert!(off_m < 15e-9, "{presliding_m:e} m: off by {off_m:e} m");
        }
    }

    /// Guards what a controller asks for: along the motion that a rod makes, a second one that only follows knows the forces of the first.
    #[test]
    fn along_a_motion_the_forces_are_those_of_the_rod_that_makes_it() {
        let effects = [
            Effect::new(EffectKind::DeltaE, &[0.4]).unwrap(),
            Effect::new(EffectKind::Stiffening, &[2e8]).unwrap(),
            Effect::new(EffectKind::Friction, &[1e-6, 1e-4, 2e-7]).unwrap(),
        ];
        let model = effects
            .into_iter()
            .fold(ActuatorModel::terfenol_d(), ActuatorModel::with_effect);
        let strain: Vec<f64> = (0..3000).map(|tick| 4e-4 * libm::sin(0.02 * tick as f64)).collect();
        let magnetization: Vec<f64> = strain.iter().map(|strain| 1e9 * strain).collect();
        let at_rest = vec![0.0; strain.len()];
        let load = Load {
            magnetization: &magnetization,
            ..load(&strain, &at_rest)
        };
        let mut rod = started(&model, 5e-5, &load);
        let mut follower = rod.clone();
        let two_pole = rod.two_pole;
        let largest = (1..strain.len()).fold([0.0_f64; 2], |[off, size], tick| {
            rod.step(&load, tick);
            let pulled = rod.from.by_strain + rod.own;
            let held = two_pole.damping_per_s * rod.state.velocity_m_per_s
                + two_pole.stiffness_per_s2 * rod.state.displacement_m;
            follower.follow(rod.state);
            let own = follower.own_along(rod.state, pulled - held, magnetization[tick]);
            [off.max((own - rod.own).abs()), size.max(rod.own.abs())]
        });
        assert!(largest[0] < 1e-3 * largest[1], "{largest:?}");
    }
}
