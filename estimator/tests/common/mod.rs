//! A plant made of the same physics as the estimator, in an open loop: a field is commanded, the plant moves, the
//! estimator hears displacement and command.

#![allow(dead_code, reason = "every test file uses a part of it")]

use anhyst_estimator::{Estimation, Estimator, EstimatorSettings, LawSettings};
use anhyst_model::{
    Amplifier, AmplifierConstants, MagneticState, Material, Noise, RodState, TwoPole, TwoPolePropagator,
};

pub const TICK_S: f64 = 5e-5;

/// A law, and otherwise what is usual.
pub fn with(law: LawSettings) -> EstimatorSettings {
    EstimatorSettings {
        law,
        ..EstimatorSettings::default()
    }
}

/// The paper's rod, with its gain per unit of free strain.
pub fn rod(material: &Material) -> TwoPole {
    TwoPole {
        gain: 1.3724e-2 / material.strain_per_magnetization(),
        damping_per_s: 7.8899e3,
        stiffness_per_s2: 6.4251e7,
        force_gain_per_kg: 0.0,
    }
}

pub struct Rig {
    pub material: Material,
    pub amplifier: Amplifier,
    magnetic: MagneticState,
    acceleration: f64,
    pub rod: RodState,
    propagator: TwoPolePropagator,
    pub noise: Noise,
}

impl Rig {
    pub fn new(amplifier: AmplifierConstants) -> Self {
        let material = Material::terfenol_d();
        Rig {
            amplifier: Amplifier::new(amplifier, TICK_S).unwrap(),
            magnetic: MagneticState::default(),
            acceleration: 0.0,
            rod: RodState::default(),
            propagator: TwoPolePropagator::new(rod(&material), TICK_S).unwrap(),
            noise: Noise::new(1, 0),
            material,
        }
    }

    /// One tick of the interval that ends at t_k, with the field that ends it.
    pub fn advance(&mut self, shape_a_per_m: f64, field_a_per_m: f64) {
        let hysteresis = self.material.hysteresis.with_shape(shape_a_per_m);
        self.magnetic = hysteresis.advance(self.magnetic, field_a_per_m);
        let saturation = hysteresis.saturation_magnetization_a_per_m;
        let strain = self
            .material
            .magnetostriction
            .strain(self.magnetic.magnetization_a_per_m, saturation);
        let reached = rod(&self.material).gain * strain;
        self.rod = self.propagator.advance(self.rod, self.acceleration, reached);
        self.acceleration = reached;
    }
}

/// Field of ±40 µm at 50 Hz and 30 % at 150 Hz, roughly.
pub fn command(tick: u64) -> f64 {
    let angle = 2.0 * std::f64::consts::PI * 50.0 * TICK_S * tick as f64;
    9000.0 * (angle.sin() + 0.3 * (3.0 * angle).sin())
}

/// Runs `seconds` with a(t) and noise; `seen` gets the time, the truth and what the estimator says.
pub fn run(
    settings: &EstimatorSettings,
    seconds: f64,
    shape_a_per_m: impl Fn(f64) -> f64,
    noise_m: f64,
    seen: impl FnMut(f64, f64, MagneticState, &Estimation),
) {
    run_commanded(settings, seconds, shape_a_per_m, noise_m, command, seen);
}

/// The same with any command.
pub fn run_commanded(
    settings: &EstimatorSettings,
    seconds: f64,
    shape_a_per_m: impl Fn(f64) -> f64,
    noise_m: f64,
    command: impl Fn(u64) -> f64,
    mut seen: impl FnMut(f64, f64, MagneticState, &Estimation),
) {
    let amplifier = AmplifierConstants {
        bandwidth_hz: Some(2000.0),
        ..AmplifierConstants::default()
    };
    let mut rig = Rig::new(amplifier);
    let mut estimator = Estimator::new(settings, &rig.material, rod(&rig.material), amplifier, TICK_S).unwrap();
    let (mut last_command, mut field) = (0.0, 0.0);
    for tick in 0..(seconds / TICK_S) as u64 {
        let time_s = tick as f64 * TICK_S;
        let shape = shape_a_per_m(time_s);
        if tick > 0 {
            rig.advance(shape, field);
        }
        let measured = rig.rod.displacement_m + noise_m * rig.noise.normal();
        let found = estimator.step(tick, last_command, field, measured);
        seen(time_s, shape, rig.magnetic, &found);
        last_command = command(tick);
        field = rig.amplifier.step(last_command).field_a_per_m;
        assert_eq!(found.field.next_a_per_m, field);
    }
}

/// Stores, loads and continues an estimator in the middle of a run.
pub fn assert_a_snapshot_continues(settings: &EstimatorSettings, amplifier: AmplifierConstants) {
    let material = Material::terfenol_d();
    let mut original = Estimator::new(settings, &material, rod(&material), amplifier, TICK_S).unwrap();
    let displacement = |tick: u64| 4e-9 * command(tick);
    for tick in 0..700 {
        original.step(tick, command(tick), 0.0, displacement(tick));
    }
    let mut copy: Estimator = serde_json::from_str(&serde_json::to_string(&original).unwrap()).unwrap();
    for tick in 700..1500 {
        let expected = original.step(tick, command(tick), 0.0, displacement(tick));
        assert_eq!(copy.step(tick, command(tick), 0.0, displacement(tick)), expected);
    }
}
