//! A rod without hysteresis around a controller: the demanded magnetization is what flows, two ticks later, straight between.

#![allow(dead_code, reason = "every test file uses a part of it")]

use anhyst_controller::{Controller, ControllerSettings, Motion, TrajectorySettings};
use anhyst_ipc::{Block, Demand, FieldCommand, Measurement, Now, Previous, SafeField, status_word};
use anhyst_model::{Material, RodConstants, RodElements, RodState, TwoPole, TwoPolePropagator};
use std::path::Path;

pub const TICK_S: f64 = 5e-5;
/// A curved strain law is straight enough within a part of a tick.
const SUBSTEPS: u32 = 8;

/// The paper's rod, two elements, gain per free strain.
pub fn rod() -> TwoPole {
    RodElements::assemble(&RodConstants::paper(), 2).unwrap().two_pole(1.0)
}

/// Position, velocity, acceleration, jerk, snap.
pub fn derivatives(motion: Motion) -> [f64; 5] {
    [
        motion.position_m,
        motion.velocity_m_per_s,
        motion.acceleration_m_per_s2,
        motion.jerk_m_per_s3,
        motion.snap_m_per_s4,
    ]
}

/// 50 Hz and 150 Hz, ±40 µm together at most.
pub fn two_tones() -> TrajectorySettings {
    TrajectorySettings::Harmonics {
        mean_m: 0.0,
        terms: vec![(40e-6, 50.0, 0.0), (12e-6, 150.0, 0.3)],
    }
}

pub fn settings(trajectory: TrajectorySettings) -> ControllerSettings {
    ControllerSettings {
        trajectory,
        start_s: 0.0,
        feedforward: true,
        hold_correction: true,
        feedback: None,
        learning: None,
    }
}

pub fn controller(settings: &ControllerSettings) -> Controller {
    Controller::new(settings, rod(), &Material::terfenol_d(), TICK_S, Path::new(".")).unwrap()
}

/// Controller, pure delay, rod.
pub struct Rig {
    pub controller: Controller,
    pub material: Material,
    rod: TwoPole,
    propagator: TwoPolePropagator,
    state: RodState,
    /// Magnetization at t_k and t_{k+1}.
    on_the_way: [f64; 2],
    command: FieldCommand,
    safe: SafeField,
    /// The inverse's limit, here directly on the magnetization.
    pub limit_a_per_m: f64,
    pub tick: u64,
    /// Of the sensor.
    sign: f64,
}

impl Rig {
    pub fn new(settings: &ControllerSettings) -> Self {
        let propagator = TwoPolePropagator::new(rod(), TICK_S / f64::from(SUBSTEPS)).unwrap();
        Self {
            controller: controller(settings),
            material: Material::terfenol_d(),
            rod: rod(),
            propagator,
            state: RodState::default(),
            on_the_way: [0.0; 2],
            command: FieldCommand::default(),
            safe: SafeField::default(),
            limit_a_per_m: f64::INFINITY,
            tick: 0,
            sign: 1.0,
        }
    }

    /// One tick with the cutting force (N) at its beginning and end; gives the demand and the displacement at t_k.
    pub fn step(&mut self, force_n: (f64, f64)) -> (Demand, f64) {
        let displacement_m = self.sign * self.state.displacement_m;
        let measurement = Measurement {
            displacement_m,
            ..Measurement::default()
        };
        let inputs = (Now(measurement), Previous(self.safe), Previous(self.command));
        let (demand,) = self.controller.step(self.tick, inputs);
        let reached = demand
            .magnetization_a_per_m
            .clamp(-self.limit_a_per_m, self.limit_a_per_m);
        self.command = FieldCommand {
            reached_magnetization_a_per_m: reached,
            status: status_word([(reached != demand.magnetization_a_per_m, FieldCommand::LIMITED)]),
            ..FieldCommand::default()
        };
        for part in 0..SUBSTEPS {
            let [from, to] =
                [part, part + 1].map(|part| self.acceleration(f64::from(part) / f64::from(SUBSTEPS), force_n));
            self.state = self.propagator.advance(self.state, from, to);
        }
        self.on_the_way = [self.on_the_way[1], reached];
        self.tick += 1;
        (demand, displacement_m)
    }

    /// From now on the sensor says the opposite.
    pub fn reverse(&mut self) {
        self.sign = -self.sign;
    }

    /// Acceleration of the rod at a part of the tick: magnetization and force are straight lines, the strain is not.
    fn acceleration(&self, part: f64, force_n: (f64, f64)) -> f64 {
        let saturation = self.material.hysteresis.saturation_magnetization_a_per_m;
        let m = self.on_the_way[0] + part * (self.on_the_way[1] - self.on_the_way[0]);
        let force = force_n.0 + part * (force_n.1 - force_n.0);
        self.rod.gain * self.material.magnetostriction.strain(m, saturation) - self.rod.force_gain_per_kg * force
    }

    /// Errors (reference − displacement) at every tick of a run without force.
    pub fn errors(&mut self, duration_s: f64) -> Vec<f64> {
        (0..(duration_s / TICK_S) as u64)
            .map(|_| self.step((0.0, 0.0)).0.error_m)
            .collect()
    }
}

pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}
